"""Filter scripts as data."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshlab_filter import mlx
from meshlab_filter.errors import PresetError
from meshlab_filter.mlx import Filter, FilterScript, Instruction, Param

BOMB = """<?xml version="1.0"?>
<!DOCTYPE lolz [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>
<FilterScript><filter name="&b;"/></FilterScript>"""
EXTERNAL = """<!DOCTYPE FilterScript [<!ENTITY x SYSTEM "file:///etc/hostname">]>
<FilterScript><filter name="&x;"/></FilterScript>"""


def script(body: str) -> str:
    return f"<!DOCTYPE FilterScript>\n<FilterScript>\n{body}\n</FilterScript>"


def with_param(attributes: str) -> str:
    return script(f'<filter name="F">\n<Param {attributes}/>\n</filter>')


names = st.text(
    st.characters(exclude_categories=("Cs", "Cc", "Cn"), exclude_characters="\ufffe\uffff"),
    min_size=1,
    max_size=20,
).filter(lambda text: text == " ".join(text.split()))
floats = st.floats(-1e30, 1e30, allow_nan=False)
integers = st.integers(-(2**31) + 1, 2**31 - 1)


@st.composite
def params(draw: st.DrawFn, name: str = "p") -> Param:
    kind = draw(st.sampled_from(mlx.TYPES))
    extra = {}
    if kind == "RichBool":
        value = draw(st.booleans())
    elif kind in mlx.BOUNDED:
        low, value, high = sorted(draw(st.tuples(floats, floats, floats)))
        extra = {"minimum": low, "maximum": high}
    elif kind == "RichEnum":
        extra = {"choices": tuple(draw(st.lists(names, min_size=1, max_size=4)))}
        value = draw(st.integers(0, len(extra["choices"]) - 1))
    elif kind in mlx.INTEGERS:
        value = draw(integers)
    elif kind == "RichFloat":
        value = draw(floats)
    elif kind == "RichColor":
        value = tuple(float(draw(st.integers(0, 255))) for _ in range(4))
    elif kind in mlx.COMPONENTS:
        value = tuple(draw(floats) for _ in mlx.COMPONENTS[kind])
    else:
        value = draw(names)
        if kind == "RichOpenFile":
            extra = {"choices": tuple(draw(st.lists(names, max_size=3)))}
        elif kind == "RichSaveFile":
            extra = {"choices": (draw(names),)}
    return Param(name=name, type=kind, value=value, **extra)


@st.composite
def scripts(draw: st.DrawFn) -> FilterScript:
    filters = []
    for _ in range(draw(st.integers(0, 3))):
        labels = draw(st.lists(names, max_size=3, unique=True))
        filters.append(Filter(draw(names), tuple(draw(params(label)) for label in labels)))
    options = draw(st.none() | st.dictionaries(st.sampled_from("abcd"), names, max_size=3))
    safe = "?>"
    if options and any(safe in text for text in options.values()):
        options = None
    return FilterScript(tuple(filters), None if options is None else Instruction(options))


@settings(max_examples=80, deadline=None)
@given(scripts())
def test_round_trip(original):
    """What is written reads back the same, and writes the same text again."""
    text = original.to_xml()
    again = mlx.parse(text)
    assert again == original
    assert again.to_xml() == text


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=200) | st.text(max_size=200).map(lambda text: script(text).encode()))
def test_any_bytes_are_read_or_refused(content):
    """Whatever the bytes, the answer is a script or a PresetError."""
    try:
        mlx.parse(content)
    except PresetError as error:
        assert str(error).endswith(".")  # noqa: PT017 (both outcomes are right)


def test_comments_and_instruction_survive():
    """The comment is wrapped in the file and whole again when read."""
    comment = "word " * 60 + "end\n\nsecond paragraph"
    original = FilterScript((), Instruction({"clusters": "807", "note": 'a "b" <c> & d'}), comment)
    again = mlx.parse(original.to_xml())
    assert again.comment == " ".join(comment.split("\n\n")[0].split()) + "\n\nsecond paragraph"
    assert again.instruction == original.instruction
    assert max(map(len, original.to_xml().splitlines())) < 110


def test_comment_with_hyphens_is_refused():
    """XML has no way to write two hyphens in a comment."""
    with pytest.raises(PresetError, match="two hyphens"):
        FilterScript((), comment="run --preset").to_xml()


def test_lines_and_order():
    """Every filter and parameter knows its line; the order is the file's."""
    read = mlx.parse(
        script('<filter name="A"/>\n<filter name="B">\n<Param type="RichInt" name="K" value="3"/>\n'
               "</filter>")
    )  # fmt: skip
    assert [(f.name, f.line) for f in read] == [("A", 3), ("B", 4)]
    assert read.filters[1]["K"].line == 5
    assert read.filters[1].values() == {"K": 3}
    with pytest.raises(KeyError):
        read.filters[0]["K"]


def test_scripts_of_meshlab_itself():
    """The sample script inside pymeshlab's wheel, with descriptions and HTML in it, is read."""
    from meshlab_filter.bridge.samples import sample_mesh

    read = mlx.read(sample_mesh("sample_filter_script.mlx"))
    assert read.filters[0].name == "Box/Cube"
    assert read.filters[2]["Threshold"].maximum == 3.4641


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "line 1. Must be well-formed XML"),
        ("ply\nformat ascii 1.0", "line 1. Must be well-formed XML"),
        ("<FilterScript>\n<filter name='A'>\n</FilterScript>", "line 3. Must be well-formed"),
        (BOMB, "Must not declare or use entities.*EntitiesForbidden"),
        (EXTERNAL, "Must not declare or use entities"),
        ('<!DOCTYPE FilterScript SYSTEM "http://example.org/x.dtd"><FilterScript/>',
         "not refer to another file"),
        ("<MeshLabProject/>", "root element <FilterScript>. Given: <MeshLabProject>"),
        (script("<xmlfilter name='A'/>"), "line 3. Must hold only <filter>. Given: <xmlfilter>"),
        (script("<filter name='A'><param/></filter>"), "filter 'A'. Must hold only <Param>"),
        (script("<filter/>"), "give every filter its name"),
        (script("text"), "no text between its elements. Given: 'text'"),
        (script("<?meshlab-filter clusters=7?>"), "give the instruction as key"),
        (script("<?meshlab-filter a='1'?><?meshlab-filter a='1'?>"), "a second one"),
        (script("<filter name='A'/><?meshlab-filter a='1'?>"), "before the first filter"),
        (with_param('type="RichInt" value="3"'), "line 4, filter 'F'. Must give every Param"),
        (with_param('name="K" value="3"'), "give 'K' a type among RichBool"),
        (with_param('name="K" type="RichShotf"'), "give 'K' a type among"),
        (with_param('name="K" type="RichInt"'), "the attribute 'value'. Given: none"),
        (with_param('name="K" type="RichInt" value="1.5"'), "whole number as 'value'. Given: 1.5"),
        (with_param('name="K" type="RichInt" value="9999999999"'), "whole number"),
        (with_param('name="K" type="RichFloat" value="nan"'), "a finite number"),
        (with_param('name="K" type="RichFloat" value="1e39"'), "a finite number"),
        (with_param('name="K" type="RichFloat" value="1,5"'), "a finite number"),
        (with_param('name="K" type="RichBool" value="True"'), "as true or false. Given: True"),
        (with_param('name="K" type="RichAbsPerc" value="1"'), "the attribute 'min'"),
        (with_param('name="K" type="RichAbsPerc" value="9" min="0" max="3"'), "from -3 to 6"),
        (with_param('name="K" type="RichDynamicFloat" value="4" min="0" max="3"'), "from 0 to 3"),
        (with_param('name="K" type="RichEnum" value="2" enum_cardinality="1" enum_val0="a"'),
         "from 0 to 0"),
        (with_param('name="K" type="RichEnum" value="0" enum_cardinality="99"'), "enum_cardinal"),
        (with_param('name="K" type="RichPoint3f" x="0" y="0"'), "the attribute 'z'"),
        (with_param('name="K" type="RichColor" r="0" g="0" b="300" a="0"'), "from 0 to 255"),
        (script("<filter name='A'><Param name='K' type='RichInt' value='1'/>"
                "<Param name='K' type='RichInt' value='2'/></filter>"), "'K' a second time"),
    ],
)  # fmt: skip
def test_faults_are_sentences(content, message):
    """Each fault of form names what must be, what is given, file, line and filter."""
    with pytest.raises(PresetError, match=message) as caught:
        mlx.parse(content, source="my.mlx")
    assert "my.mlx" in str(caught.value)


def test_missing_file(tmp_path):
    """A file that cannot be read is named."""
    with pytest.raises(PresetError, match=r"none\.mlx \(No such file"):
        mlx.read(tmp_path / "none.mlx")


def test_file_round_trip(tmp_path):
    """A file written is the same bytes on every system."""
    original = FilterScript((Filter("Größe"),))
    mlx.write(original, tmp_path / "a.mlx")
    assert mlx.read(tmp_path / "a.mlx") == original
    assert b"\r" not in (tmp_path / "a.mlx").read_bytes()
