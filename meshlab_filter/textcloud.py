"""Clouds in plain text, one point a line: .xyz .xyzn .pts .txt .asc .csv."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from .cloud import Cloud
from .errors import FileFormatError
from .records import ByteRecords
from .validation import FloatArray, IntArray


def is_meshlab_points(path: Path) -> bool:
    """Tell MeshLab's own point format, which shares the extension .pts, from lines of numbers."""
    with open(path, "rb") as file:
        return file.read(5) == b"[Expe"


def read_text(path: Path) -> Cloud:
    """Read points from lines of numbers: x y z, then normals if three more have length one.

    Blank lines and lines that begin with ``#`` or ``//`` are comments; a first line that holds
    one number (the count of points, in .pts files) or column names is a header. Columns are
    separated by white space, commas or semicolons.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Cloud

    Raises
    ------
    FileFormatError
        If a line is not numbers, lines differ in length, or there are fewer than three columns.
    """
    data = path.read_bytes().removeprefix(_BYTE_ORDER_MARK)
    if b"\0" in data:
        raise FileFormatError(f"Not a text file: it holds bytes of zero. Given: {path}.")
    newline = next((mark for mark in (b"\r\n", b"\n", b"\r") if mark in data), b"\n")
    lines = ByteRecords.of_lines(data, newline=newline)
    kept = [
        index for index in range(len(lines)) if not lines[index].lstrip().startswith((b"#", b"//"))
    ]
    header = lines[kept.pop(0)] if kept and _is_header(lines[kept[0]]) else b""
    if not kept:
        raise FileFormatError(f"The file has no lines of numbers. Given: {path}.")
    lines = lines.only(np.array(kept))
    counted = header.strip().isdigit()
    if counted and int(header) != len(lines):
        raise FileFormatError(
            f"The file is cut short: its first line announces {int(header)} points, "
            f"{len(lines)} follow. Given: {path}."
        )
    table = _parse(lines, path)
    return Cloud(
        points=np.ascontiguousarray(table[:, :3]),
        normals=_normals(table),
        path=path,
        records=TextRecords(lines, newline=newline, header=b"" if counted else header,
                            counted=counted),
    )  # fmt: skip


@dataclass(frozen=True)
class TextRecords:
    """The lines of a text file, written again as they were read."""

    lines: ByteRecords
    newline: bytes = b"\n"
    header: bytes = b""
    counted: bool = False

    def write(
        self,
        path: Path,
        indices: IntArray,
        *,
        comments: Sequence[str] = (),
        extra: Mapping[str, npt.NDArray[np.generic]] | None = None,
    ) -> None:
        """Write some of the lines; text has no agreed place for comments or further columns."""
        body = self.lines.take(indices)
        with open(path, "wb") as file:
            file.write(b"%d" % len(indices) + self.newline if self.counted else self.header)
            file.write(body if body.endswith(self.newline) else body + self.newline)


def write_text(cloud: Cloud, path: Path, indices: IntArray, *, comma: bool = False) -> None:
    """Write x y z and normals, each number with the digits it takes to read it back unchanged."""
    columns = [cloud.points[indices]]
    if cloud.normals is not None:
        columns.append(cloud.normals[indices])
    mark = "," if comma else " "
    with open(path, "w", encoding="ascii", newline="\n") as file:
        for row in np.hstack(columns).tolist():
            file.write(mark.join(map(repr, row)) + "\n")


_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


def _parse(lines: ByteRecords, path: Path) -> FloatArray:
    separator = next((mark for mark in (b",", b";") if mark in lines[0]), None)
    try:
        table: FloatArray = np.loadtxt(
            io.BytesIO(lines.take(np.arange(len(lines))).replace(b"\r", b"\n")),
            delimiter=separator.decode() if separator else None,
            ndmin=2,
            comments=None,
            encoding="latin-1",
        )
    except (ValueError, OverflowError) as error:
        raise FileFormatError(
            f"Not lines of numbers ({str(error).splitlines()[0].rstrip('.')}). Given: {path}."
        ) from error
    if table.shape[1] < 3:
        raise FileFormatError(
            f"Lines must have at least three numbers, x y z. Given: {table.shape[1]} in {path}."
        )
    return table


def _is_header(line: bytes) -> bool:
    words = line.replace(b",", b" ").replace(b";", b" ").split()
    if len(words) == 1 and words[0].isdigit():
        return True
    try:
        [float(word) for word in words]
    except ValueError:
        # Column names, as in "x,y,z"; not a line of numbers with a fault in it.
        return len(words) >= 3 and all(word[:1].isalpha() for word in words) and not any(
            word.lower() in (b"nan", b"inf", b"infinity") for word in words
        )  # fmt: skip
    return False


def _normals(table: FloatArray) -> FloatArray | None:
    """Take columns 4–6 for normals only if they are: of length one, up to printed digits."""
    if table.shape[1] < 6:
        return None
    candidate = table[:, 3:6]
    if np.allclose(np.linalg.norm(candidate, axis=1), 1, atol=1e-2):
        return np.ascontiguousarray(candidate)
    return None
