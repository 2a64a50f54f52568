"""The whole chain: simplify, rebuild the surface, measure the error, write it all down."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from .amounts import points_to_keep
from .bridge.distance import distances
from .bridge.layer import add_layer
from .bridge.meshreader import MeshReader
from .bridge.session import import_pymeshlab
from .cloud import Cloud, check_readable, read_cloud, write_cloud
from .colormap import colorize
from .errors import InvalidCloudError, InvalidParameterError, OutputError
from .htmlreport import check_html, write_html
from .measure import Outcome, Scan, error_scale, errors, figures, measure, prepare, worst_near
from .outputs import writing_folder
from .project import write_project
from .provenance import comments, fingerprint, versions
from .quality import acceptable_share, compactness, edge_defects
from .report import SCHEMA_VERSION, write_report
from .simplification import simplify
from .stopwatch import Stopwatch
from .surfacefile import write_surface
from .surfacefirst import simplify_surface
from .validation import check_choice

#: Called with the name of a stage and the share of it done, None where that is not known.
Progress = Callable[[str, "float | None"], object]

ORDERS = ("points-first", "surface-first")

FILES = ("simplified.ply", "surface.ply", "original.ply", "project.mlp", "report.json")
PAGE = "report.html"


def run(
    path: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    method: str | None = None,
    count: int | None = None,
    keep: float | None = None,
    seed: int = 0,
    surface: str = "ball-pivoting",
    order: str = "points-first",
    move: bool = False,
    fit: bool | None = None,
    floor: bool = True,
    drop_invalid: bool = False,
    html: bool = False,
    progress: Progress | None = None,
    **parameters: Any,
) -> dict[str, Any]:
    """Simplify a cloud, rebuild its surface, measure the error and write the results.

    Parameters
    ----------
    path : path-like
        The cloud, or a mesh whose vertices are the cloud.
    out : path-like
        Folder for the results, made if it does not exist: ``simplified.ply``, ``surface.ply``
        (the largest error near each vertex as quality and colour), ``original.ply`` (the
        distance of each point as quality), ``project.mlp`` and ``report.json``.
    method, count, keep, seed, **parameters
        As for :func:`meshlab_filter.simplify`.
    surface : str
        "ball-pivoting", "ball-pivoting-auto", "screened-poisson" or "none"
        (:func:`meshlab_filter.bridge.surface.reconstruct`).
    order : str
        "points-first": simplify the cloud, then build the surface through what stays.
        "surface-first": build the surface through the whole cloud, then collapse its edges
        (:func:`meshlab_filter.surfacefirst.simplify_surface`); needs ``count`` or ``keep`` and
        takes no method.
    move : bool
        With "surface-first": let points move to where the error is least.
    fit : bool, optional
        Mend the surface and flip its edges where that brings it nearer to the original points
        (:func:`meshlab_filter.fitting.fit_surface`). By default with "ball-pivoting" only:
        "ball-pivoting-auto" is the chain of the paper.
    floor : bool
        Measure the same chain on the untouched cloud as well: the error that is not due to the
        simplification.
    drop_invalid : bool
        Leave out points with NaN or infinite coordinates instead of refusing the file.
    html : bool
        Also write ``report.html``; needs the extra ``report`` (plotly and jinja2).
    progress : callable, optional

    Returns
    -------
    dict
        What ``report.json`` holds (docs/report.md).

    Raises
    ------
    MeshlabFilterError
        A subclass, with one sentence that says what is wrong. Nothing is written then.
    """
    check_choice(order, name="order", choices=ORDERS)
    if html:
        check_html()
    tell = progress or (lambda stage, share: None)
    watch = Stopwatch(lambda stage: tell(stage, None))
    path, out = check_places(path, out)
    scan = prepare(path, drop_invalid=drop_invalid, watch=watch)
    cloud = scan.cloud
    if order == "surface-first":
        with watch("surface and error"):
            result, measured = simplify_surface(
                scan,
                _count_alone(scan, count=count, keep=keep, method=method, **parameters),
                surface=surface,
                move=move,
            )
    else:
        if move:
            raise InvalidParameterError("Points only move with order surface-first. Given: move.")
        with watch("simplify"):
            result = simplify(
                cloud.points,
                method=method,
                normals=scan.normals,
                count=count,
                keep=keep,
                seed=seed,
                progress=lambda share: tell("simplify", share),
                **parameters,
            )
        with watch("surface and error"):
            fit = surface == "ball-pivoting" if fit is None else fit
            measured = measure(scan, result.indices, surface=surface, fit=fit)
    base = None
    if floor and surface != "none":
        with watch("floor"):
            base = measure(scan, np.arange(len(cloud.points)), surface=surface)
    outcome = Outcome(
        scan=scan,
        result=result,
        measured=measured,
        base=base,
        other=measured.points if move else None,
    )
    report = describe(
        outcome, {"surface": surface, "order": order, "fit": fit, "drop_invalid": drop_invalid}
    )
    write_outcome(out, outcome, report, watch=watch, html=html)
    return report


def compare(
    original: str | os.PathLike[str],
    other: str | os.PathLike[str],
    *,
    drop_invalid: bool = False,
) -> dict[str, Any]:
    """Measure how far two clouds or meshes are from each other, both ways.

    Parameters
    ----------
    original, other : path-like
        Files with points, or points and faces. Distances go from every vertex of the one to the
        surface of the other, or to its nearest vertex where it has no faces.
    drop_invalid : bool
        Leave out points with NaN or infinite coordinates instead of refusing the file.

    Returns
    -------
    dict
        "original" and "other" (counts and compactness), "error" (from the original's vertices to
        the other) and "backward" (the other way), each "uncut" and "cut" at 1 %; divided by the
        diagonal of the original's bounding box.

    Raises
    ------
    MeshlabFilterError
        A subclass, with one sentence that says what is wrong.
    """
    meshset = import_pymeshlab().MeshSet(verbose=False)
    clouds = []
    for file in (original, other):
        cloud = read_cloud(file, drop_invalid=drop_invalid)
        clouds.append(cloud)
        origin = (clouds[0].points.min(axis=0) + clouds[0].points.max(axis=0)) / 2
        points, faces = cloud.points, None
        if cloud.faces:
            with MeshReader() as reader:
                mesh = reader.read(cloud.path)
            points, faces = mesh["points"], mesh["faces"]
        add_layer(meshset, points - origin, faces=faces, name=Path(file).name)
    ids = [mesh.id() for mesh in meshset]
    diagonal = clouds[0].diagonal
    if diagonal == 0:
        raise InvalidCloudError(f"All points are in one place. Given: {original}.")
    return {
        "schema": SCHEMA_VERSION,
        "diagonal": diagonal,
        "original": {**fingerprint(clouds[0].path), **_counts(meshset.mesh(ids[0]))},
        "other": {**fingerprint(clouds[1].path), **_counts(meshset.mesh(ids[1]))},
        "error": errors(distances(meshset, ids[0], ids[1]), diagonal),
        "backward": errors(distances(meshset, ids[1], ids[0]), diagonal),
        "versions": versions(),
    }


def _count_alone(
    scan: Scan, *, count: int | None, keep: float | None, method: str | None, **parameters: Any
) -> int:
    """Return the number of points asked for, of which surface-first needs nothing else."""
    given = {name: value for name, value in parameters.items() if value is not None}
    if method is not None or given:
        raise InvalidParameterError(
            "With order surface-first MeshLab's edge collapse chooses the points, so no method and "
            f"none of its parameters can be set. Given: {method or ', '.join(given)}."
        )
    asked = points_to_keep(len(scan.cloud.points), count=count, keep=keep)
    if asked is None:
        raise InvalidParameterError("Order surface-first needs count or keep. Given: neither.")
    return asked


def check_places(path: str | os.PathLike[str], out: str | os.PathLike[str]) -> tuple[Path, Path]:
    """Return the paths of a readable input and a folder in which no output would replace it.

    Raises
    ------
    FileFormatError
        If the input cannot be read.
    OutputError
        If an output would replace it.
    """
    path, out = check_readable(path), Path(out)
    if out.exists() and any(
        (out / name).exists() and (out / name).samefile(path) for name in (*FILES, PAGE)
    ):
        raise OutputError(f"An output would replace the input. Given: {path} and {out}.")
    return path, out


def describe(outcome: Outcome, settings: dict[str, Any]) -> dict[str, Any]:
    """Return the report of a run, without its times.

    Parameters
    ----------
    outcome : Outcome
    settings : dict
        What the run was asked for beside the method and its parameters.

    Returns
    -------
    dict
        What ``report.json`` holds (docs/report.md).
    """
    scan, result = outcome.scan, outcome.result
    cloud = scan.cloud
    return {
        "schema": SCHEMA_VERSION,
        "input": {**fingerprint(cloud.path), "dropped": cloud.dropped, "faces": cloud.faces},
        "parameters": {
            "method": result.method,
            "asked": result.asked,
            **result.parameters,
            **settings,
        },
        "versions": versions(),
        "normals": "estimated" if scan.estimated else "from the file",
        **figures(outcome),
    }


def write_outcome(
    out: Path, outcome: Outcome, report: dict[str, Any], *, watch: Stopwatch, html: bool
) -> None:
    """Write all files of a run at once, and put the times into its report.

    Parameters
    ----------
    out : Path
    outcome : Outcome
    report : dict
        By :func:`describe`; gets "times".
    watch : Stopwatch
    html : bool
        Write ``report.html`` too.
    """
    with writing_folder(out, outdated=(PAGE,)) as staging:
        with watch("write"):
            write_results(staging, outcome, comments(report))
            if html:
                write_html(staging / PAGE, outcome, report)
        report["times"] = watch.times
        write_report(report, staging / "report.json")


def write_results(folder: Path, outcome: Outcome, lines: list[str]) -> None:
    """Write all files of a run but the report.

    Parameters
    ----------
    folder : Path
    outcome : Outcome
    lines : list of str
        Provenance, for the headers.
    """
    cloud, measured = outcome.scan.cloud, outcome.measured
    worst = worst_near(measured.points, cloud.points, measured.distances)
    top = error_scale(measured.distances)
    if outcome.other is not None:
        write_cloud(Cloud(points=outcome.other), folder / "simplified.ply", comments=lines)
    else:
        indices = outcome.result.indices
        write_cloud(cloud, folder / "simplified.ply", indices=indices, comments=lines)
    write_cloud(
        cloud, folder / "original.ply", comments=lines, extra={"quality": measured.distances}
    )
    write_surface(
        folder / "surface.ply",
        points=measured.points,
        faces=measured.faces,
        quality=worst,
        colors=colorize(worst, low=0, high=top),
        comments=[*lines, f"colour scale: 0 to {top:.6g}, quality in the cloud's unit"],
    )
    write_project(
        folder / "project.mlp",
        {name.removesuffix(".ply"): name for name in ("original.ply", "simplified.ply",
                                                      "surface.ply")},
    )  # fmt: skip


def _counts(mesh: Any) -> dict[str, Any]:
    faces = np.asarray(mesh.face_matrix(), dtype=np.int64).reshape(-1, 3)
    return {
        "points": mesh.vertex_number(),
        "faces": len(faces),
        **edge_defects(faces),
        "compactness": acceptable_share(compactness(mesh.vertex_matrix(), faces)),
    }
