"""Outputs that appear whole under their final name or not at all."""

from __future__ import annotations

import glob
import os
import secrets
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from .errors import OutputError

#: Names of the environment variable that tells a supervised process where to list its partial
#: outputs, so that whoever supervises it can clear them away if it dies.
PARTIALS_VARIABLE = "MESHLAB_FILTER_PARTIALS"


@contextmanager
def writing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a hidden name beside ``path`` to write to; rename it to ``path`` when all went well.

    Parameters
    ----------
    path : path-like
        The final name of the file.

    Yields
    ------
    Path
        A name in the same folder with the same extension.

    Raises
    ------
    OutputError
        If the folder cannot be written to, or the disk is full.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> with writing(folder / "figures.txt") as partial:
    ...     _ = partial.write_text("42")
    >>> [file.name for file in folder.iterdir()]
    ['figures.txt']
    """
    # A link stays a link; what it leads to is replaced.
    path = Path(os.path.realpath(path))
    try:
        partial, lock = _begin(path.parent, f".{path.stem}.", f".partial{path.suffix}")
    except OSError as error:
        raise _cannot_write(path, error) from error
    try:
        yield partial
        _flush(partial)
        os.replace(partial, path)
    except OutputError:
        raise
    except OSError as error:
        raise _cannot_write(path, error) from error
    finally:
        _end(partial, lock)


@contextmanager
def writing_folder(path: str | os.PathLike[str], *, outdated: Sequence[str] = ()) -> Iterator[Path]:
    """Give a hidden folder to fill; move its files into ``path`` when all went well.

    Files of the same names in ``path`` are replaced one by one, each as a whole; others stay.

    Parameters
    ----------
    path : path-like
        The final folder, made if it does not exist.
    outdated : sequence of str
        Names of files to remove in the end if none has been written under them: they would speak
        of what was there before.

    Yields
    ------
    Path
        An empty folder on the same file system.

    Raises
    ------
    OutputError
        If the folder cannot be made or written to, or the disk is full.
    """
    path = Path(os.path.realpath(path))
    made: list[Path] = []
    staging: Path | None = None
    lock: int | None = None
    try:
        if path.exists() and not path.is_dir():
            raise OutputError(f"The output folder is a file. Given: {path}.")
        missing = [folder for folder in (path, *path.parents) if not folder.exists()]
        try:
            for folder in reversed(missing):
                folder.mkdir()
                made.append(folder)
                _announce(folder)
            staging, lock = _begin(path, ".", ".partial", folder=True)
        except OSError as error:
            raise _cannot_write(path, error) from error
        try:
            yield staging
            # In the order they were written, so that the report comes last and vouches for all.
            files = sorted(staging.iterdir(), key=lambda file: file.stat().st_mtime_ns)
            for file in files:
                _flush(file)
                if (path / file.name).is_dir():
                    raise OutputError(f"An output is a folder. Given: {path / file.name}.")
            for file in files:
                os.replace(file, path / file.name)
            for name in set(outdated) - {file.name for file in files}:
                (path / name).unlink(missing_ok=True)
        except OutputError:
            raise
        except OSError as error:
            raise _cannot_write(path, error) from error
    finally:
        if staging is not None:
            _end(staging, lock)
        for folder in reversed(made):
            if not any(folder.iterdir()):
                folder.rmdir()


def clear_partials(listing: Path) -> None:
    """Remove what a process that died had begun: the paths it listed, if nothing else is in them.

    Parameters
    ----------
    listing : Path
        The file named by ``PARTIALS_VARIABLE``, one path a line.
    """
    if not listing.exists():
        return
    for line in listing.read_text(encoding="utf-8").splitlines():
        partial = Path(line)
        if ".partial" in partial.name:
            if partial.is_dir():
                shutil.rmtree(partial, ignore_errors=True)
            else:
                partial.unlink(missing_ok=True)
        elif partial.is_dir() and not any(partial.iterdir()):
            partial.rmdir()


def _announce(*paths: Path) -> None:
    listing = os.environ.get(PARTIALS_VARIABLE)
    if listing:
        with open(listing, "a", encoding="utf-8") as file:
            file.writelines(f"{path.absolute()}\n" for path in paths)


def _flush(path: Path) -> None:
    """Put the file on the disk before it gets its name, so that a power cut cannot empty it."""
    with open(path, "rb+") as file:
        os.fsync(file.fileno())


def _begin(
    parent: Path, prefix: str, suffix: str, *, folder: bool = False
) -> tuple[Path, int | None]:
    """Make a file or folder with a name of its own; return it and the lock that says it is in use.

    Those of a process that was killed have no lock any more and are cleared away.
    """
    for stale in parent.glob(f"{glob.escape(prefix)}????????{glob.escape(suffix)}"):
        lock = _lock(stale)
        if lock is not None:
            _end(stale, lock)
    while True:
        partial = parent / f"{prefix}{secrets.token_hex(4)}{suffix}"
        try:
            if folder:
                partial.mkdir()
            else:
                os.close(os.open(partial, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        except FileExistsError:
            continue
        _announce(partial)
        lock = _lock(partial, wait=True)
        # Between making and locking, another process may have taken it for stale.
        if partial.exists():
            return partial, lock
        if lock is not None:
            os.close(lock)


def _lock(path: Path, *, wait: bool = False) -> int | None:
    """Lock a file or folder until this process ends; None if it is locked or locks are unknown."""
    try:
        import fcntl
    except ImportError:
        return None
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        return None
    return descriptor


def _end(partial: Path, lock: int | None) -> None:
    """Clear away what is left of a partial output."""
    if partial.is_dir():
        shutil.rmtree(partial, ignore_errors=True)
    else:
        partial.unlink(missing_ok=True)
    if lock is not None:
        os.close(lock)


def _cannot_write(path: Path, error: OSError) -> OutputError:
    return OutputError(f"Cannot write the output: {error.strerror or error}. Given: {path}.")
