"""A point cloud read from a file, with everything the file says about each point.

The formats that hold one record a point (PLY, plain text, LAS) are read and written here record by
record, so that what stays is bit for bit what was read. Every other format goes through MeshLab.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt

from .errors import FileFormatError, InvalidCloudError, OutputError
from .outputs import writing
from .validation import FloatArray, IntArray

#: Formats with one record a point, read and written by this package itself.
RECORD_FORMATS = (".ply", ".xyz", ".xyzn", ".pts", ".txt", ".asc", ".csv", ".las", ".laz")
#: Formats that MeshLab reads for us.
MESHLAB_FORMATS = (".obj", ".off", ".stl", ".3ds", ".dae", ".ptx", ".vmi", ".wrl", ".x3d", ".gltf",
                   ".glb", ".ctm", ".qobj", ".bre", ".dxf", ".3mf", ".e57")  # fmt: skip
#: Formats that MeshLab writes for us.
MESHLAB_TARGETS = (".obj", ".off", ".stl", ".dae", ".wrl", ".x3d", ".ctm", ".dxf", ".3ds")


class Records(Protocol):
    """The records of a file, of which some are written again."""

    def write(
        self,
        path: Path,
        indices: IntArray,
        *,
        comments: Sequence[str],
        extra: Mapping[str, npt.NDArray[np.generic]],
    ) -> None:
        """Write the records at ``indices`` to ``path``, in the format they came from."""


@dataclass(frozen=True, kw_only=True)
class Cloud:
    """A cloud and its attributes; arrays share the order of the file.

    Attributes
    ----------
    points : numpy.ndarray, shape (N, 3), float64
        Coordinates in the file's unit of length, all finite.
    normals : numpy.ndarray, shape (N, 3), float64, or None
        The file's normals, not normalised.
    colors : numpy.ndarray, shape (N, 4), float64, or None
        Red, green, blue, alpha in 0 … 1.
    faces : int
        How many faces the file has. They are not part of a cloud.
    dropped : int
        How many records with NaN or infinite coordinates were left out.
    path : Path
        Where the cloud was read from.
    records : Records or None
        The file's own records; None for formats that MeshLab reads.
    """

    points: FloatArray
    normals: FloatArray | None = None
    colors: FloatArray | None = None
    faces: int = 0
    dropped: int = 0
    path: Path = Path()
    records: Records | None = field(default=None, repr=False)

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of the axis-parallel bounding box, in the cloud's unit."""
        if not len(self.points):
            return 0.0
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))


def check_readable(path: str | os.PathLike[str]) -> Path:
    """Return the path of a file that exists, is not empty and has an extension that is read.

    Raises
    ------
    FileFormatError
        In one sentence, whichever of these does not hold.

    Examples
    --------
    >>> check_readable("no_such_scan.ply")
    Traceback (most recent call last):
        ...
    meshlab_filter.errors.FileFormatError: No such file. Given: no_such_scan.ply.
    """
    path = Path(path)
    if path.is_dir():
        raise FileFormatError(f"Not a file but a folder. Given: {path}.")
    if not path.exists():
        raise FileFormatError(f"No such file. Given: {path}.")
    if not os.access(path, os.R_OK):
        raise FileFormatError(f"The file may not be read by this user. Given: {path}.")
    if path.stat().st_size == 0:
        raise FileFormatError(f"The file is empty (0 bytes). Given: {path}.")
    known = (*RECORD_FORMATS, *MESHLAB_FORMATS)
    if path.suffix.lower() not in known:
        raise FileFormatError(
            f"Unknown extension {path.suffix!r}. Must be one of {' '.join(known)}. Given: {path}."
        )
    return path


def read_cloud(path: str | os.PathLike[str], *, drop_invalid: bool = False) -> Cloud:
    """Read a point cloud, or the vertices of a mesh, with all their attributes.

    Parameters
    ----------
    path : path-like
        A file in one of ``RECORD_FORMATS`` or ``MESHLAB_FORMATS``.
    drop_invalid : bool
        Leave out records with NaN or infinite coordinates instead of refusing the file.

    Returns
    -------
    Cloud

    Raises
    ------
    FileFormatError
        If the file is missing, empty, truncated, or not what its extension says.
    InvalidCloudError
        If the file has no points, or has coordinates that are not finite and ``drop_invalid``
        is False.
    """
    path = check_readable(path)
    try:
        cloud = _reader(path)(path)
    except MemoryError as error:
        raise FileFormatError(
            f"The file announces more than fits in memory; it may be damaged. Given: {path}."
        ) from error
    except OSError as error:
        if isinstance(error, OutputError):
            raise
        raise FileFormatError(f"Cannot read the file: {error}. Given: {path}.") from error
    finite = np.asarray(np.isfinite(cloud.points).all(axis=1), dtype=bool)
    invalid = len(finite) - int(finite.sum()) + cloud.dropped
    if invalid and not drop_invalid:
        raise InvalidCloudError(
            f"Invalid coordinates: {invalid} of {len(finite) + cloud.dropped} points are NaN or "
            f"infinite; leave them out with --drop-invalid. Given: {path}."
        )
    if not finite.any():
        raise InvalidCloudError(f"The file has no points with finite coordinates. Given: {path}.")
    if invalid and not finite.all():
        cloud = _only(cloud, np.flatnonzero(finite), invalid)
    return cloud


def write_cloud(
    cloud: Cloud,
    path: str | os.PathLike[str],
    *,
    indices: IntArray | None = None,
    comments: Sequence[str] = (),
    extra: Mapping[str, npt.NDArray[np.generic]] | None = None,
    overwrite: bool = False,
) -> None:
    """Write the points at ``indices`` with all their attributes; the file appears whole or not.

    Parameters
    ----------
    cloud : Cloud
    path : path-like
        The extension chooses the format. The format the cloud came from keeps every attribute
        of the file; any other keeps coordinates, normals and colours, as far as it can.
    indices : numpy.ndarray, shape (M,), int64, optional
        Which points; all by default.
    comments : sequence of str
        Provenance, for formats that have room for it.
    extra : mapping of str to numpy.ndarray, shape (N,), optional
        Further values of every point of the cloud, for PLY: name → column.
    overwrite : bool
        Allow replacing the file the cloud was read from.

    Raises
    ------
    OutputError
        If the file cannot be written, is the input, or the format is unknown.
    """
    path = Path(path)
    if indices is None:
        indices = np.arange(len(cloud.points))
    check_writable(path)
    if not overwrite and cloud.path.exists() and path.exists() and path.samefile(cloud.path):
        raise OutputError(
            f"The output is the input; choose another name or pass --overwrite. Given: {path}."
        )
    extra = dict(extra or {})
    suffix = path.suffix.lower()
    with writing(path) as partial:
        if cloud.records is not None and suffix in _siblings(cloud.path.suffix.lower()):
            cloud.records.write(partial, indices, comments=comments, extra=extra)
        elif suffix == ".ply":
            from .plycloud import PlyRecords

            PlyRecords.of(cloud).write(partial, indices, comments=comments, extra=extra)
        elif suffix in _LAS:
            from .lasfile import LasRecords

            LasRecords.of(cloud).write(partial, indices, comments=comments, extra=extra)
        elif suffix in _TEXT:
            from .textcloud import write_text

            write_text(cloud, partial, indices, comma=suffix == ".csv")
        else:
            from .bridge.meshfile import write_mesh_file

            write_mesh_file(cloud, partial, indices)


def check_writable(path: str | os.PathLike[str]) -> Path:
    """Return the path if its extension is written and its folder exists.

    Raises
    ------
    OutputError
        In one sentence, if the extension or the folder will not do.
    """
    path = Path(path)
    known = (*RECORD_FORMATS, *MESHLAB_TARGETS)
    if path.suffix.lower() not in known:
        raise OutputError(
            f"Unknown output extension {path.suffix!r}. Must be one of {' '.join(known)}. "
            f"Given: {path}."
        )
    if path.name.lower().endswith(".copc.laz"):
        raise OutputError(
            f"COPC files can be read but not written; name the output .laz. Given: {path}."
        )
    if not path.parent.is_dir():
        raise OutputError(f"The output's folder does not exist. Given: {path}.")
    if path.is_dir():
        raise OutputError(f"The output is a folder, not a file. Given: {path}.")
    return path


_TEXT = (".xyz", ".xyzn", ".pts", ".txt", ".asc", ".csv")
_LAS = (".las", ".laz")


def _siblings(suffix: str) -> tuple[str, ...]:
    """Return the formats that can take over the records of ``suffix`` as they are."""
    if suffix in _TEXT and suffix != ".csv":
        return tuple(other for other in _TEXT if other != ".csv")
    if suffix in _LAS:
        return _LAS
    return (suffix,)


def _reader(path: Path) -> Callable[[Path], Cloud]:
    suffix = path.suffix.lower()
    if suffix == ".ply":
        from .plycloud import read_ply

        return read_ply
    if suffix in _LAS:
        from .lasfile import read_las

        return read_las
    if suffix in _TEXT:
        from .textcloud import is_meshlab_points, read_text

        if not is_meshlab_points(path):
            return read_text
    from .bridge.meshfile import read_mesh_file

    return read_mesh_file


@dataclass(frozen=True)
class _Subset:
    """Records of which some were dropped on reading."""

    records: Records
    kept: IntArray

    def write(
        self,
        path: Path,
        indices: IntArray,
        *,
        comments: Sequence[str],
        extra: Mapping[str, npt.NDArray[np.generic]],
    ) -> None:
        columns = {}
        for name, values in extra.items():
            column = np.zeros(int(self.kept.max()) + 1, dtype=values.dtype)
            column[self.kept] = values
            columns[name] = column
        self.records.write(path, self.kept[indices], comments=comments, extra=columns)


def _only(cloud: Cloud, kept: IntArray, dropped: int) -> Cloud:
    return Cloud(
        points=cloud.points[kept],
        normals=None if cloud.normals is None else cloud.normals[kept],
        colors=None if cloud.colors is None else cloud.colors[kept],
        faces=cloud.faces,
        dropped=dropped,
        path=cloud.path,
        records=None if cloud.records is None else _Subset(cloud.records, kept),
    )
