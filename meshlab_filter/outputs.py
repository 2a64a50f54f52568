"""Outputs that appear whole under their final name or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
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
    path = Path(path)
    try:
        handle, name = tempfile.mkstemp(
            prefix=f".{path.stem}.", suffix=f".partial{path.suffix}", dir=path.parent
        )
        os.close(handle)
    except OSError as error:
        raise _cannot_write(path, error) from error
    partial = Path(name)
    _announce(partial)
    try:
        try:
            yield partial
            _flush(partial)
            os.chmod(partial, 0o666 & ~_umask())
            os.replace(partial, path)
        except OutputError:
            raise
        except OSError as error:
            raise _cannot_write(path, error) from error
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def writing_folder(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a hidden folder to fill; move its files into ``path`` when all went well.

    Files of the same names in ``path`` are replaced one by one, each as a whole; others stay.

    Parameters
    ----------
    path : path-like
        The final folder, made if it does not exist.

    Yields
    ------
    Path
        An empty folder on the same file system.

    Raises
    ------
    OutputError
        If the folder cannot be made or written to, or the disk is full.
    """
    path = Path(path)
    made: list[Path] = []
    staging: Path | None = None
    try:
        if path.exists() and not path.is_dir():
            raise OutputError(f"The output folder is a file. Given: {path}.")
        missing = [folder for folder in (path, *path.parents) if not folder.exists()]
        try:
            for folder in reversed(missing):
                folder.mkdir()
                made.append(folder)
            staging = Path(tempfile.mkdtemp(prefix=".partial.", dir=path))
        except OSError as error:
            raise _cannot_write(path, error) from error
        _announce(staging, *made)
        try:
            yield staging
            for file in sorted(staging.iterdir()):
                _flush(file)
                os.replace(file, path / file.name)
        except OutputError:
            raise
        except OSError as error:
            raise _cannot_write(path, error) from error
    finally:
        if staging is not None:
            shutil.rmtree(staging, ignore_errors=True)
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


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _cannot_write(path: Path, error: OSError) -> OutputError:
    return OutputError(f"Cannot write the output: {error.strerror or error}. Given: {path}.")
