"""The door to pymeshlab: importing it, and turning what it says into sentences."""

from __future__ import annotations

import importlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..cloud import MESHLAB_FORMATS
from ..errors import FileFormatError, MeshLabError

if TYPE_CHECKING:
    import pymeshlab

#: Name of the environment variable with the file in which a supervised process writes what it is
#: doing, so that whoever supervises it can say so if MeshLab takes the process down.
STAGE_VARIABLE = "MESHLAB_FILTER_STAGE"

#: What MeshLab's plugins need from the system, by the Debian package that has it.
SYSTEM_LIBRARIES = {"libGL.so.1": "libgl1", "libOpenGL.so.0": "libopengl0"}
_HINT = f"on Debian and Ubuntu run: apt-get install {' '.join(SYSTEM_LIBRARIES.values())}"


def import_pymeshlab() -> Any:
    """Import pymeshlab, or say what the system lacks.

    Returns
    -------
    module

    Raises
    ------
    MeshLabError
        If pymeshlab or a library it needs is not installed.
    """
    try:
        module = importlib.import_module("pymeshlab")
    except ImportError as error:
        missing = [
            package for library, package in SYSTEM_LIBRARIES.items() if library in str(error)
        ]
        if missing:
            raise MeshLabError(
                f"pymeshlab cannot be imported: a system library is missing ({error}); on Debian "
                f"and Ubuntu run: apt-get install {' '.join(SYSTEM_LIBRARIES.values())}."
            ) from error
        raise MeshLabError(
            f"pymeshlab cannot be imported ({error}); run: python -m pip install pymeshlab."
        ) from error
    return module


def version() -> str:
    """Return the version of pymeshlab, such as ``2025.7``."""
    from importlib.metadata import version as installed

    return installed("pymeshlab")


def refusals() -> tuple[type[Exception], ...]:
    """Return the exceptions by which pymeshlab refuses something; they share no base class."""
    module = import_pymeshlab()
    names = [name for name in dir(module) if name.endswith("Exception")]
    return tuple(getattr(module, name) for name in names)


@contextmanager
def stage(text: str) -> Iterator[None]:
    """Name what MeshLab is asked to do, and turn its refusal into a sentence.

    Parameters
    ----------
    text : str
        Completes "MeshLab failed while …".

    Raises
    ------
    MeshLabError
        If pymeshlab raises.
    """
    note = os.environ.get(STAGE_VARIABLE)
    if note:
        Path(note).write_text(text, encoding="utf-8")
    refused = refusals()
    try:
        yield
    except refused as error:
        raise MeshLabError(f"MeshLab failed while {text}: {_one_line(error)}.") from error
    finally:
        if note:
            Path(note).write_text("", encoding="utf-8")


def load(meshset: pymeshlab.MeshSet, path: str | os.PathLike[str]) -> None:
    """Load a file as a new layer.

    Raises
    ------
    FileFormatError
        If MeshLab cannot read it.
    """
    try:
        with stage(f"reading {path}"):
            meshset.load_new_mesh(str(path))
    except MeshLabError as error:
        reason = str(error.__cause__).rstrip(".")
        if reason.startswith("Unknown format") and Path(path).suffix.lower() in MESHLAB_FORMATS:
            raise MeshLabError(
                "pymeshlab has come up without its file readers: a system library is missing; "
                f"{_HINT}. Given: {path}."
            ) from error
        reason = reason.splitlines()[-1].removeprefix("Error details: ")
        raise FileFormatError(f"MeshLab cannot read the file ({reason}). Given: {path}.") from error
    except (MemoryError, RuntimeError) as error:
        raise FileFormatError(
            f"MeshLab cannot read the file ({_one_line(error) or type(error).__name__}). "
            f"Given: {path}."
        ) from error


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()).rstrip(".")
