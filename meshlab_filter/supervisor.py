"""Running a command in a process of its own, so that a crash inside MeshLab ends as a sentence.

MeshLab's readers and filters are native code; some inputs end the process they run in. The parent
process here imports neither MeshLab nor numpy, waits, and says what happened.
"""

from __future__ import annotations

import _thread
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from .interpreter import python_command
from .outputs import PARTIALS_VARIABLE, clear_partials

#: Set in the environment of the process that does the work: the folder it shares with its parent.
FOLDER_VARIABLE = "MESHLAB_FILTER_SUPERVISED"
#: Seconds that native code, which no request to end can reach, has before it is ended.
GRACE = 3.0

_REQUESTS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
_INTERRUPTED = "Interrupted; nothing was left half-written."


def supervise(arguments: Sequence[str]) -> int:
    """Run the command line in a child process and return its exit code.

    Parameters
    ----------
    arguments : sequence of str
        The command line without the program's name.

    Returns
    -------
    int
        The child's exit code; 6 with a sentence on stderr if it died.
    """
    with tempfile.TemporaryDirectory(prefix="meshlab-filter-") as name:
        folder = Path(name)
        stage, partials = folder / "stage", folder / "partials"
        environment = {
            **os.environ,
            FOLDER_VARIABLE: name,
            "MESHLAB_FILTER_STAGE": str(stage),
            PARTIALS_VARIABLE: str(partials),
        }
        # The child starts deaf to Ctrl-C, which would otherwise end it in a traceback before it
        # is ready; what it misses is handed on below. Its standard input ends when this process
        # does, however that happens.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        child = subprocess.Popen(
            python_command("meshlab_filter.__main__:main", arguments),
            env=environment,
            stdin=subprocess.PIPE,
        )
        code, asked = _wait(child)
        if 0 <= code <= 255:
            return 128 + asked if asked and code else code
        clear_partials(partials)
        if asked or -code in _REQUESTS:
            print(_INTERRUPTED, file=sys.stderr)
            return 128 + (asked or -code)
        doing = stage.read_text(encoding="utf-8") if stage.exists() else ""
        print(f"Error: {_death(code, doing)}", file=sys.stderr)
        return 6


def work(arguments: Sequence[str]) -> int:
    """Run the command line in this process, keeping what native code prints off the terminal.

    Parameters
    ----------
    arguments : sequence of str

    Returns
    -------
    int
        The exit code.
    """
    from .cli.main import invoke

    # MeshLab's plugins write straight to the process's outputs; Python keeps copies of the real
    # ones, and the numbers 1 and 2 lead to a file.
    native = os.open(Path(os.environ[FOLDER_VARIABLE]) / "native.log", os.O_WRONLY | os.O_CREAT)
    sys.stdout.flush()
    sys.stderr.flush()
    sys.stdout = os.fdopen(os.dup(1), "w", encoding=sys.stdout.encoding, errors="replace")
    sys.stderr = os.fdopen(
        os.dup(2), "w", encoding=sys.stderr.encoding, errors="replace", buffering=1
    )
    os.dup2(native, 1)
    os.dup2(native, 2)
    for number in _REQUESTS:
        signal.signal(number, _interrupt)
    folder = Path(os.environ[FOLDER_VARIABLE])
    alone = threading.Event()
    threading.Thread(target=_end_with_parent, args=(folder, alone), daemon=True).start()
    code = invoke(arguments)
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):
            stream.flush()
    if alone.is_set():
        shutil.rmtree(folder, ignore_errors=True)
    # Native libraries may crash while they are taken down, after all is done.
    os._exit(code)


def is_worker() -> bool:
    """Tell whether this process is the one that does the work."""
    return FOLDER_VARIABLE in os.environ


def _wait(child: subprocess.Popen[bytes]) -> tuple[int, int]:
    """Wait for the child, handing on requests to end; return its code and the first request."""
    requests: list[int] = []

    def hand_on(number: int, frame: object) -> None:
        if os.name == "posix":
            child.send_signal(number)
        if not requests:
            ending = threading.Timer(GRACE, child.kill)
            ending.daemon = True
            ending.start()
        requests.append(number)

    for number in _REQUESTS:
        signal.signal(number, hand_on)
    code = child.wait()
    return code, requests[0] if requests else 0


def _interrupt(number: int, frame: object) -> None:
    # A second request must not interrupt the clearing away that the first one started.
    for other in _REQUESTS:
        signal.signal(other, signal.SIG_IGN)
    raise KeyboardInterrupt


def _end_with_parent(folder: Path, alone: threading.Event) -> None:
    """Wait until the parent is gone; then ask the main thread to end, or end it."""
    while os.read(0, 1):
        pass
    alone.set()
    _thread.interrupt_main()
    time.sleep(GRACE)
    clear_partials(folder / "partials")
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(130)


def _death(code: int, doing: str) -> str:
    """Say what a process died of."""
    kept = "the input is untouched and no output was left half-written"
    if -code == getattr(signal, "SIGKILL", None):
        return (
            f"The system ended the work{' while ' + doing if doing else ''} (Killed), as it does "
            f"when memory runs out; {kept}."
        )
    name = f"signal {-code}, {signal.strsignal(-code)}" if code < 0 else f"exit code {code:#x}"
    return (
        f"MeshLab crashed{' while ' + doing if doing else ''} ({name}); {kept}. The file may be "
        "damaged, or the cloud too large for this machine."
    )
