"""The table of methods and how a method and its parameters are looked up."""

import pytest

from meshlab_filter.errors import InvalidParameterError
from meshlab_filter.methods.registry import METHODS, Parameter, get_method


@pytest.mark.parametrize("name", METHODS)
def test_every_entry_is_complete(name):
    """Each method says in one line what it does, what it keeps and where it comes from."""
    method = METHODS[name]
    assert method.name == name
    for text in (method.summary, method.keeps, method.source):
        assert text
        assert "\n" not in text
    assert len({parameter.name for parameter in method.parameters}) == len(method.parameters)


def test_unknown_method_names_the_nearest():
    """A misspelt method is answered with the one that was meant."""
    with pytest.raises(InvalidParameterError, match=r"such as shi2011.*Given: 'shi2010'"):
        get_method("shi2010")


def test_assignments_become_keywords():
    """NAME=VALUE texts are converted to the parameter's type; hyphens count as underscores."""
    values = get_method("shi2011").parse(["space-interval=0.076", "iterations=3"])
    assert values == {"space_interval": 0.076, "iterations": 3}


def test_none_stands_for_a_derived_default():
    """The word none is accepted where the default is derived."""
    assert get_method("shi2011").parse(["space_interval=none"]) == {"space_interval": None}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("normal_threshold", "Must be NAME=VALUE"),
        ("threshold=1", "Must be one of space_interval, normal_threshold"),
        ("normal_threshold=steep", "Invalid normal_threshold. Must be a number. Given: 'steep'"),
        ("iterations=2.5", "Invalid iterations. Must be a whole number"),
    ],
)
def test_bad_assignments_are_refused(text, message):
    """An assignment that cannot be read is answered with what it must be."""
    with pytest.raises(InvalidParameterError, match=message):
        get_method("shi2011").parse([text])


def test_methods_without_parameters_say_so():
    """A parameter handed to a method that has none is refused in words that fit."""
    with pytest.raises(InvalidParameterError, match="there are none"):
        get_method("random").parse(["size=3"])


@pytest.mark.parametrize(("text", "value"), [("true", True), ("no", False)])
def test_switches_are_read(text, value):
    """A switch takes the usual words."""
    assert Parameter("even", bool, False, "a switch").parse(text) is value


def test_bad_switch_is_refused():
    """A switch takes no other word."""
    with pytest.raises(InvalidParameterError, match="Must be true or false"):
        Parameter("even", bool, False, "a switch").parse("maybe")
