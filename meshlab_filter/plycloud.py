"""Clouds in PLY files, record by record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import plyfile

from .cloud import Cloud
from .errors import FileFormatError
from .validation import FloatArray, IntArray


def read_ply(path: Path) -> Cloud:
    """Read the vertices of a PLY file with every property they have.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Cloud

    Raises
    ------
    FileFormatError
        If the file is not PLY, is cut short, or has no vertices with x, y and z.
    """
    _check_size(path)
    try:
        data = plyfile.PlyData.read(str(path), mmap=False)
    except (plyfile.PlyParseError, UnicodeDecodeError, ValueError, KeyError, TypeError) as error:
        raise FileFormatError(
            f"Not a whole PLY file ({_first_line(error)}). Given: {path}."
        ) from error
    if "vertex" not in data or not {"x", "y", "z"} <= set(_columns(data["vertex"])):
        raise FileFormatError(f"The PLY file has no vertices with x, y and z. Given: {path}.")
    vertices = data["vertex"]
    rows = vertices.data
    names = set(_columns(vertices))
    return Cloud(
        points=_matrix(rows, ("x", "y", "z")),
        normals=_matrix(rows, ("nx", "ny", "nz")) if {"nx", "ny", "nz"} <= names else None,
        colors=_colors(rows, names),
        faces=len(data["face"]) if "face" in data else 0,
        path=path,
        records=PlyRecords(
            rows=rows,
            text=data.text,
            byte_order=data.byte_order,
            comments=tuple(data.comments),
            obj_info=tuple(data.obj_info),
        ),
    )


@dataclass(frozen=True)
class PlyRecords:
    """The vertices of a PLY file as they stand in it."""

    rows: npt.NDArray[np.void]
    text: bool = False
    byte_order: str = "<"
    comments: tuple[str, ...] = ()
    obj_info: tuple[str, ...] = ()

    @classmethod
    def of(cls, cloud: Cloud) -> PlyRecords:
        """Make the records of a cloud that comes from another format."""
        names: list[tuple[str, str]] = [(axis, "f8") for axis in "xyz"]
        columns: list[npt.NDArray[Any]] = list(cloud.points.T)
        if cloud.normals is not None:
            names += [(f"n{axis}", "f8") for axis in "xyz"]
            columns += list(cloud.normals.T)
        if cloud.colors is not None:
            names += [(channel, "u1") for channel in ("red", "green", "blue", "alpha")]
            columns += list(np.rint(cloud.colors * 255).clip(0, 255).astype("u1").T)
        rows = np.empty(len(cloud.points), dtype=names)
        for (name, _), column in zip(names, columns):
            rows[name] = column
        return cls(rows=rows)

    def write(
        self,
        path: Path,
        indices: IntArray,
        *,
        comments: Sequence[str] = (),
        extra: Mapping[str, npt.NDArray[np.generic]] | None = None,
    ) -> None:
        """Write some of the vertices; ``extra`` adds properties or takes the place of them."""
        extra = extra or {}
        rows = self.rows[indices]
        if extra:
            fields = [
                (name, self.rows.dtype[name]) for name in self.rows.dtype.names or ()
                if name not in extra
            ] + [(name, values.dtype) for name, values in extra.items()]  # fmt: skip
            wider = np.empty(len(rows), dtype=fields)
            for name, _ in fields:
                wider[name] = extra[name][indices] if name in extra else rows[name]
            rows = wider
        element = plyfile.PlyElement.describe(rows, "vertex", **_list_types(rows))
        plyfile.PlyData(
            [element],
            text=self.text,
            byte_order=self.byte_order if not self.text else "=",
            comments=[*self.comments, *(line for line in comments if line not in self.comments)],
            obj_info=list(self.obj_info),
        ).write(str(path))


def _list_types(rows: npt.NDArray[np.void]) -> dict[str, dict[str, str]]:
    """Say of list properties what they hold: a structured array only says 'object'."""
    names = [name for name in rows.dtype.names or () if rows.dtype[name] == np.dtype(object)]
    return {
        "len_types": dict.fromkeys(names, "u4"),
        "val_types": {
            name: np.asarray(rows[name][0]).dtype.str if len(rows) else "f8" for name in names
        },
    }


def _check_size(path: Path) -> None:
    """Refuse a binary file whose header announces more records than its bytes can hold.

    A reader that believes such a header reserves the memory first and finds out after.
    """
    sizes = {"char": 1, "uchar": 1, "int8": 1, "uint8": 1, "short": 2, "ushort": 2, "int16": 2,
             "uint16": 2, "int": 4, "uint": 4, "int32": 4, "uint32": 4, "float": 4, "float32": 4,
             "double": 8, "float64": 8}  # fmt: skip
    with open(path, "rb") as file:
        if file.readline(16).strip() != b"ply":
            raise FileFormatError(f"Not a PLY file: it does not begin with 'ply'. Given: {path}.")
        need = count = 0
        text = True
        # Longer headers than this are not met; an endless one must not be read to its end.
        for _ in range(10_000):
            words = file.readline(10_000).split()
            if not words and file.tell() == path.stat().st_size:
                raise FileFormatError(f"The PLY header has no end. Given: {path}.")
            if words[:1] == [b"end_header"]:
                break
            if words[:1] == [b"format"] and len(words) > 1:
                text = words[1] == b"ascii"
            elif words[:1] == [b"element"] and len(words) > 2:
                if not words[2].isdigit():
                    raise FileFormatError(
                        f"The PLY header has {words[2].decode(errors='replace')!r} where a number "
                        f"of records belongs. Given: {path}."
                    )
                count = int(words[2])
                need += 2 * count if text else 0
            elif words[:1] == [b"property"] and len(words) > 2 and not text:
                kind = words[2] if words[1] == b"list" else words[1]
                need += count * sizes.get(kind.decode(errors="replace"), 1)
        have = path.stat().st_size - file.tell()
    if need > have + 2:
        raise FileFormatError(
            f"The PLY file is cut short: its header announces at least {need} bytes of records, "
            f"{have} follow. Given: {path}."
        )


def _columns(element: Any) -> list[str]:
    return [prop.name for prop in element.properties]


def _matrix(rows: npt.NDArray[np.void], names: tuple[str, ...]) -> FloatArray:
    out = np.empty((len(rows), len(names)))
    for column, name in enumerate(names):
        out[:, column] = rows[name]
    return out


def _colors(rows: npt.NDArray[np.void], names: set[str]) -> FloatArray | None:
    if not {"red", "green", "blue"} <= names:
        return None
    channels: tuple[str, ...] = ("red", "green", "blue")
    if "alpha" in names:
        channels += ("alpha",)
    values = _matrix(rows, channels)
    kind = rows.dtype["red"]
    if kind.kind in "ui":
        values /= np.iinfo(kind).max
    if values.shape[1] == 3:
        values = np.column_stack([values, np.ones(len(values))])
    return values


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0].rstrip(".")
