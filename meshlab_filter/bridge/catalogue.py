"""MeshLab's filters as filter scripts spell them, and as pymeshlab does."""

from __future__ import annotations

import difflib
import json
import keyword
import re
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Any

from ..mlx import Param
from .session import import_pymeshlab

#: What MeshLab keeps each type of parameter as. It takes a value only of the same kind.
KINDS = {
    "RichBool": "true or false",
    "RichInt": "a whole number",
    "RichMesh": "a whole number",
    "RichEnum": "a whole number",
    "RichFloat": "a number",
    "RichAbsPerc": "a number",
    "RichDynamicFloat": "a number",
    "RichString": "text",
    "RichOpenFile": "text",
    "RichSaveFile": "text",
    "RichPoint3f": "a point",
    "RichPosition": "a point",
    "RichDirection": "a point",
    "RichColor": "a colour",
    "RichMatrix44f": "a matrix",
}


@dataclass(frozen=True)
class Entry:
    """One filter of MeshLab.

    Attributes
    ----------
    python : str
        pymeshlab's name of it.
    parameters : dict
        Spelling of each parameter → its type in a script.
    """

    python: str
    parameters: dict[str, str]


@lru_cache(maxsize=1)
def catalogue() -> dict[str, Entry]:
    """Return every filter of MeshLab 2025.07 by the name in its menus.

    Examples
    --------
    >>> catalogue()["Delete Selected Vertices"].python
    'meshing_remove_selected_vertices'
    """
    text = files(__package__).joinpath("catalogue.json").read_text(encoding="utf-8")
    return {name: Entry(**entry) for name, entry in json.loads(text).items()}


def available() -> dict[str, Entry]:
    """Return those filters that the MeshLab at hand has."""
    known = set(import_pymeshlab().filter_list())
    return {name: entry for name, entry in catalogue().items() if entry.python in known}


def nearest(name: str, names: list[str], *, count: int = 3) -> list[str]:
    """Return the names most like one that is unknown, upper and lower case apart.

    Examples
    --------
    >>> nearest("duplicate layer", ["Duplicate Current layer", "Sphere"])
    ['Duplicate Current layer']
    """
    by_lower = {known.lower(): known for known in names}
    found = difflib.get_close_matches(name.lower(), by_lower, n=count, cutoff=0.5)
    return [by_lower[lower] for lower in found]


def python_name(name: str) -> str:
    """Return pymeshlab's spelling of a parameter.

    Examples
    --------
    >>> python_name("condSelect")
    'condselect'
    """
    plain = re.sub(r"[ /-]", "_", name.lower())
    plain = re.sub(r"[().,'\":+]+", "", plain)
    return plain + "_" if keyword.iskeyword(plain) else plain


def python_value(param: Param) -> Any:
    """Return a parameter's value as pymeshlab takes it."""
    import numpy as np

    pymeshlab = import_pymeshlab()
    if param.type == "RichAbsPerc":
        return pymeshlab.PureValue(param.value)
    if param.type == "RichColor":
        assert isinstance(param.value, tuple)
        return pymeshlab.Color(*(int(component) for component in param.value))
    if param.type == "RichMatrix44f":
        return np.array(param.value).reshape(4, 4)
    if isinstance(param.value, tuple):
        return np.array(param.value)
    return param.value
