"""Running filter scripts on pymeshlab's layers, ranking the cloud first where they say so."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..methods.registry import get_method
from ..mlx import Filter, FilterScript, Param
from ..presets import open_script
from ..recipe import Recipe
from ..validation import IntArray
from .catalogue import available, python_name, python_value
from .check import (
    CONDITION,
    DELETE,
    DUPLICATE,
    HAUSDORFF,
    check_layer,
    check_script,
    fault,
)
from .layer import current_normals, current_points, set_quality
from .session import import_pymeshlab, stage
from .surface import compute_normals

if TYPE_CHECKING:
    import pymeshlab

# Filters that change neither the number of vertices nor their places, on any layer.
_KEEPS_VERTICES = (
    CONDITION,
    HAUSDORFF,
    "compute_normal_for_point_clouds",
    "generate_surface_reconstruction_ball_pivoting",
)


@dataclass
class ScriptRun:
    """What running a script came to.

    Attributes
    ----------
    outputs : list of dict
        What each filter returned, in the script's order.
    hausdorff : dict or None
        What the last Hausdorff filter returned.
    indices : numpy.ndarray, shape (M,), int64, or None
        Which vertices of the layer at the start are left, in its order: those of the current
        layer, or of the one that a surface with vertices of its own was built from. None if what
        is left are other points.
    own_vertices : bool
        Whether the current layer's vertices are others than those of ``indices``.
    """

    outputs: list[dict[str, Any]] = field(default_factory=list)
    hausdorff: dict[str, Any] | None = None
    indices: IntArray | None = None
    own_vertices: bool = False


def apply_preset(
    meshset: pymeshlab.MeshSet,
    preset: str | os.PathLike[str] | FilterScript,
    *,
    seed: int | None = None,
) -> dict[str, Any]:
    """Run a preset, or any filter script, on the current layer.

    If the script has an instruction ``<?meshlab-filter …?>``, the current layer is copied, the
    copy is ranked and gets the rank as quality; the script's layer 0 is this copy and its layers
    1, 2, … are those that its filters make. The user's layer stays as it was. Without the
    instruction the filters run as they stand, on the layers that are there. Everything is checked
    before the first filter runs; one thing cannot be: a condition on a layer of yours that had a
    custom attribute before it came into the MeshSet crashes MeshLab, with or without this package.

    Parameters
    ----------
    meshset : pymeshlab.MeshSet
    preset : str, path or FilterScript
        A name such as "bunny", the path of an .mlx file, or a script in memory.
    seed : int, optional
        Instead of the seed in the instruction.

    Returns
    -------
    dict
        As pymeshlab's filters return one: "vertices_before", "vertices_after" and "faces" of the
        layer that is current in the end; with an instruction "clusters" (None for methods
        without); and what the last Hausdorff filter returned ("mean", "max", "RMS",
        "n_samples", …, in the unit of the coordinates), if the script has one.

    Raises
    ------
    InvalidCloudError
        If there is no layer or it cannot be worked on. MeshLab itself would crash.
    PresetError
        If the script cannot be run as it stands; names file, line and filter.
    MeshLabError
        If a filter fails.

    Examples
    --------
    >>> import pymeshlab
    >>> ms = pymeshlab.MeshSet(verbose=False)
    >>> ms.create_sphere(subdiv=4)
    >>> figures = apply_preset(ms, "default")
    >>> figures["vertices_before"], figures["vertices_after"] < 2562, figures["clusters"]
    (2562, True, 128)
    """
    script = open_script(preset)
    figures: dict[str, Any] = {"vertices_before": 0}
    if script.instruction is not None:
        check_layer(meshset)
    if meshset.mesh_number() > 0:
        figures["vertices_before"] = meshset.current_mesh().vertex_number()
    if script.instruction is None:
        check_script(meshset, script)
        result = run_script(meshset, script)
    else:
        recipe = Recipe.of(script.instruction, source=script.source)
        if seed is not None:
            recipe = replace(recipe, seed=seed)
        current_points(meshset)
        with stage("copying the layer"):
            # A layer that has been given an attribute before it came into the MeshSet crashes
            # MeshLab's expressions; a copy does not, and spares the user's own quality.
            meshset.generate_copy_of_current_mesh()
        if recipe.normals == "layer" and get_method(recipe.method).uses_normals:
            compute_normals(meshset)
        ranking = recipe.rank(current_points(meshset), normals=current_normals(meshset))
        set_quality(meshset, recipe.values(ranking))
        check_ranked(meshset, script)
        result = run_script(meshset, script, relative=True)
        figures["clusters"] = None if ranking.entropy is None else len(ranking.entropy)
    left = meshset.mesh_number() > 0
    figures["vertices_after"] = meshset.current_mesh().vertex_number() if left else 0
    figures["faces"] = meshset.current_mesh().face_number() if left else 0
    return figures | (result.hausdorff or {})


def check_ranked(meshset: pymeshlab.MeshSet, script: FilterScript) -> None:
    """Check a script whose layer 0 is the current, ranked layer, and that it leaves vertices.

    Raises
    ------
    PresetError
        As :func:`~meshlab_filter.bridge.check.check_script`; or if the script's first condition
        selects every vertex for deletion.
    """
    module = import_pymeshlab()
    mesh = meshset.current_mesh()
    alone = module.MeshSet(verbose=False)
    alone.add_mesh(
        module.Mesh(
            mesh.vertex_matrix(),
            v_normals_matrix=mesh.vertex_normal_matrix(),
            v_scalar_array=mesh.vertex_scalar_array(),
        )
    )
    check_script(alone, script)
    names = available()
    pythons = [names[filter_.name].python for filter_ in script]
    start = 1 if pythons[:1] == [DUPLICATE] else 0
    if pythons[start : start + 2] == [CONDITION, DELETE]:
        condition = script.filters[start]
        alone.apply_filter(CONDITION, condselect=condition["condSelect"].value)
        total = alone.current_mesh().vertex_number()
        if alone.current_mesh().selected_vertex_number() == total:
            top = float(mesh.vertex_scalar_array().max())
            raise fault(
                script,
                condition,
                f"leave some of the cloud, whose quality goes up to {top:g}",
                f"{condition['condSelect'].value!r}, which deletes all {total} vertices",
                line=condition["condSelect"].line,
            )


def run_script(
    meshset: pymeshlab.MeshSet,
    script: FilterScript,
    *,
    relative: bool = False,
    progress: Callable[[str, float], object] | None = None,
) -> ScriptRun:
    """Run the filters of a checked script one by one, in the file's order.

    Parameters
    ----------
    meshset : pymeshlab.MeshSet
    script : FilterScript
    relative : bool
        Whether layer 0 of the script is the current layer and its layers 1, 2, … are those the
        script makes, whatever else is in the MeshSet.
    progress : callable, optional
        Called with the name of each filter and the share of the filters done.

    Returns
    -------
    ScriptRun

    Raises
    ------
    PresetError
        If a filter needs a layer or vertices that are not there by then.
    MeshLabError
        If a filter fails.
    """
    names = available()
    run, layers = ScriptRun(), []
    if meshset.mesh_number() > 0:
        run.indices = np.arange(meshset.current_mesh().vertex_number())
        layers.append(meshset.current_mesh_id())
    for number, filter_ in enumerate(script):
        if progress is not None:
            progress(filter_.name, number / len(script.filters))
        python = names[filter_.name].python
        arguments = {
            python_name(param.name): _layer(meshset, script, filter_, param, layers)
            if param.type == "RichMesh" and relative
            else python_value(param)
            for param in filter_.params
        }
        _check_now(meshset, script, filter_, python, arguments)
        there = {mesh.id() for mesh in meshset}
        follow = _follow(meshset, python)
        where = f" (line {filter_.line})" if filter_.line else ""
        with stage(f"running the filter {filter_.name!r} of {script.source}{where}"):
            output = meshset.apply_filter(python, **arguments)
        run.outputs.append(dict(output or {}))
        if python == HAUSDORFF:
            run.hausdorff = run.outputs[-1]
        follow(meshset, run)
        layers += sorted({mesh.id() for mesh in meshset} - there)
    return run


def _layer(
    meshset: pymeshlab.MeshSet, script: FilterScript, filter_: Filter, param: Param, ids: list[int]
) -> int:
    """Return the id of the layer that a relative script calls by its own number."""
    number = param.value
    assert isinstance(number, int)
    if not 0 <= number < len(ids):
        must = f"name in {param.name!r} a layer that exists by then (0 to {len(ids) - 1})"
        raise fault(script, filter_, must, str(number), line=param.line)
    return ids[number]


def _check_now(
    meshset: pymeshlab.MeshSet,
    script: FilterScript,
    filter_: Filter,
    python: str,
    arguments: dict[str, Any],
) -> None:
    """Stop before a filter that would find nothing to work on, which crashes MeshLab."""
    if python.startswith("create_"):
        return
    if meshset.mesh_number() == 0 or meshset.current_mesh().vertex_number() == 0:
        raise fault(script, filter_, "find vertices in the current layer", "none by then")
    for param in filter_.params:
        if param.type == "RichMesh":
            layer = arguments[python_name(param.name)]
            if not meshset.mesh_id_exists(layer) or meshset.mesh(layer).vertex_number() == 0:
                must = f"name in {param.name!r} a layer with vertices"
                raise fault(script, filter_, must, str(param.value), line=param.line)


def _follow(
    meshset: pymeshlab.MeshSet, python: str
) -> Callable[[pymeshlab.MeshSet, ScriptRun], None]:
    """Return a function that notes, after a filter, which vertices are left."""
    if meshset.mesh_number() == 0:
        return lambda after, run: None
    mesh = meshset.current_mesh()
    stays = ~mesh.vertex_selection_array() if python == DELETE else None
    watched = stays is None and python not in (*_KEEPS_VERTICES, DUPLICATE)
    before = mesh.vertex_matrix() if watched else None
    layer = mesh.id()

    def note(after: pymeshlab.MeshSet, run: ScriptRun) -> None:
        if run.indices is None:
            return
        if stays is not None:
            run.indices = None if run.own_vertices else run.indices[stays]
        elif before is not None and after.mesh_number() == 0:
            run.indices = None
        elif before is not None:
            now = after.current_mesh()
            if now.id() == layer and np.array_equal(now.vertex_matrix(), before):
                return
            # A new layer with faces is a surface made from the points; anything else that
            # changes vertices leaves points that are no longer the cloud's.
            run.own_vertices = True
            if now.id() == layer or now.face_number() == 0:
                run.indices = None

    return note
