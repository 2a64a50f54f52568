"""MeshLab's filter scripts (.mlx) as data: read safely, checked, written the same every time."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.dom import minidom

from .errors import PresetError

ROOT = "FilterScript"
INSTRUCTION = "meshlab-filter"

Value = bool | int | float | str | tuple[float, ...]

FLOAT_MAX = 3.4028234663852886e38
TRIPLES = ("RichPoint3f", "RichPosition", "RichDirection")
TEXTS = ("RichString", "RichOpenFile", "RichSaveFile")
INTEGERS = ("RichInt", "RichMesh", "RichEnum")
BOUNDED = ("RichAbsPerc", "RichDynamicFloat")
COMPONENTS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(TRIPLES, ("x", "y", "z")),
    "RichColor": ("r", "g", "b", "a"),
    "RichMatrix44f": tuple(f"val{i}" for i in range(16)),
}
TYPES = ("RichBool", "RichFloat", *INTEGERS, *BOUNDED, *TEXTS, *COMPONENTS)


@dataclass(frozen=True, kw_only=True)
class Param:
    """One parameter of a filter.

    Attributes
    ----------
    name : str
        As MeshLab spells it, upper and lower case included (``BallRadius``).
    type : str
        One of ``TYPES``. ``RichPoint3f`` is the spelling of a point that every MeshLab reads.
    value : bool, int, float, str or tuple of float
        A point has three components, a colour four (0 … 255), a matrix sixteen (by rows).
    minimum, maximum : float or None
        The bounds of a RichAbsPerc or RichDynamicFloat, without which MeshLab drops the value.
    choices : tuple of str
        The names of a RichEnum's values, or the extensions of a RichOpenFile or RichSaveFile.
    line : int or None
        Where it stands in the file it was read from; no part of a comparison.

    Examples
    --------
    >>> Param(name="K", type="RichInt", value=12).attributes()
    {'type': 'RichInt', 'name': 'K', 'value': '12'}
    """

    name: str
    type: str
    value: Value
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    line: int | None = field(default=None, compare=False)

    def attributes(self) -> dict[str, str]:
        """Return the XML attributes that MeshLab reads back to the same value."""
        out = {"type": self.type, "name": self.name}
        if self.type in COMPONENTS:
            assert isinstance(self.value, tuple)
            out.update(zip(COMPONENTS[self.type], map(format_number, self.value)))
            return out
        if isinstance(self.value, bool):
            out["value"] = "true" if self.value else "false"
        elif isinstance(self.value, str):
            out["value"] = self.value
        else:
            assert isinstance(self.value, int | float)
            out["value"] = format_number(self.value)
        if self.type in BOUNDED:
            assert self.minimum is not None
            assert self.maximum is not None
            out["min"], out["max"] = format_number(self.minimum), format_number(self.maximum)
        if self.type == "RichEnum":
            out["enum_cardinality"] = str(len(self.choices))
            out.update({f"enum_val{i}": text for i, text in enumerate(self.choices)})
        elif self.type == "RichOpenFile":
            out["exts_cardinality"] = str(len(self.choices))
            out.update({f"exts_val{i}": text for i, text in enumerate(self.choices)})
        elif self.type == "RichSaveFile":
            out["ext"] = "".join(self.choices[:1])
        return out


@dataclass(frozen=True)
class Filter:
    """One filter of a script: its name as MeshLab's menus have it, and its parameters."""

    name: str
    params: tuple[Param, ...] = ()
    line: int | None = field(default=None, compare=False)

    def __getitem__(self, name: str) -> Param:
        """Return the parameter of this name; KeyError if the file does not give it."""
        for param in self.params:
            if param.name == name:
                return param
        raise KeyError(name)

    def values(self) -> dict[str, Value]:
        """Return each parameter's value by its name."""
        return {param.name: param.value for param in self.params}


@dataclass(frozen=True)
class Instruction:
    """The processing instruction ``<?meshlab-filter …?>``: how to rank the cloud.

    MeshLab has no filter for that stage and skips the instruction; this package reads it.
    """

    options: Mapping[str, str]
    line: int | None = field(default=None, compare=False)

    def data(self) -> str:
        """Return the instruction's text, ``key="value"`` by ``key="value"``."""
        element = minidom.Document().createElement("o")
        for key, value in self.options.items():
            element.setAttribute(key, value)
        return element.toxml()[len("<o ") : -len("/>")] if self.options else ""


@dataclass(frozen=True)
class FilterScript:
    """A filter script: what MeshLab's Filters > Show current filter script opens and saves.

    Attributes
    ----------
    filters : tuple of Filter
        In the order in which they run.
    instruction : Instruction or None
        How the cloud is ranked before the first filter, if the file says so.
    comment : str
        The comments of the file, one paragraph each.
    source : str
        What error messages call the file; no part of a comparison.

    Examples
    --------
    >>> script = FilterScript((Filter("Delete Selected Vertices"),))
    >>> parse(script.to_xml()) == script
    True
    """

    filters: tuple[Filter, ...]
    instruction: Instruction | None = None
    comment: str = ""
    source: str = field(default="script", compare=False)

    def __iter__(self) -> Iterator[Filter]:
        """Iterate over the filters."""
        return iter(self.filters)

    def to_xml(self) -> str:
        """Return the script as MeshLab writes it; the same script gives the same text.

        Raises
        ------
        PresetError
            If the comment cannot stand in XML (it contains ``--``).
        """
        implementation = minidom.getDOMImplementation()
        assert implementation is not None
        doctype = implementation.createDocumentType(ROOT, None, None)
        document = implementation.createDocument(None, ROOT, doctype)
        root = document.documentElement
        assert root is not None
        for paragraph in filter(None, self.comment.split("\n\n")):
            if "--" in paragraph or paragraph.endswith("-"):
                raise PresetError(
                    f"Invalid comment. Must not contain two hyphens in a row or end in one. "
                    f"Given: {paragraph!r}."
                )
            lines = textwrap.wrap(paragraph, 96, break_on_hyphens=False)
            root.appendChild(document.createComment(f" {(chr(10) + '  ').join(lines)} "))
        if self.instruction is not None:
            data = self.instruction.data()
            root.appendChild(document.createProcessingInstruction(INSTRUCTION, data))
        for filter_ in self.filters:
            element = document.createElement("filter")
            element.setAttribute("name", filter_.name)
            for param in filter_.params:
                child = document.createElement("Param")
                for key, text in param.attributes().items():
                    child.setAttribute(key, text)
                element.appendChild(child)
            root.appendChild(element)
        body = [node.toprettyxml(indent=" ") for node in document.childNodes]
        return "".join(text if text.endswith("\n") else text + "\n" for text in body)


def read(path: str | os.PathLike[str]) -> FilterScript:
    """Read a filter script from a file.

    Parameters
    ----------
    path : str or path
        The .mlx file.

    Returns
    -------
    FilterScript
        Every filter and parameter knows its line.

    Raises
    ------
    PresetError
        If the file cannot be read, is no well-formed XML, declares entities, is no filter script
        or gives a parameter that MeshLab would drop or misread; the message names file, line and
        filter.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise PresetError(
            f"Cannot read the filter script. Must be an existing .mlx file. "
            f"Given: {os.fspath(path)} ({error.strerror})."
        ) from error
    return parse(content, source=os.fspath(path))


def parse(content: str | bytes, *, source: str = "script") -> FilterScript:
    """Read a filter script from text, as `read` does from a file.

    Parameters
    ----------
    content : str or bytes
        The XML.
    source : str
        What messages call it.

    Raises
    ------
    PresetError
        As in `read`.

    Examples
    --------
    >>> text = '<FilterScript><filter name="Duplicate Current layer"/></FilterScript>'
    >>> [f.name for f in parse(text)]
    ['Duplicate Current layer']
    """
    from .mlx_reader import parse_script

    return parse_script(content.encode() if isinstance(content, str) else content, source)


def write(script: FilterScript, path: str | os.PathLike[str]) -> None:
    """Write a filter script; the same script gives the same bytes on every system."""
    Path(path).write_bytes(script.to_xml().encode("utf-8"))


def format_number(value: float) -> str:
    """Return the shortest text that reads back to the same number.

    Examples
    --------
    >>> format_number(20.0), format_number(0.5), format_number(1e30)
    ('20', '0.5', '1e+30')
    """
    if float(value).is_integer() and abs(value) < 2**53:
        return str(int(value))
    return repr(float(value))
