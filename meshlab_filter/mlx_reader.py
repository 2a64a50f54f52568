"""The parser behind `meshlab_filter.mlx`: every fault is a sentence with file, line and filter."""

from __future__ import annotations

import io
import math
import re
from xml.sax import SAXParseException
from xml.sax.handler import ContentHandler, LexicalHandler, property_lexical_handler
from xml.sax.xmlreader import AttributesImpl, InputSource

from .errors import PresetError
from .mlx import (
    BOUNDED,
    COMPONENTS,
    FLOAT_MAX,
    INSTRUCTION,
    INTEGERS,
    ROOT,
    TYPES,
    Filter,
    FilterScript,
    Instruction,
    Param,
)

_WHOLE = re.compile(r"[+-]?[0-9]{1,10}")


def parse_script(content: bytes, source: str) -> FilterScript:
    """Parse a filter script; `meshlab_filter.mlx.parse` documents it."""
    from defusedxml.common import DefusedXmlException
    from defusedxml.sax import make_parser

    handler = _Reader(source)
    parser = make_parser()
    parser.setContentHandler(handler)
    parser.setProperty(property_lexical_handler, handler)
    stream = InputSource(source)
    stream.setByteStream(io.BytesIO(content))
    try:
        parser.parse(stream)
    except SAXParseException as error:
        raise PresetError(
            f"Invalid filter script {source}, line {error.getLineNumber()}. "
            f"Must be well-formed XML. Given: {error.getMessage()}."
        ) from error
    except DefusedXmlException as error:
        raise PresetError(
            f"Invalid filter script {source}, line {handler.line}. "
            "Must not declare or use entities, which a filter script never needs. "
            f"Given: {type(error).__name__}."
        ) from error
    return handler.script()


class _Reader(ContentHandler, LexicalHandler):
    """Collects the script from the parser's events, so that every part knows its line."""

    def __init__(self, source: str) -> None:
        super().__init__()
        self.source = source
        self.path: list[str] = []
        self.comments: list[str] = []
        self.filters: list[Filter] = []
        self.instruction: Instruction | None = None
        self.locator: object = None

    def setDocumentLocator(self, locator: object) -> None:
        self.locator = locator

    @property
    def line(self) -> int:
        """The line the parser stands in."""
        number = self.locator.getLineNumber()  # type: ignore[attr-defined]
        return number or 1

    def script(self) -> FilterScript:
        return FilterScript(
            tuple(self.filters), self.instruction, "\n\n".join(self.comments), self.source
        )

    def fault(self, must: str, given: str) -> PresetError:
        where = f"{self.source}, line {self.line}"
        if "filter" in self.path:
            where += f", filter {self.filters[-1].name!r}"
        return PresetError(f"Invalid filter script {where}. Must {must}. Given: {given}.")

    def startDTD(self, name: str, public_id: str | None, system_id: str | None) -> None:
        if public_id or system_id:
            raise self.fault("not refer to another file", f"DOCTYPE {public_id or system_id}")

    def endDTD(self) -> None:
        pass

    def startCDATA(self) -> None:
        pass

    def endCDATA(self) -> None:
        pass

    def comment(self, content: str) -> None:
        self.comments.append(" ".join(content.split()))

    def processingInstruction(self, target: str, data: str) -> None:
        if target != INSTRUCTION:
            return
        if self.instruction is not None:
            raise self.fault("have one instruction <?meshlab-filter …?>", "a second one")
        if self.filters:
            raise self.fault("have its instruction before the first filter", "it after a filter")
        self.instruction = Instruction(_options(data, self), self.line)

    def characters(self, content: str) -> None:
        if content.strip():
            raise self.fault("have no text between its elements", repr(content.strip()[:40]))

    def startElement(self, name: str, attrs: AttributesImpl) -> None:
        parent = self.path[-1] if self.path else None
        expected = {None: ROOT, ROOT: "filter", "filter": "Param"}.get(parent)
        if name != expected:
            place = {None: "have the root element", ROOT: "hold only", "filter": "hold only"}
            if expected is None:
                raise self.fault("have nothing inside a Param", f"<{name}>")
            raise self.fault(f"{place[parent]} <{expected}>", f"<{name}>")
        if name == "filter":
            if not attrs.get("name"):
                raise self.fault("give every filter its name", "<filter> without a name")
            self.filters.append(Filter(attrs["name"], (), self.line))
        elif name == "Param":
            last = self.filters[-1]
            param = _param(attrs, self)
            if any(other.name == param.name for other in last.params):
                raise self.fault("give a parameter once", f"{param.name!r} a second time")
            self.filters[-1] = Filter(last.name, (*last.params, param), last.line)
        self.path.append(name)

    def endElement(self, name: str) -> None:
        self.path.pop()


def _options(data: str, reader: _Reader) -> dict[str, str]:
    """Return the pseudo-attributes of the instruction; an XML parser splits them."""
    from defusedxml.ElementTree import ParseError, fromstring

    try:
        return dict(fromstring(f"<o {data}/>").attrib)
    except (ParseError, ValueError) as error:
        raise reader.fault('give the instruction as key="value" …', repr(data[:80])) from error


def _param(attrs: AttributesImpl, reader: _Reader) -> Param:
    """Return a parameter, held to what MeshLab needs in order not to drop it silently."""
    name, type_ = attrs.get("name"), attrs.get("type")
    if not name:
        raise reader.fault("give every Param its name", "<Param> without a name")
    if type_ not in TYPES:
        raise reader.fault(f"give {name!r} a type among {', '.join(TYPES)}", repr(type_))

    def text(key: str) -> str:
        if key not in attrs:
            raise reader.fault(f"give {name!r} ({type_}) the attribute {key!r}", "none")
        return str(attrs[key])

    def number(key: str) -> float:
        try:
            value = float(text(key))
        except ValueError:
            value = math.nan
        if not abs(value) <= FLOAT_MAX:
            raise reader.fault(f"give {name!r} ({type_}) a finite number as {key!r}", text(key))
        return value

    def integer(key: str) -> int:
        digits = text(key).strip()
        value = int(digits) if _WHOLE.fullmatch(digits) else None
        if value is None or abs(value) >= 2**31:
            raise reader.fault(f"give {name!r} ({type_}) a whole number as {key!r}", text(key))
        return value

    def listed(stem: str, count: str) -> tuple[str, ...]:
        size = integer(count)
        if not 0 <= size <= len(attrs):
            raise reader.fault(f"give {name!r} as many {stem}… as {count} says", str(size))
        return tuple(text(f"{stem}{i}") for i in range(size))

    line = reader.line
    if type_ in COMPONENTS:
        values = tuple(number(key) for key in COMPONENTS[type_])
        if type_ == "RichColor" and not all(v in range(256) for v in values):
            raise reader.fault(f"give {name!r} whole numbers from 0 to 255", str(values))
        return Param(name=name, type=type_, value=values, line=line)
    if type_ == "RichBool":
        if text("value") not in ("true", "false"):
            raise reader.fault(f"give {name!r} (RichBool) as true or false", text("value"))
        return Param(name=name, type=type_, value=text("value") == "true", line=line)
    if type_ in BOUNDED:
        low, value, high = number("min"), number("value"), number("max")
        # MeshLab's own field for a percentage goes a whole range below and to twice the maximum.
        spread = type_ == "RichAbsPerc"
        least, most = (2 * low - high, max(high, 2 * high)) if spread else (low, high)
        if not (low <= high and least <= value <= most):
            must = f"give {name!r} ({type_}) a value from {least:g} to {most:g}, by its own bounds"
            raise reader.fault(must, f"{value:g}")
        return Param(name=name, type=type_, value=value, minimum=low, maximum=high, line=line)
    if type_ == "RichEnum":
        choices, index = listed("enum_val", "enum_cardinality"), integer("value")
        if not 0 <= index < len(choices):
            raise reader.fault(f"give {name!r} a value from 0 to {len(choices) - 1}", str(index))
        return Param(name=name, type=type_, value=index, choices=choices, line=line)
    if type_ in INTEGERS:
        return Param(name=name, type=type_, value=integer("value"), line=line)
    if type_ == "RichFloat":
        return Param(name=name, type=type_, value=number("value"), line=line)
    extensions: tuple[str, ...] = ()
    if type_ == "RichOpenFile":
        extensions = listed("exts_val", "exts_cardinality")
    elif type_ == "RichSaveFile":
        extensions = (text("ext"),)
    return Param(name=name, type=type_, value=text("value"), choices=extensions, line=line)
