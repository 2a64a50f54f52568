"""Reading files through MeshLab in a process of its own, which may crash, hang or eat memory.

MeshLab's readers trust what a file says about itself. A damaged one can end the process, keep it
busy for hours or fill the memory; here that ends as a sentence.
"""

from __future__ import annotations

import faulthandler
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..errors import FileFormatError, MeshLabError, MeshlabFilterError
from ..interpreter import python_command
from .layer import current_normals
from .session import import_pymeshlab, load

if TYPE_CHECKING:
    import pymeshlab

#: Seconds a file may take, and further seconds for each byte of it (2 s for a megabyte).
SECONDS, SECONDS_A_BYTE = 15.0, 2e-6
#: Bytes of memory a file may take, and further bytes for each byte of it.
MEMORY, MEMORY_A_BYTE = 2**30, 200


class MeshReader:
    """A process that reads files through MeshLab, one after the other; it is restarted if it dies.

    Parameters
    ----------
    seconds : float
        What an empty file may take; ``SECONDS_A_BYTE`` is added for each byte.

    Examples
    --------
    >>> from meshlab_filter.bridge.samples import sample_mesh
    >>> with MeshReader() as reader:
    ...     arrays = reader.read(sample_mesh("bunny.obj"))
    >>> arrays["points"].shape, arrays["faces"].shape
    ((28088, 3), (56172, 3))
    """

    def __init__(self, *, seconds: float = SECONDS) -> None:
        self._base = seconds
        self._child: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> MeshReader:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def read(self, path: Path) -> dict[str, npt.NDArray[Any]]:
        """Read a file.

        Parameters
        ----------
        path : Path

        Returns
        -------
        dict
            "points" (V, 3); "faces" (F, 3), int64; "normals" (V, 3) and "colors" (V, 4) if the
            file has them; "dropped", how many vertices MeshLab left out because they are not
            finite.

        Raises
        ------
        FileFormatError
            If MeshLab cannot read it, crashes on it, or takes too long or too much memory.
        MeshLabError
            If pymeshlab cannot be imported.
        """
        _check_stl(path)
        child = self._started()
        assert child.stdin is not None
        assert child.stdout is not None
        seconds = self._base + SECONDS_A_BYTE * path.stat().st_size
        begun = time.monotonic()
        try:
            child.stdin.write(json.dumps([os.fspath(path), seconds]).encode() + b"\n")
            child.stdin.flush()
            return _receive(child.stdout)
        except (BrokenPipeError, EOFError) as error:
            code = child.wait()
            self._child = None
            if time.monotonic() - begun >= seconds:
                what = f"MeshLab was not done with the file after {seconds:.0f} s"
            else:
                what = f"MeshLab crashed on the file ({_ending(code)})"
            raise FileFormatError(f"{what}; it may be damaged. Given: {path}.") from error
        except BaseException as error:
            if not isinstance(error, MeshlabFilterError):
                self.close()
            raise

    def close(self) -> None:
        """End the process."""
        if self._child is not None:
            self._child.kill()
            self._child.communicate()
            self._child = None

    def _started(self) -> subprocess.Popen[bytes]:
        if self._child is None:
            self._child = subprocess.Popen(
                python_command("meshlab_filter.bridge.meshreader:serve"),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
            )
        return self._child


def serve() -> None:
    """Answer the requests on standard input until it ends."""
    # Whoever started this process ends it; the keyboard does not.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = os.fdopen(os.dup(1), "wb")
    with open(os.devnull, "wb") as sink:
        os.dup2(sink.fileno(), 1)
    with suppress(BrokenPipeError):
        for line in sys.stdin.buffer:
            name, seconds = json.loads(line)
            path = Path(name)
            try:
                _send(answers, arrays=_read(path, seconds))
            except MeshlabFilterError as error:
                _send(answers, error=error)
            except MemoryError:
                _send(answers, error=FileFormatError(
                    f"The file asks for more memory than its size explains; it may be damaged. "
                    f"Given: {path}."
                ))  # fmt: skip
    # Native libraries may crash while they are taken down, after all is done.
    os._exit(0)


def _read(path: Path, seconds: float) -> dict[str, npt.NDArray[Any]]:
    """Read a file in this process, within its limits of time and memory."""
    meshset = import_pymeshlab().MeshSet(verbose=True)
    _limit_memory(MEMORY + MEMORY_A_BYTE * path.stat().st_size)
    # A thread of the interpreter ends the process even if native code never comes back.
    with open(os.devnull, "w") as sink:
        faulthandler.dump_traceback_later(seconds, exit=True, file=sink)
        try:
            log = _logged(lambda: load(meshset, path))
            if meshset.mesh_number() != 1:
                raise FileFormatError(
                    f"The file must hold one cloud or mesh. Given: {meshset.mesh_number()} in "
                    f"{path}."
                )
            return _arrays(meshset, log)
        finally:
            faulthandler.cancel_dump_traceback_later()


def _logged(call: Any) -> str:
    """Return what native code writes to standard error meanwhile: MeshLab's only way to warn."""
    with tempfile.TemporaryFile() as log:
        os.dup2(log.fileno(), 2)
        call()
        log.seek(0)
        return log.read().decode("utf-8", "replace")


def _arrays(meshset: pymeshlab.MeshSet, log: str) -> dict[str, npt.NDArray[Any]]:
    mesh = meshset.current_mesh()
    left_out = re.search(r"mesh contains (\d+) vertices with NAN coords", log)
    arrays = {
        "points": mesh.vertex_matrix(),
        "faces": np.asarray(mesh.face_matrix(), dtype=np.int64).reshape(-1, 3),
        "dropped": np.array(int(left_out.group(1)) if left_out else 0),
    }
    normals = current_normals(meshset) if mesh.face_number() == 0 else None
    if normals is not None:
        arrays["normals"] = normals
    if mesh.has_vertex_color():
        arrays["colors"] = mesh.vertex_color_matrix()
    return arrays


def _send(
    stream: IO[bytes],
    *,
    arrays: Mapping[str, npt.NDArray[Any]] | None = None,
    error: MeshlabFilterError | None = None,
) -> None:
    head: dict[str, Any] = {"error": None, "arrays": []}
    if error is not None:
        head["error"] = [type(error).__name__, str(error)]
    arrays = arrays or {}
    for name, array in arrays.items():
        head["arrays"].append([name, array.dtype.str, array.shape])
    stream.write(json.dumps(head).encode() + b"\n")
    for array in arrays.values():
        stream.write(array.tobytes())
    stream.flush()


def _receive(stream: IO[bytes]) -> dict[str, npt.NDArray[Any]]:
    line = stream.readline()
    if not line.endswith(b"\n"):
        raise EOFError
    head = json.loads(line)
    if head["error"] is not None:
        name, text = head["error"]
        raise (MeshLabError if name == "MeshLabError" else FileFormatError)(text)
    arrays = {}
    for name, dtype, shape in head["arrays"]:
        array = np.empty(shape, dtype=dtype)
        data = stream.read(array.nbytes)
        if len(data) < array.nbytes:
            raise EOFError
        arrays[name] = np.frombuffer(bytearray(data), dtype=dtype).reshape(shape)
    return arrays


def _limit_memory(more: int) -> None:
    """Let this process take so many bytes more than it has, on systems that hold it to that."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[0])
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        limit = pages * resource.getpagesize() + more
        if hard != resource.RLIM_INFINITY:
            limit = min(limit, hard)
        resource.setrlimit(resource.RLIMIT_AS, (limit, hard))


def _check_stl(path: Path) -> None:
    """Refuse a binary STL file that announces more triangles than it has, quickly: MeshLab is slow.

    Raises
    ------
    FileFormatError
        If 84 bytes of header and 50 for each triangle are more than the file.
    """
    if path.suffix.lower() != ".stl":
        return
    with open(path, "rb") as file:
        header = file.read(84)
    size = path.stat().st_size
    if len(header) == 84 and not header.startswith(b"solid"):
        count = int.from_bytes(header[80:], "little")
        if 84 + 50 * count > size:
            raise FileFormatError(
                f"The file is cut short: it announces {count} triangles, {84 + 50 * count} bytes, "
                f"and has {size}. Given: {path}."
            )


def _ending(code: int) -> str:
    if code < 0:
        return signal.strsignal(-code) or f"signal {-code}"
    return f"exit code {code:#x}"
