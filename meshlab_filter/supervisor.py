"""Running a command in a process of its own, so that a crash inside MeshLab ends as a sentence.

MeshLab's readers and filters are native code; some inputs end the process they run in. The parent
process here imports neither MeshLab nor numpy, waits, and says what happened.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

#: Set in the environment of the process that does the work: the folder it shares with its parent.
FOLDER_VARIABLE = "MESHLAB_FILTER_SUPERVISED"


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
    from .outputs import PARTIALS_VARIABLE, clear_partials

    with tempfile.TemporaryDirectory(prefix="meshlab-filter-") as name:
        folder = Path(name)
        stage, partials = folder / "stage", folder / "partials"
        environment = {
            **os.environ,
            FOLDER_VARIABLE: name,
            "MESHLAB_FILTER_STAGE": str(stage),
            PARTIALS_VARIABLE: str(partials),
        }
        child = subprocess.Popen(
            [sys.executable, "-m", "meshlab_filter", *arguments], env=environment
        )
        code = _wait(child)
        if code < 0 or code > 255:
            clear_partials(partials)
        if code >= 0 and code <= 255:
            return code
        if -code in (signal.SIGTERM, signal.SIGINT):
            print("Interrupted; nothing was left half-written.", file=sys.stderr)
            return 128 - code
        doing = stage.read_text(encoding="utf-8") if stage.exists() else ""
        print(
            f"Error: MeshLab crashed{' while ' + doing if doing else ''} ({_name(code)}); the "
            "input is untouched and nothing was written. The file may be damaged, or the cloud "
            "too large for this machine.",
            file=sys.stderr,
        )
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
    signal.signal(signal.SIGTERM, _interrupt)
    code = invoke(arguments)
    sys.stdout.flush()
    sys.stderr.flush()
    # Native libraries may crash while they are taken down, after all is done.
    os._exit(code)


def is_worker() -> bool:
    """Tell whether this process is the one that does the work."""
    return FOLDER_VARIABLE in os.environ


def _wait(child: subprocess.Popen[bytes]) -> int:
    """Wait for the child; hand on requests to end, which it answers by cleaning up."""

    def hand_on(number: int, frame: object) -> None:
        child.send_signal(number)

    # Ctrl-C reaches the child by itself, as it is in the same group.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, hand_on)
    return child.wait()


def _interrupt(number: int, frame: object) -> None:
    raise KeyboardInterrupt


def _name(code: int) -> str:
    if code < 0:
        return f"signal {-code}, {signal.strsignal(-code)}"
    return f"exit code {code:#x}"
