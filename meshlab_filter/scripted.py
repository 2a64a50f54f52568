"""Whole runs from files by a preset: rank the cloud, then run the filters of the script."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from .bridge.check import check_layer, check_script
from .bridge.layer import add_layer
from .bridge.script import ScriptRun, check_ranked, run_script
from .bridge.session import import_pymeshlab, load
from .chain import Progress, check_places, describe, write_outcome
from .cloud import MESHLAB_FORMATS, check_readable, check_writable, write_cloud
from .errors import PresetError
from .files import FileSummary
from .fitting import fit_surface
from .htmlreport import check_html
from .measure import Measured, Outcome, Scan, distances_to, prepare, rebuild
from .methods.ranking import Ranking
from .mlx import FilterScript
from .presets import open_script
from .provenance import comments, fingerprint, versions
from .recipe import Recipe
from .simplification import Simplification
from .steps import radii_of, untouched
from .stopwatch import Stopwatch
from .validation import FloatArray

if TYPE_CHECKING:
    import pymeshlab


@dataclass(frozen=True, kw_only=True)
class Scripted:
    """What a script made of a scan.

    Attributes
    ----------
    meshset : pymeshlab.MeshSet
        All layers; the current one is the result.
    run : ScriptRun
    origin : numpy.ndarray, shape (3,), float64
        What was taken off the coordinates.
    """

    meshset: pymeshlab.MeshSet
    run: ScriptRun
    origin: FloatArray

    def vertices(self) -> FloatArray:
        """Return the vertices of the current layer in the coordinates of the file."""
        mesh = self.meshset.current_mesh()
        return np.asarray(mesh.vertex_matrix() + self.origin)


def run_preset(
    path: str | os.PathLike[str],
    out: str | os.PathLike[str],
    preset: str | os.PathLike[str] | FilterScript,
    *,
    seed: int | None = None,
    floor: bool = True,
    drop_invalid: bool = False,
    html: bool = False,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Run a preset, or any filter script, on the cloud in a file and write the results.

    Parameters
    ----------
    path : path-like
        The cloud. A script without the instruction ``<?meshlab-filter …?>`` gets it as MeshLab
        reads it, faces and quality included.
    out : path-like
        Folder for the results, as of :func:`meshlab_filter.run`.
    preset : str, path or FilterScript
        A name such as "bunny", the path of an .mlx file, or a script in memory.
    seed : int, optional
        Instead of the seed in the instruction.
    floor : bool
        Run the script without its deletion as well, if it thins as the presets do.
    drop_invalid : bool
        Leave out points with NaN or infinite coordinates instead of refusing the file.
    html : bool
        Also write ``report.html``, as of :func:`meshlab_filter.run`.
    progress : callable, optional

    Returns
    -------
    dict
        What ``report.json`` holds (docs/report.md), and "script": its "name", what each filter
        returned ("outputs", in the script's order) and what the last Hausdorff filter returned
        ("hausdorff", in the cloud's unit).

    Raises
    ------
    MeshlabFilterError
        A subclass, with one sentence that says what is wrong. Nothing is written then.
    """
    if html:
        check_html()
    tell = progress or (lambda stage, share: None)
    watch = Stopwatch(lambda stage: tell(stage, None))
    script, recipe = _read(preset, seed)
    path, out = check_places(path, out)
    scan = prepare(path, drop_invalid=drop_invalid, watch=watch)
    ranking = None
    if recipe is not None:
        with watch("rank"):
            ranking = _rank(recipe, scan, lambda share: tell("rank", share))
    with watch("filters"):
        scripted = _apply(script, recipe, ranking, scan, tell)
        fit = recipe is not None and recipe.fit
        measured = _measure(scripted, scan, fit=fit, radii=radii_of(script))
    base = None
    bare = untouched(script)
    if floor and bare is not None and len(bare.filters) > 1:
        with watch("floor"):
            base = _measure(_apply(bare, recipe, ranking, scan, tell), scan)
    result = _result(scripted, recipe, ranking, len(scan.cloud.points))
    other = None
    if scripted.run.indices is None:
        other = scripted.vertices()
    outcome = Outcome(scan=scan, result=result, measured=measured, base=base, other=other)
    report = describe(
        outcome,
        {
            "preset": script.source,
            "surface": measured.reconstruction["surface"],
            "drop_invalid": drop_invalid,
        },
    )
    report["script"] = {
        "name": script.source,
        "filters": [filter_.name for filter_ in script],
        "outputs": [_plain(output) for output in scripted.run.outputs],
        "hausdorff": _plain(scripted.run.hausdorff) if scripted.run.hausdorff else None,
    }
    write_outcome(out, outcome, report, watch=watch, html=html)
    return report


def simplify_preset(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    preset: str | os.PathLike[str] | FilterScript,
    *,
    seed: int | None = None,
    drop_invalid: bool = False,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> FileSummary:
    """Thin the cloud in a file as a script does and write the points that stay.

    Parameters
    ----------
    source, target : path-like
        As for :func:`meshlab_filter.files.simplify_file`.
    preset, seed
        As for :func:`run_preset`.
    drop_invalid, overwrite : bool
    progress : callable, optional

    Returns
    -------
    FileSummary

    Raises
    ------
    PresetError
        If the script makes points of its own, which have no attributes.
    MeshlabFilterError
        Another subclass, with one sentence. Nothing is written then.
    """
    tell = progress or (lambda stage, share: None)
    script, recipe = _read(preset, seed)
    source, target = check_readable(source), check_writable(target)
    watch = Stopwatch(lambda stage: tell(stage, None))
    scan = prepare(source, drop_invalid=drop_invalid, watch=watch)
    ranking = None
    if recipe is not None:
        ranking = _rank(recipe, scan, lambda share: tell("rank", share))
    scripted = _apply(script, recipe, ranking, scan, tell)
    if scripted.run.indices is None:
        raise PresetError(
            "The filter script makes points of its own, so nothing is left of the cloud to write; "
            f"use 'meshlab-filter run'. Given: {script.source}."
        )
    result = _result(scripted, recipe, ranking, len(scan.cloud.points))
    parameters = {"method": result.method, **result.parameters, "preset": script.source}
    write_cloud(
        scan.cloud,
        target,
        indices=result.indices,
        overwrite=overwrite,
        comments=comments(
            {"input": fingerprint(source), "parameters": parameters, "versions": versions()}
        ),
    )
    return FileSummary(source=source, target=target, cloud=scan.cloud, result=result)


def seeded(preset: str | os.PathLike[str] | FilterScript, seed: int | None) -> FilterScript:
    """Return the script of a preset with the seed in it that a run was given."""
    script, recipe = _read(preset, seed)
    if recipe is None or seed is None:
        return script
    return replace(script, instruction=recipe.instruction())


def _read(
    preset: str | os.PathLike[str] | FilterScript, seed: int | None
) -> tuple[FilterScript, Recipe | None]:
    script = open_script(preset)
    if script.instruction is None:
        return script, None
    recipe = Recipe.of(script.instruction, source=script.source)
    return script, recipe if seed is None else replace(recipe, seed=seed)


def _rank(recipe: Recipe, scan: Scan, progress: Callable[[float], object]) -> Ranking:
    normals = scan.normals if recipe.normals == "layer" else scan.cloud.normals
    return recipe.rank(scan.cloud.points, normals=normals, progress=progress)


def _apply(
    script: FilterScript,
    recipe: Recipe | None,
    ranking: Ranking | None,
    scan: Scan,
    tell: Progress,
) -> Scripted:
    """Make the script's layer 0 and run the script on it."""
    cloud = scan.cloud
    meshset = import_pymeshlab().MeshSet(verbose=False)
    origin = scan.origin if recipe is not None and recipe.center else np.zeros(3)
    if recipe is not None and ranking is not None:
        add_layer(
            meshset,
            cloud.points - origin,
            normals=scan.normals,
            quality=recipe.values(ranking),
            colors=cloud.colors,
            name=cloud.path.name,
        )
        check_ranked(meshset, script)
    else:
        if cloud.path.suffix.lower() in (".ply", *MESHLAB_FORMATS):
            load(meshset, cloud.path)
        else:
            add_layer(meshset, cloud.points, normals=cloud.normals, colors=cloud.colors)
        check_layer(meshset)
        check_script(meshset, script)
    count = meshset.current_mesh().vertex_number()
    run = run_script(meshset, script, relative=recipe is not None, progress=tell)
    if count != len(cloud.points):
        run.indices = None
    if meshset.mesh_number() == 0 or meshset.current_mesh().vertex_number() == 0:
        raise PresetError(
            "The filter script leaves no vertices in the current layer, so there is no result. "
            f"Given: {script.source}."
        )
    return Scripted(meshset=meshset, run=run, origin=origin)


def _measure(
    scripted: Scripted, scan: Scan, *, fit: bool = False, radii: Sequence[float] = ()
) -> Measured:
    """Measure the cloud against the current layer, on layers that the script has not touched.

    A fit begins with the reconstruction (:func:`meshlab_filter.measure.rebuild`): of a surface
    made in passes of these radii only the vertices are taken.
    """
    mesh = scripted.meshset.current_mesh()
    faces = np.asarray(mesh.face_matrix(), dtype=np.int64).reshape(-1, 3)
    indices = scripted.run.indices
    own = indices is None or scripted.run.own_vertices
    vertices = scripted.vertices() if own or indices is None else scan.cloud.points[indices]
    cloud = scan.cloud.points - scan.origin
    centred = vertices - scan.origin
    if own:  # there and back again would cost a digit
        centred = mesh.vertex_matrix() + (scripted.origin - scan.origin)
    fit = fit and len(faces) > 0
    normals = None if own or indices is None else scan.normals[indices]
    if fit and radii and normals is not None:
        _, faces, _ = rebuild(centred, normals, cloud, radii=radii)
    elif fit:
        faces = fit_surface(centred, faces, cloud, normals=normals)
    return Measured(
        points=vertices,
        faces=faces,
        distances=distances_to(centred, faces, cloud, kept=None if own else indices),
        reconstruction={
            "surface": "script" if len(faces) else "none",
            "spacing": None,
            "radii": [],
            "fitted": fit,
        },
    )


def _result(
    scripted: Scripted, recipe: Recipe | None, ranking: Ranking | None, total: int
) -> Simplification:
    """Say what was left in the words of :func:`meshlab_filter.simplify`."""
    indices = scripted.run.indices
    kept = np.arange(total) if indices is None else indices
    rank = np.zeros(total, dtype=np.int64) if ranking is None else ranking.rank
    gone = np.ones(total, dtype=bool)
    gone[kept] = False
    return Simplification(
        indices=kept,
        rank=rank,
        threshold=int(rank[gone].max()) + 1 if ranking is not None and gone.any() else 0,
        labels=None if ranking is None else ranking.labels,
        entropy=None if ranking is None else ranking.entropy,
        method="script" if recipe is None else recipe.method,
        parameters={} if recipe is None else {**recipe.parameters, "seed": recipe.seed},
        info={} if ranking is None else ranking.info,
    )


def _plain(output: dict[str, Any]) -> dict[str, Any]:
    """Return what of a filter's output has a place in JSON: arrays are left to MeshLab."""
    found: dict[str, Any] = {}
    for name, value in output.items():
        plain = value.item() if isinstance(value, np.generic) else value
        if isinstance(plain, float) and not np.isfinite(plain):
            found[name] = None
        elif isinstance(plain, int | float | str | bool):
            found[name] = plain
    return found
