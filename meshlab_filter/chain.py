"""The whole chain: simplify, rebuild the surface, measure the error, write it all down."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .bridge.distance import distances
from .bridge.layer import add_layer, current_normals
from .bridge.session import import_pymeshlab, load
from .bridge.surface import compute_normals, reconstruct
from .cloud import Cloud, check_readable, read_cloud, write_cloud
from .colormap import colorize
from .errors import InvalidCloudError, MeshLabError, OutputError
from .outputs import writing_folder
from .project import write_project
from .provenance import comments, fingerprint, versions
from .quality import (
    PAPER_CUT,
    acceptable_share,
    compactness,
    covering_radius,
    edge_defects,
    summarise_errors,
)
from .report import SCHEMA_VERSION, write_report
from .simplification import Simplification, check_cloud, simplify
from .stopwatch import Stopwatch
from .surfacefile import write_surface
from .validation import FloatArray, IntArray

#: Called with the name of a stage and the share of it done, None where that is not known.
Progress = Callable[[str, "float | None"], object]

FILES = ("simplified.ply", "surface.ply", "original.ply", "project.mlp", "report.json")


@dataclass(frozen=True, kw_only=True)
class Measured:
    """A surface and how far the original points are from it.

    Attributes
    ----------
    points, faces : numpy.ndarray, shapes (V, 3) and (F, 3)
        The surface; for ball pivoting its points are the cloud's, in the same order.
    distances : numpy.ndarray, shape (N,), float64
        Of every original point, in the cloud's unit.
    reconstruction : dict
        Kind of surface, spacing and radii.
    """

    points: FloatArray
    faces: IntArray
    distances: FloatArray
    reconstruction: dict[str, Any]


def run(
    path: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    method: str | None = None,
    count: int | None = None,
    keep: float | None = None,
    seed: int = 0,
    surface: str = "ball-pivoting",
    floor: bool = True,
    drop_invalid: bool = False,
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
    floor : bool
        Measure the same chain on the untouched cloud as well: the error that is not due to the
        simplification.
    drop_invalid : bool
        Leave out points with NaN or infinite coordinates instead of refusing the file.
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
    tell = progress or (lambda stage, share: None)
    watch = Stopwatch(lambda stage: tell(stage, None))
    path, out = check_readable(path), Path(out)
    if out.exists() and any(
        (out / name).exists() and (out / name).samefile(path) for name in FILES
    ):
        raise OutputError(f"An output would replace the input. Given: {path} and {out}.")
    with watch("read"):
        cloud = read_cloud(path, drop_invalid=drop_invalid)
        check_cloud(cloud.points)
        origin = (cloud.points.min(axis=0) + cloud.points.max(axis=0)) / 2
    with watch("normals"):
        normals, estimated = _normals(cloud, origin)
    with watch("simplify"):
        result = simplify(
            cloud.points,
            method=method,
            normals=normals,
            count=count,
            keep=keep,
            seed=seed,
            progress=lambda share: tell("simplify", share),
            **parameters,
        )
    with watch("surface and error"):
        measured = _measure(cloud.points, normals, result.indices, surface, origin)
    base = None
    if floor and surface != "none":
        with watch("floor"):
            everything = np.arange(len(cloud.points))
            base = _measure(cloud.points, normals, everything, surface, origin)
    report = _figures(cloud, result, measured, base)
    report = {
        "schema": SCHEMA_VERSION,
        "input": {**fingerprint(path), "dropped": cloud.dropped, "faces": cloud.faces},
        "parameters": {
            "method": result.method,
            "asked": result.asked,
            **result.parameters,
            "surface": surface,
            "drop_invalid": drop_invalid,
        },
        "versions": versions(),
        "normals": "estimated" if estimated else "from the file",
        **report,
    }
    lines = comments(report)
    with writing_folder(out) as staging:
        with watch("write"):
            _write(staging, cloud, result, measured, lines)
        report["times"] = watch.times
        write_report(report, staging / "report.json")
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
        faces = None
        if cloud.faces:
            load(meshset, cloud.path)
            faces = meshset.current_mesh().face_matrix()
            points = meshset.current_mesh().vertex_matrix()
            meshset.delete_current_mesh()
        else:
            points = cloud.points
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
        "error": _errors(distances(meshset, ids[0], ids[1]), diagonal),
        "backward": _errors(distances(meshset, ids[1], ids[0]), diagonal),
        "versions": versions(),
    }


def _normals(cloud: Cloud, origin: FloatArray) -> tuple[FloatArray, bool]:
    """Return the cloud's normals, or MeshLab's estimate where it has none, and whether it had."""
    if cloud.normals is not None and np.isfinite(cloud.normals).all():
        lengths = np.linalg.norm(cloud.normals, axis=1)
        if (lengths > 0).all():
            return cloud.normals / lengths[:, None], False
    meshset = import_pymeshlab().MeshSet(verbose=False)
    add_layer(meshset, cloud.points - origin)
    compute_normals(meshset)
    normals = current_normals(meshset)
    if normals is None:
        from .normals import estimate_normals

        normals = estimate_normals(cloud.points)
    return normals, True


def _measure(
    points: FloatArray, normals: FloatArray, kept: IntArray, surface: str, origin: FloatArray
) -> Measured:
    """Rebuild a surface through some of the points and measure all of them against it."""
    meshset = import_pymeshlab().MeshSet(verbose=False)
    # MeshLab computes partly in single precision: near the origin nothing is lost.
    add_layer(meshset, points - origin, name="original")
    original = meshset.current_mesh_id()
    add_layer(meshset, points[kept] - origin, normals=normals[kept], name="surface")
    reconstruction = reconstruct(meshset, surface=surface)
    mesh = meshset.current_mesh()
    if surface != "none" and mesh.face_number() == 0:
        raise MeshLabError(
            f"MeshLab found no triangle through the {len(kept)} points; they may be too few or "
            "lie on a line (use --surface none to measure against the points themselves)."
        )
    vertices = points[kept] if surface != "screened-poisson" else mesh.vertex_matrix() + origin
    faces = np.asarray(mesh.face_matrix(), dtype=np.int64).reshape(-1, 3)
    return Measured(
        points=vertices,
        faces=faces,
        distances=distances(meshset, original, mesh.id()),
        reconstruction=reconstruction,
    )


def _errors(found: FloatArray, diagonal: float) -> dict[str, Any]:
    return {
        "uncut": summarise_errors(found, diagonal=diagonal),
        "cut": summarise_errors(found, diagonal=diagonal, cut=PAPER_CUT),
    }


def _figures(
    cloud: Cloud, result: Simplification, measured: Measured, base: Measured | None
) -> dict[str, Any]:
    """Gather what the report says about the outcome."""
    diagonal = cloud.diagonal
    kept = cloud.points[result.indices]
    clusters = len(result.entropy) if result.entropy is not None else None
    before = None
    error: dict[str, Any] = _errors(measured.distances, diagonal)
    error["floor"] = None
    if base is not None:
        error["floor"] = summarise_errors(base.distances, diagonal=diagonal)
        error["floor_cut"] = summarise_errors(base.distances, diagonal=diagonal, cut=PAPER_CUT)
        before = acceptable_share(compactness(base.points, base.faces))
    return {
        "diagonal": diagonal,
        "points": {
            "original": len(cloud.points),
            "simplified": len(kept),
            "removed": len(cloud.points) - len(kept),
            "missed": result.missed,
            "covering_radius": covering_radius(cloud.points, kept) / diagonal,
        },
        "clusters": {
            "total": clusters,
            "deleted": result.threshold if clusters is not None else None,
        },
        "surface": {
            **measured.reconstruction,
            "vertices": len(measured.points),
            "faces": len(measured.faces),
            **edge_defects(measured.faces),
            "compactness": acceptable_share(compactness(measured.points, measured.faces)),
            "compactness_before": before,
        },
        "error": error,
        "method_info": result.info,
    }


def _write(
    folder: Path,
    cloud: Cloud,
    result: Simplification,
    measured: Measured,
    lines: list[str],
) -> None:
    from scipy.spatial import cKDTree

    _, nearest = cKDTree(measured.points).query(cloud.points, workers=-1)
    worst = np.zeros(len(measured.points))
    np.maximum.at(worst, nearest, measured.distances)
    top = float(np.percentile(measured.distances, 99)) or float(measured.distances.max())
    write_cloud(cloud, folder / "simplified.ply", indices=result.indices, comments=lines)
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
