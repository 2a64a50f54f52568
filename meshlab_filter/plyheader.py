"""Headers of PLY files: what they announce, and the same lines for some of the vertices."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from .errors import FileFormatError

_KINDS = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_NAMES = {
    "i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint",
    "f4": "float", "f8": "double",
}  # fmt: skip
_FORMATS = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}


@dataclass(frozen=True)
class Property:
    """One property of an element.

    Attributes
    ----------
    name : str
    kind : str
        NumPy's code of the type of the values, such as "f4".
    length : str or None
        NumPy's code of the type of a list's length; None for a single value.
    """

    name: str
    kind: str
    length: str | None = None


@dataclass
class Element:
    """One element, such as "vertex": how many there are, and their properties."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)

    @property
    def has_lists(self) -> bool:
        """Whether records can differ in length."""
        return any(prop.length for prop in self.properties)

    def index(self, name: str) -> int:
        """Return the place of a property among those of the element."""
        return [prop.name for prop in self.properties].index(name)

    def dtype(self, order: str) -> np.dtype[np.void]:
        """Return the type of a record without lists."""
        return np.dtype([(prop.name, order + prop.kind) for prop in self.properties])


@dataclass(frozen=True)
class PlyHeader:
    """What stands before the records.

    Attributes
    ----------
    lines : tuple of bytes
        The header line by line, without line breaks.
    newline : bytes
        The line break of the file.
    order : str
        "<" or ">" for binary files, "" for text.
    elements : tuple of Element
    size : int
        Bytes of the header, with the line break of its last line.
    """

    lines: tuple[bytes, ...]
    newline: bytes
    order: str
    elements: tuple[Element, ...]
    size: int = 0

    @classmethod
    def parse(cls, data: bytes) -> PlyHeader:
        """Read the header at the beginning of a file's bytes.

        Raises
        ------
        FileFormatError
            In a sentence without the file's name, if that is no header of PLY.
        """
        first = re.match(rb"ply[ \t]*(\r\n|\n|\r)", data)
        if first is None:
            raise FileFormatError("Not a PLY file: it does not begin with 'ply'.")
        newline = first.group(1)
        last = re.compile(re.escape(newline) + rb"end_header[ \t]*" + newline).search(data)
        if last is None:
            raise FileFormatError("The PLY header has no end.")
        lines = tuple(data[: last.end() - len(newline)].split(newline))
        order, elements = _parse_lines(lines[1:-1])
        return cls(lines, newline, order, elements, last.end())

    @classmethod
    def of_vertices(cls, properties: Sequence[Property]) -> PlyHeader:
        """Make a header for vertices with these properties, little endian."""
        lines = (
            b"ply",
            b"format binary_little_endian 1.0",
            b"element vertex 0",
            *(_line(prop.name, prop.kind) for prop in properties),
            b"end_header",
        )
        return cls(lines, b"\n", "<", (Element("vertex", 0, list(properties)),))

    def only_vertices(
        self, count: int, *, comments: Sequence[str] = (), extra: Mapping[str, str] | None = None
    ) -> bytes:
        """Return the header of a file with ``count`` of the vertices and no other element.

        Parameters
        ----------
        count : int
        comments : sequence of str
            Added before the first element, unless the header has the same already.
        extra : mapping of str to str
            Properties added behind the others: name → NumPy's code of the type. A property that
            has the name already is renamed, ``input_`` put before it.

        Returns
        -------
        bytes
        """
        extra = extra or {}
        had = {line for line in self.lines if line.startswith(b"comment ")}
        added = [b"comment " + line.encode("ascii", "backslashreplace") for line in comments]
        out: list[bytes] = []
        inside: bytes | None = None
        started = False
        for line in self.lines:
            words = line.split()
            if words[:1] in ([b"element"], [b"end_header"]):
                if not started:
                    out += [comment for comment in added if comment not in had]
                    started = True
                if inside == b"vertex":
                    out += [_line(name, kind) for name, kind in extra.items()]
                inside = words[1] if len(words) > 1 else None
                if inside == b"vertex":
                    out.append(b"element vertex %d" % count)
            elif words[:1] == [b"property"]:
                if inside == b"vertex":
                    clash = words[-1].decode() in extra
                    out.append(b" ".join([*words[:-1], b"input_" + words[-1]]) if clash else line)
            else:
                out.append(line)
        return self.newline.join([*out, b"end_header", b""])

    def vertex(self) -> Element | None:
        """Return the element of the vertices, if there is one."""
        return next((element for element in self.elements if element.name == "vertex"), None)


def header_of_surface(
    properties: Sequence[Property], vertices: int, faces: int, *, comments: Sequence[str] = ()
) -> bytes:
    """Return the header of a triangle mesh, little endian, its corners "int" after a "uchar"."""
    header = PlyHeader.of_vertices(properties).only_vertices(vertices, comments=comments)
    return header.removesuffix(b"end_header\n") + (
        b"element face %d\nproperty list uchar int vertex_indices\nend_header\n" % faces
    )


def _line(name: str, kind: str) -> bytes:
    return f"property {_NAMES[kind]} {name}".encode()


def _parse_lines(lines: Sequence[bytes]) -> tuple[str, tuple[Element, ...]]:
    order: str | None = None
    elements: list[Element] = []
    for line in lines:
        words = line.split()
        if not words or words[0] in (b"comment", b"obj_info"):
            continue
        if words[0] == b"format" and len(words) == 3 and words[1] in _FORMATS:
            order = _FORMATS[words[1]]
        elif words[0] == b"element" and len(words) == 3 and words[2].isdigit():
            elements.append(Element(words[1].decode("latin-1"), int(words[2])))
        elif words[0] == b"property" and elements:
            elements[-1].properties.append(_parse_property(words, line))
        else:
            raise FileFormatError(f"The PLY header has a line that is not PLY: {_show(line)}.")
    if order is None:
        raise FileFormatError("The PLY header has no line that says the format.")
    for element in elements:
        names = [prop.name for prop in element.properties]
        if len(set(names)) < len(names) or not names:
            raise FileFormatError(
                f"The PLY header gives {element.name!r} no properties, or one of them twice."
            )
    if len({element.name for element in elements}) < len(elements):
        raise FileFormatError("The PLY header announces an element twice.")
    return order, tuple(elements)


def _parse_property(words: list[bytes], line: bytes) -> Property:
    texts = [word.decode("latin-1") for word in words[1:]]
    if len(texts) == 2 and texts[0] in _KINDS:
        return Property(texts[1], _KINDS[texts[0]])
    if len(texts) == 4 and texts[0] == "list" and texts[1] in _KINDS and texts[2] in _KINDS:
        length = _KINDS[texts[1]]
        if length[0] in "iu":
            return Property(texts[3], _KINDS[texts[2]], length)
    raise FileFormatError(f"The PLY header has a property that is not PLY: {_show(line)}.")


def _show(line: bytes) -> str:
    text = line[:60].decode("ascii", "backslashreplace")
    return repr(text + ("…" if len(line) > 60 else ""))
