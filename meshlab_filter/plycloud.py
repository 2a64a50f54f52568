"""Clouds in PLY files, record by record."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .cloud import Cloud
from .errors import FileFormatError
from .plyheader import Element, PlyHeader, Property
from .records import ByteRecords
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
    data = path.read_bytes()
    try:
        header = PlyHeader.parse(data)
        vertex = header.vertex()
        if vertex is None or not {"x", "y", "z"} <= _single(vertex):
            raise FileFormatError("The PLY file has no vertices with x, y and z.")
        read = _read_binary if header.order else _read_text
        records, columns = read(data, header, vertex)
    except FileFormatError as error:
        raise FileFormatError(f"{str(error).rstrip('.')}. Given: {path}.") from error
    names = _single(vertex)
    return Cloud(
        points=_matrix(columns, ("x", "y", "z")),
        normals=_matrix(columns, ("nx", "ny", "nz")) if {"nx", "ny", "nz"} <= names else None,
        colors=_colors(columns, vertex),
        faces=sum(element.count for element in header.elements if element.name == "face"),
        path=path,
        records=PlyRecords(header, records),
    )


@dataclass(frozen=True)
class PlyRecords:
    """The vertices of a PLY file, in the bytes they have there."""

    header: PlyHeader
    records: ByteRecords

    @classmethod
    def of(cls, cloud: Cloud) -> PlyRecords:
        """Make the records of a cloud that comes from another format."""
        properties = [Property(axis, "f8") for axis in "xyz"]
        columns: list[npt.NDArray[Any]] = list(cloud.points.T)
        if cloud.normals is not None:
            properties += [Property(f"n{axis}", "f8") for axis in "xyz"]
            columns += list(cloud.normals.T)
        if cloud.colors is not None:
            properties += [Property(name, "u1") for name in ("red", "green", "blue", "alpha")]
            columns += list(np.rint(cloud.colors * 255).clip(0, 255).astype("u1").T)
        header = PlyHeader.of_vertices(properties)
        dtype = header.elements[0].dtype(header.order)
        rows = np.empty(len(cloud.points), dtype=dtype)
        for prop, column in zip(properties, columns):
            rows[prop.name] = column
        return cls(header, _equal_records(rows.tobytes(), 0, len(rows), dtype.itemsize))

    def write(
        self,
        path: Path,
        indices: IntArray,
        *,
        comments: Sequence[str] = (),
        extra: Mapping[str, npt.NDArray[np.generic]] | None = None,
    ) -> None:
        """Write some of the vertices; ``extra`` puts further properties behind their own."""
        extra = extra or {}
        kinds = {name: values.dtype.str[1:] for name, values in extra.items()}
        records = self.records.take(indices)
        if extra:
            records = self._widened(indices, extra, kinds)
        elif not self.header.order and not records.endswith((b"\n", b"\r")):
            records += self.header.newline
        with open(path, "wb") as file:
            file.write(self.header.only_vertices(len(indices), comments=comments, extra=kinds))
            file.write(records)

    def _widened(
        self,
        indices: IntArray,
        extra: Mapping[str, npt.NDArray[np.generic]],
        kinds: Mapping[str, str],
    ) -> bytes:
        chosen = {name: values[indices] for name, values in extra.items()}
        if not self.header.order:
            texts = zip(*(map(repr, values.tolist()) for values in chosen.values()))
            ends = ("".join(f" {text}" for text in row).encode() for row in texts)
            newline = self.header.newline
            lines = (self.records[index] for index in indices)
            return b"".join(row.rstrip() + end + newline for row, end in zip(lines, ends))
        tail = np.empty(
            len(indices), dtype=[(name, self.header.order + kind) for name, kind in kinds.items()]
        )
        for name, values in chosen.items():
            tail[name] = values
        rows = self.records.rows()
        if rows is not None:
            wide = np.empty(len(indices), dtype=[("own", rows.dtype), ("tail", tail.dtype)])
            wide["own"], wide["tail"] = rows[indices], tail
            return wide.tobytes()
        size, tails = tail.itemsize, tail.tobytes()
        return b"".join(
            self.records[index] + tails[at : at + size]
            for index, at in zip(indices, range(0, len(tails), size))
        )


def _read_text(
    data: bytes, header: PlyHeader, vertex: Element
) -> tuple[ByteRecords, Mapping[str, FloatArray]]:
    lines = ByteRecords.of_lines(data[header.size :], newline=header.newline)
    announced = sum(element.count for element in header.elements)
    if announced > len(lines):
        raise FileFormatError(
            f"The PLY file is cut short: its header announces {announced} lines of records, "
            f"{len(lines)} follow."
        )
    before = 0
    for element in header.elements:
        if element is vertex:
            break
        before += element.count
    records = lines.only(np.arange(before, before + vertex.count))
    if not vertex.count:
        return records, {prop.name: np.empty(0) for prop in vertex.properties}
    try:
        if vertex.has_lists:
            return records, _walk_words(records, vertex)
        # Numbers are taken with all the digits they are written with, whatever type is declared.
        table = np.loadtxt(
            io.BytesIO(records.take(np.arange(len(records))).replace(b"\r", b"\n")),
            ndmin=2, comments=None, encoding="latin-1",
        )  # fmt: skip
    except (ValueError, IndexError, OverflowError) as error:
        raise FileFormatError(
            f"The PLY file has a vertex that is not numbers as its header announces "
            f"({_first_line(error)})."
        ) from error
    if table.shape != (vertex.count, len(vertex.properties)):
        raise FileFormatError(
            f"The PLY header announces {len(vertex.properties)} numbers a vertex, "
            f"{table.shape[1]} are there."
        )
    return records, {prop.name: table[:, at] for at, prop in enumerate(vertex.properties)}


def _walk_words(records: ByteRecords, vertex: Element) -> dict[str, FloatArray]:
    """Return the single values of lines that also hold lists."""
    columns = {name: np.empty(len(records)) for name in _single(vertex)}
    for row in range(len(records)):
        words = records[row].split()
        at = 0
        for prop in vertex.properties:
            if prop.length is None:
                columns[prop.name][row] = float(words[at])
                at += 1
            else:
                at += 1 + int(words[at])
        if at != len(words):
            raise ValueError(f"{len(words)} numbers instead of {at} at vertex {row}")
    return columns


def _read_binary(
    data: bytes, header: PlyHeader, vertex: Element
) -> tuple[ByteRecords, Mapping[str, npt.NDArray[Any]]]:
    at = header.size
    found: ByteRecords | None = None
    for element in header.elements:
        records = _locate(data, at, element, header.order)
        at = int(records.ends[-1]) if len(records) else at
        if element is vertex:
            found = records
    assert found is not None
    if not vertex.has_lists:
        rows = np.frombuffer(
            data,
            dtype=vertex.dtype(header.order),
            count=vertex.count,
            offset=int(found.starts[0]) if len(found) else 0,
        )
        return found, {name: rows[name] for name in rows.dtype.names or ()}
    return found, _walk_bytes(found, vertex, header.order)


def _locate(data: bytes, at: int, element: Element, order: str) -> ByteRecords:
    """Find the records of an element that begin at a byte."""
    least = sum(np.dtype(prop.length or prop.kind).itemsize for prop in element.properties)
    if element.count * least > len(data) - at:
        raise FileFormatError(
            f"The PLY file is cut short: its header announces {element.count} records of "
            f"{element.name!r}, at least {element.count * least} bytes; {len(data) - at} follow."
        )
    if not element.has_lists:
        return _equal_records(data, at, element.count, least)
    return _same_lists(data, at, element, order) or _walk_lists(data, at, element, order)


def _equal_records(data: bytes, at: int, count: int, size: int) -> ByteRecords:
    starts = at + size * np.arange(count, dtype=np.int64)
    return ByteRecords(data, starts, starts + size)


def _same_lists(data: bytes, at: int, element: Element, order: str) -> ByteRecords | None:
    """Find records whose lists are all as long as those of the first, as triangles are."""
    if not element.count:
        return None
    first = _record_lists(data, at, element, order)
    fields: list[Any] = []
    for number, prop in enumerate(element.properties):
        if prop.length is None:
            fields.append((f"v{number}", order + prop.kind))
        else:
            fields += [(f"n{number}", order + prop.length),
                       (f"v{number}", order + prop.kind, (first[number],))]  # fmt: skip
    dtype = np.dtype(fields)
    if element.count * dtype.itemsize > len(data) - at:
        return None
    rows = np.frombuffer(data, dtype=dtype, count=element.count, offset=at)
    if any((rows[f"n{number}"] != length).any() for number, length in first.items()):
        return None
    return _equal_records(data, at, element.count, dtype.itemsize)


def _walk_lists(data: bytes, at: int, element: Element, order: str) -> ByteRecords:
    starts, ends = [], []
    for _ in range(element.count):
        starts.append(at)
        at = _record_end(data, at, element, order)
        ends.append(at)
    return ByteRecords(data, np.array(starts, dtype=np.int64), np.array(ends, dtype=np.int64))


def _record_end(data: bytes, at: int, element: Element, order: str) -> int:
    lists = _record_lists(data, at, element, order)
    for number, prop in enumerate(element.properties):
        size = np.dtype(prop.kind).itemsize
        if prop.length is not None:
            size = np.dtype(prop.length).itemsize + size * lists[number]
        at += size
    return at


def _record_lists(data: bytes, at: int, element: Element, order: str) -> dict[int, int]:
    """Return the lengths of the lists of one record: place of the property → length."""
    lists = {}
    byteorder: Any = "big" if order == ">" else "little"
    for number, prop in enumerate(element.properties):
        size = np.dtype(prop.kind).itemsize
        if prop.length is not None:
            width = np.dtype(prop.length).itemsize
            length = int.from_bytes(
                data[at : at + width], byteorder, signed=prop.length.startswith("i")
            )
            if length < 0:
                raise FileFormatError(
                    f"The PLY file has a list of negative length in {element.name!r}."
                )
            lists[number] = length
            size = width + length * size
        at += size
        if at > len(data):
            raise FileFormatError(
                f"The PLY file is cut short: a record of {element.name!r} ends behind the file."
            )
    return lists


def _walk_bytes(records: ByteRecords, vertex: Element, order: str) -> dict[str, FloatArray]:
    """Return the single values of records that also hold lists."""
    columns = {name: np.empty(len(records)) for name in _single(vertex)}
    for row in range(len(records)):
        record = records[row]
        lists = _record_lists(record, 0, vertex, order)
        at = 0
        for number, prop in enumerate(vertex.properties):
            if prop.length is None:
                value = np.frombuffer(record, dtype=order + prop.kind, count=1, offset=at)
                columns[prop.name][row] = value[0]
                at += value.itemsize
            else:
                at += np.dtype(prop.length).itemsize
                at += lists[number] * np.dtype(prop.kind).itemsize
    return columns


def _single(element: Element) -> set[str]:
    """Return the names of the properties that hold one value a record."""
    return {prop.name for prop in element.properties if prop.length is None}


def _matrix(columns: Mapping[str, npt.NDArray[Any]], names: tuple[str, ...]) -> FloatArray:
    return np.column_stack([np.asarray(columns[name], dtype=np.float64) for name in names])


def _colors(columns: Mapping[str, npt.NDArray[Any]], vertex: Element) -> FloatArray | None:
    channels: tuple[str, ...] = ("red", "green", "blue")
    if not set(channels) <= _single(vertex):
        return None
    if "alpha" in _single(vertex):
        channels += ("alpha",)
    values = _matrix(columns, channels)
    kind = np.dtype(vertex.properties[vertex.index("red")].kind)
    if kind.kind in "ui":
        values /= np.iinfo(kind).max
    if values.shape[1] == 3:
        values = np.column_stack([values, np.ones(len(values))])
    return values


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0].rstrip(".")
