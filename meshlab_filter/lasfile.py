"""Clouds in LAS and LAZ files, record by record, through laspy (extra ``las``)."""

from __future__ import annotations

import copy
import importlib
import math
import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .cloud import Cloud
from .errors import FileFormatError, InvalidParameterError
from .lasheader import check_announced, check_chunks
from .validation import FloatArray, IntArray

if TYPE_CHECKING:
    import laspy

#: User and record number of the variable length record that holds the provenance.
PROVENANCE_USER, PROVENANCE_RECORD = "meshlab-filter", 1
# What a variable length record can hold, and what describes the octree of one COPC file only.
_VLR_BYTES = 65535
_COPC_USER = "copc"
# PDAL's names of normals among the extra dimensions.
_NORMALS = ("NormalX", "NormalY", "NormalZ")


def read_las(path: Path) -> Cloud:
    """Read a LAS, LAZ or COPC file with every dimension of its points.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Cloud
        Coordinates are scale × integer + offset, in the file's unit.

    Raises
    ------
    FileFormatError
        If the file is not LAS, is cut short, or laspy is not installed.
    """
    check_announced(path)
    with las_errors(path):
        check_chunks(path)
    with las_errors(path), import_laspy().open(str(path)) as reader:
        data = reader.read()
        announced = reader.header.point_count
    if len(data.points) != announced:
        raise FileFormatError(
            f"The file is cut short: it announces {announced} points and holds "
            f"{len(data.points)}. Given: {path}."
        )
    points = np.ascontiguousarray(data.xyz, dtype=np.float64)
    return Cloud(
        points=points,
        normals=_normals(data.points),
        colors=_colors(data.points),
        path=path,
        records=LasRecords(data.header, data.points, tuple(data.evlrs or ())),
    )


@dataclass(frozen=True)
class LasRecords:
    """The points of a LAS file as they stand in it, and what its header says of them."""

    header: laspy.LasHeader
    rows: laspy.ScaleAwarePointRecord
    evlrs: tuple[Any, ...] = ()

    @classmethod
    def of(cls, cloud: Cloud) -> LasRecords:
        """Make the records of a cloud that comes from another format.

        LAS holds whole multiples of a scale: a power of ten that is at most a two-thousand-
        millionth of the cloud's largest edge rounded up.
        """
        laspy = import_laspy()
        header = laspy.LasHeader(version="1.4", point_format=6 if cloud.colors is None else 7)
        # A date would make the bytes of two runs differ.
        header.creation_date = None
        low = cloud.points.min(axis=0)
        edge = float(np.ptp(cloud.points, axis=0).max()) or 1.0
        header.scales = np.full(3, 10.0 ** math.ceil(math.log10(edge / 2e9)))
        header.offsets = np.floor(low)
        if cloud.normals is not None:
            header.add_extra_dims([laspy.ExtraBytesParams(name, "f8") for name in _NORMALS])
        rows = laspy.ScaleAwarePointRecord.zeros(len(cloud.points), header=header)
        rows["x"], rows["y"], rows["z"] = cloud.points.T
        if cloud.normals is not None:
            for name, column in zip(_NORMALS, cloud.normals.T):
                rows[name] = column
        if cloud.colors is not None:
            for name, column in zip(("red", "green", "blue"), cloud.colors.T):
                rows[name] = np.rint(column.clip(0, 1) * 65535).astype("u2")
        return cls(header, rows)

    def write(
        self,
        path: Path,
        indices: IntArray,
        *,
        comments: Sequence[str] = (),
        extra: Mapping[str, npt.NDArray[np.generic]] | None = None,
    ) -> None:
        """Write some of the points; ``extra`` adds dimensions or takes the place of them."""
        laspy = import_laspy()
        header = provenance_header(self.header, comments)
        data = laspy.LasData(header, points=self.rows[indices])
        data.evlrs = laspy.vlrs.vlrlist.VLRList(not_copc(self.evlrs))
        known = set(data.point_format.dimension_names)
        fresh = {name: column for name, column in (extra or {}).items() if name not in known}
        if fresh:
            data.add_extra_dims(
                [laspy.ExtraBytesParams(name, column.dtype) for name, column in fresh.items()]
            )
        for name, column in (extra or {}).items():
            data[name] = column[indices]
        data.write(str(path))


def provenance_header(header: laspy.LasHeader, comments: Sequence[str]) -> laspy.LasHeader:
    """Return a copy of a header that carries the lines of provenance as one more record.

    What describes the octree of a COPC file is left out: it is not that of the new file.
    """
    laspy = import_laspy()
    header = copy.deepcopy(header)
    vlrs = not_copc(header.vlrs)
    if comments:
        vlrs = [
            vlr
            for vlr in vlrs
            if (vlr.user_id, vlr.record_id) != (PROVENANCE_USER, PROVENANCE_RECORD)
        ]
        vlrs.append(
            laspy.VLR(
                user_id=PROVENANCE_USER,
                record_id=PROVENANCE_RECORD,
                description="how these points were chosen",
                record_data="\n".join(comments).encode("utf-8")[:_VLR_BYTES],
            )
        )
    header.vlrs = laspy.vlrs.vlrlist.VLRList(vlrs)
    return header


def not_copc(vlrs: Iterable[Any]) -> list[Any]:
    """Return the records that do not describe the octree of a COPC file."""
    return [vlr for vlr in vlrs if vlr.user_id.lower() != _COPC_USER]


def import_laspy() -> Any:
    """Return laspy, or say how to install it.

    Raises
    ------
    InvalidParameterError
        If laspy is not installed.
    """
    try:
        import laspy
        import laspy.vlrs.vlrlist
    except ImportError as error:
        raise InvalidParameterError(
            'LAS and LAZ files need laspy; install it with: pip install "meshlab-filter[las]".'
        ) from error
    return laspy


@contextmanager
def las_errors(path: Path) -> Iterator[None]:
    """Turn what laspy and its decompressor raise on a broken file into one sentence."""
    laspy = import_laspy()
    broken: tuple[type[BaseException], ...] = (
        laspy.errors.LaspyException, ValueError, KeyError, IndexError, EOFError, AssertionError,
        ArithmeticError, TypeError, AttributeError, struct.error,
    )  # fmt: skip
    with suppress(ImportError):
        broken = (*broken, importlib.import_module("lazrs").LazrsError)
    try:
        yield
    except FileFormatError:
        raise
    except BaseException as error:
        # A failed assertion in the decompressor is a PanicException, which is no Exception.
        if not isinstance(error, broken) and type(error).__name__ != "PanicException":
            raise
        reason = str(error).partition("\n")[0].rstrip(".") or type(error).__name__
        raise FileFormatError(f"Not a whole LAS file ({reason}). Given: {path}.") from error


def _normals(rows: laspy.ScaleAwarePointRecord) -> FloatArray | None:
    names = set(rows.point_format.dimension_names)
    if not set(_NORMALS) <= names:
        return None
    return np.column_stack([np.asarray(rows[name], dtype=np.float64) for name in _NORMALS])


def _colors(rows: laspy.ScaleAwarePointRecord) -> FloatArray | None:
    names = set(rows.point_format.dimension_names)
    if not {"red", "green", "blue"} <= names or not len(rows):
        return None
    channels = np.column_stack([np.asarray(rows[name]) for name in ("red", "green", "blue")])
    # The format says 16 bits a channel; many writers put 8-bit values there unscaled.
    top = 255.0 if channels.max() <= 255 else 65535.0
    return np.column_stack([channels / top, np.ones(len(channels))])
