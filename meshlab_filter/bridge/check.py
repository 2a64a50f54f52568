"""Checks of a filter script against the MeshLab at hand, before any of its filters runs.

MeshLab itself answers a wrong name or a layer that does not exist with a silent stop or a crash.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InvalidCloudError, PresetError
from ..mlx import Filter, FilterScript, Param
from .catalogue import KINDS, Entry, available, nearest, python_name, python_value
from .session import import_pymeshlab, refusals, version

if TYPE_CHECKING:
    import pymeshlab

CONDITION = "compute_selection_by_condition_per_vertex"
DUPLICATE = "generate_copy_of_current_mesh"
DELETE = "meshing_remove_selected_vertices"
HAUSDORFF = "get_hausdorff_distance"

# Filters named create_… and generate_… make one layer and move to it, but for these.
_MAKES_NONE = ("generate_surface_reconstruction_ball_pivoting",)
_MAKES_ANY_NUMBER = (
    "delete_non_visible_meshes",
    "generate_by_merging_visible_meshes",
    "generate_polyline_from_planar_section",
    "generate_sampling_volumetric",
    "generate_sampling_voronoi",
    "generate_solid_wireframe",
    "generate_splitting_by_connected_components",
    "generate_voronoi_atlas_parametrization",
)

# A condition is an expression of muParserX: its comparisons are ==, <, <=, … and a single = would
# assign to the variable instead.
_ASSIGNMENT = re.compile(r"(?<![=<>!])=(?!=)")
_WORD = re.compile(r"\b[A-Za-z_]\w*\b")


def check_script(meshset: pymeshlab.MeshSet, script: FilterScript) -> None:
    """Check a filter script against the MeshLab and the layers at hand.

    Parameters
    ----------
    meshset : pymeshlab.MeshSet
        The layers on which the script is to run, current layer and qualities included.
    script : FilterScript

    Raises
    ------
    InvalidCloudError
        If the script needs a layer and there is none, or the current one has no vertices.
    PresetError
        If a filter or parameter is unknown to the MeshLab at hand, a value is of the wrong type
        or out of range, a layer will not exist when it is needed, or an expression does not make
        sense; names file, line and filter.
    """
    known = available()
    if not script.filters:
        raise PresetError(
            f"The filter script has no filters. Must have at least one. Given: {script.source}."
        )
    entries = [_entry(script, filter_, known) for filter_ in script.filters]
    if not entries[0].python.startswith("create_"):
        check_layer(meshset)
    layers = _Layers(meshset)
    for filter_, entry in zip(script.filters, entries):
        for param in filter_.params:
            _check_spelling(script, filter_, param, entry)
        _check_values(script, filter_, entry, meshset)
        layers.check(script, filter_)
        if entry.python == CONDITION:
            _check_condition(script, filter_, meshset)
        layers.after(entry.python, filter_)


def check_layer(meshset: pymeshlab.MeshSet) -> None:
    """Check that there is a current layer with vertices; MeshLab crashes without.

    Raises
    ------
    InvalidCloudError
        If there is none.
    """
    if meshset.mesh_number() == 0:
        raise InvalidCloudError("The MeshSet has no layers; load a cloud first. Given: 0 layers.")
    if meshset.current_mesh().vertex_number() == 0:
        raise InvalidCloudError("The current layer has no vertices. Given: 0 vertices.")


def fault(
    script: FilterScript, filter_: Filter, must: str, given: str, *, line: int | None = None
) -> PresetError:
    """Return the error that names file, line and filter."""
    at = line or filter_.line
    where = script.source + (f", line {at}" if at else "") + f", filter {filter_.name!r}"
    return PresetError(f"Invalid filter script {where}. Must {must}. Given: {given}.")


def _entry(script: FilterScript, filter_: Filter, known: dict[str, Entry]) -> Entry:
    if filter_.name in known:
        return known[filter_.name]
    near = nearest(filter_.name, list(known))
    hint = f" such as {' or '.join(map(repr, near))}" if near else ""
    must = f"name a filter that MeshLab (pymeshlab {version()}) has{hint}"
    raise fault(script, filter_, must, repr(filter_.name))


def _check_spelling(script: FilterScript, filter_: Filter, param: Param, entry: Entry) -> None:
    """MeshLab passes over a parameter it does not know and takes the default instead."""
    if param.name not in entry.parameters:
        near = [name for name in entry.parameters if name.lower() == param.name.lower()]
        near = near or nearest(param.name, list(entry.parameters))
        if near:
            must = f"name a parameter of the filter such as {' or '.join(map(repr, near))}"
        elif entry.parameters:
            must = f"name a parameter of the filter, {', '.join(map(repr, entry.parameters))}"
        else:
            must = "give this filter no parameters, for it has none"
        raise fault(script, filter_, must, repr(param.name), line=param.line)
    kind = KINDS[entry.parameters[param.name]]
    if KINDS[param.type] != kind:
        must = f"give {param.name!r} as {kind} ({entry.parameters[param.name]})"
        raise fault(script, filter_, must, f"{param.type} {param.value!r}", line=param.line)


def _check_values(
    script: FilterScript, filter_: Filter, entry: Entry, meshset: pymeshlab.MeshSet
) -> None:
    """Let pymeshlab itself take each value: it knows the range of each on this mesh."""
    refused: tuple[type[Exception], ...] = (*refusals(), RuntimeError)
    if meshset.mesh_number() == 0:
        return
    try:
        has = meshset.filter_parameter_values(entry.python)
    except refused:
        return  # needs what a filter before it will make, such as a quality of the faces
    for param in filter_.params:
        name = python_name(param.name)
        if name not in has:
            must = f"name a parameter that the filter has in pymeshlab {version()}"
            raise fault(script, filter_, must, repr(param.name), line=param.line)
        value = python_value(param)
        try:
            taken = meshset.filter_parameter_values(entry.python, **{name: value})[name]
        except refused as error:
            must = f"give {param.name!r} a value that MeshLab takes"
            given = f"{param.value!r} ({' '.join(str(error).split()).rstrip('.')})"
            raise fault(script, filter_, must, given, line=param.line) from error
        if param.type == "RichDynamicFloat" and taken != np.float32(value):
            # pymeshlab moves a value outside the range to its nearer end.
            must = f"give {param.name!r} a value in its range, which ends at {taken:g}"
            raise fault(script, filter_, must, f"{value:g}", line=param.line)


class _Layers:
    """Which layers will exist at each step of the script, as far as that can be told."""

    def __init__(self, meshset: pymeshlab.MeshSet) -> None:
        self.ids = {mesh.id() for mesh in meshset}
        self.current = meshset.current_mesh_id() if self.ids else -1
        self.next = max(self.ids, default=-1) + 1
        self.certain = True

    def check(self, script: FilterScript, filter_: Filter) -> None:
        for param in filter_.params:
            if param.type == "RichMesh" and self.certain and param.value not in self.ids:
                there = ", ".join(map(str, sorted(self.ids))) or "none"
                must = f"name in {param.name!r} a layer that exists then ({there})"
                raise fault(script, filter_, must, str(param.value), line=param.line)

    def after(self, python: str, filter_: Filter) -> None:
        if python in _MAKES_ANY_NUMBER:
            self.certain = False
        elif python == HAUSDORFF and filter_.values().get("SaveSample") is True:
            self._make(2)
        elif python == "delete_current_mesh":
            self.certain = self.certain and self.current >= 0
            self.ids.discard(self.current)
            # MeshLab chooses which layer is current next.
            self.current = next(iter(self.ids)) if len(self.ids) == 1 else -1
        elif python.startswith(("create_", "generate_")) and python not in _MAKES_NONE:
            self._make(1)
            self.current = self.next - 1

    def _make(self, count: int) -> None:
        self.ids |= set(range(self.next, self.next + count))
        self.next += count


def _check_condition(script: FilterScript, filter_: Filter, meshset: pymeshlab.MeshSet) -> None:
    """Let MeshLab's own parser read the expression, on a layer with a single vertex."""
    params = [param for param in filter_.params if param.name == "condSelect"]
    if not params:
        must = "give 'condSelect', an expression such as (q < 60)"
        raise fault(script, filter_, must, "none")
    text, line = str(params[0].value), params[0].line
    if _ASSIGNMENT.search(text):
        must = "compare with ==, <, <=, > or >=, for a single = assigns"
        raise fault(script, filter_, must, repr(text), line=line)
    words = set(_WORD.findall(text))
    pymeshlab = import_pymeshlab()
    mesh = pymeshlab.Mesh(np.zeros((1, 3)), v_scalar_array=np.zeros(1))
    scratch = pymeshlab.MeshSet(verbose=False)
    scratch.add_mesh(mesh)
    for word in words & _attributes(meshset, words):
        scratch.current_mesh().add_vertex_custom_scalar_attribute(np.zeros(1), word)
    try:
        scratch.apply_filter(CONDITION, condselect=text)
    except refusals() as error:
        reason = str(error).strip().splitlines()[-1].removeprefix("Details: ").rstrip(".")
        must = "give 'condSelect' an expression that MeshLab understands, such as (q < 60)"
        raise fault(script, filter_, must, f"{text!r} ({reason})", line=line) from error
    has_layer = meshset.mesh_number() > 0
    if "q" in words and has_layer and not meshset.current_mesh().has_vertex_scalar():
        must = (
            "have an instruction <?meshlab-filter …?> that ranks the cloud, or run on a cloud "
            "that `meshlab-filter annotate` wrote, for its expression asks for the quality q"
        )
        raise fault(script, filter_, must, "a cloud without quality", line=line)


def _attributes(meshset: pymeshlab.MeshSet, words: set[str]) -> set[str]:
    """Return those words that name a custom attribute of the current layer's vertices."""
    refused = refusals()
    found = set()
    for word in words if meshset.mesh_number() else ():
        try:
            meshset.current_mesh().vertex_custom_scalar_attribute_array(word)
        except refused:
            continue
        found.add(word)
    return found
