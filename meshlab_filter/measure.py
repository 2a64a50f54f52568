"""Rebuilding a surface through what is left of a cloud and measuring the cloud against it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .bridge.distance import distances
from .bridge.layer import add_layer, current_normals
from .bridge.session import import_pymeshlab
from .bridge.surface import THROUGH_POINTS, compute_normals, reconstruct, seed_order
from .cloud import Cloud, read_cloud
from .errors import MeshLabError
from .fitting import fit_surface
from .quality import (
    PAPER_CUT,
    acceptable_share,
    compactness,
    covering_radius,
    edge_defects,
    summarise_errors,
)
from .simplification import Simplification, check_cloud
from .stopwatch import Stopwatch
from .validation import FloatArray, IntArray


@dataclass(frozen=True, kw_only=True)
class Scan:
    """A cloud that is ready to be simplified and measured.

    Attributes
    ----------
    cloud : Cloud
    origin : numpy.ndarray, shape (3,), float64
        Centre of the bounding box. MeshLab computes partly in single precision: with the origin
        taken off, nothing is lost.
    normals : numpy.ndarray, shape (N, 3), float64
        Unit normals.
    estimated : bool
        Whether MeshLab estimated the normals because the file has none.
    """

    cloud: Cloud
    origin: FloatArray
    normals: FloatArray
    estimated: bool


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


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What a run found, for those who write it down.

    Attributes
    ----------
    scan : Scan
    result : Simplification
    measured : Measured
        The surface of what is left.
    base : Measured or None
        The same chain on the untouched cloud: the floor.
    other : numpy.ndarray, shape (M, 3), or None
        What is left of the cloud, if it is other points than the cloud's own.
    """

    scan: Scan
    result: Simplification
    measured: Measured
    base: Measured | None
    other: FloatArray | None = None

    @property
    def kept(self) -> FloatArray:
        """The points that are left, shape (M, 3)."""
        if self.other is not None:
            return self.other
        return self.scan.cloud.points[self.result.indices]


def prepare(path: Path, *, drop_invalid: bool, watch: Stopwatch) -> Scan:
    """Read a cloud and give it normals.

    Parameters
    ----------
    path : Path
    drop_invalid : bool
        Leave out points with NaN or infinite coordinates instead of refusing the file.
    watch : Stopwatch
        Times the stages "read" and "normals".

    Returns
    -------
    Scan

    Raises
    ------
    MeshlabFilterError
        A subclass, if the file cannot be read or its points cannot be worked on.
    """
    with watch("read"):
        cloud = read_cloud(path, drop_invalid=drop_invalid)
        check_cloud(cloud.points)
        origin = (cloud.points.min(axis=0) + cloud.points.max(axis=0)) / 2
    with watch("normals"):
        normals, estimated = _normals(cloud, origin)
    return Scan(cloud=cloud, origin=origin, normals=normals, estimated=estimated)


def measure(scan: Scan, kept: IntArray, *, surface: str, fit: bool = False) -> Measured:
    """Rebuild a surface through some of the points and measure all of them against it.

    Parameters
    ----------
    scan : Scan
    kept : numpy.ndarray, shape (M,), int64
        Indices of the points the surface goes through.
    surface : str
        As in :func:`meshlab_filter.bridge.surface.reconstruct`.
    fit : bool
        Fit the surface to the original points (:func:`meshlab_filter.fitting.fit_surface`); only
        where it goes through the points that stay.

    Returns
    -------
    Measured

    Raises
    ------
    MeshLabError
        If MeshLab found no triangle.
    """
    points, origin = scan.cloud.points - scan.origin, scan.origin
    vertices, faces, reconstruction = rebuild(
        points[kept], scan.normals[kept], points, surface=surface, fit=fit
    )
    own = surface != "screened-poisson"
    return Measured(
        points=scan.cloud.points[kept] if own else vertices + origin,
        faces=faces,
        distances=distances_to(vertices, faces, points, kept=kept if own else None),
        reconstruction=reconstruction,
    )


def rebuild(
    kept: FloatArray,
    normals: FloatArray,
    points: FloatArray,
    *,
    surface: str = "ball-pivoting",
    passes: Sequence[float] | None = None,
    radii: Sequence[float] | None = None,
    fit: bool = True,
) -> tuple[FloatArray, IntArray, dict[str, Any]]:
    """Rebuild a surface through some points and fit it to all of them.

    Parameters
    ----------
    kept, normals : numpy.ndarray, shape (M, 3)
        Points for the surface to go through and their normals.
    points : numpy.ndarray, shape (N, 3)
        The original points, in the unit of the others.
    surface, passes, radii
        As in :func:`meshlab_filter.bridge.surface.reconstruct`.
    fit : bool
        Fit the surface to the points (:func:`meshlab_filter.fitting.fit_surface`); only where it
        goes through the points that stay and these are not all.

    Returns
    -------
    vertices, faces : numpy.ndarray, shapes (V, 3) and (F, 3)
        For all but "screened-poisson" the vertices are the points kept, in their order.
    reconstruction : dict
        Kind of surface, spacing, radii, and whether it was fitted.

    Raises
    ------
    MeshLabError
        If MeshLab found no triangle.
    """
    # With every point a vertex there is nothing to fit to.
    fit = fit and surface in THROUGH_POINTS and len(kept) < len(points)
    order = seed_order(kept) if fit else np.arange(len(kept))
    meshset = import_pymeshlab().MeshSet(verbose=False)
    add_layer(meshset, kept[order], normals=normals[order])
    reconstruction = reconstruct(meshset, surface=surface, passes=passes, radii=radii, coherent=fit)
    mesh = meshset.current_mesh()
    if surface != "none" and mesh.face_number() == 0:
        raise MeshLabError(
            f"MeshLab found no triangle through the {len(kept)} points; they may be too few or "
            "lie on a line (use --surface none to measure against the points themselves)."
        )
    faces = np.asarray(mesh.face_matrix(), dtype=np.int64).reshape(-1, 3)
    if surface == "screened-poisson":
        kept = mesh.vertex_matrix()
    else:
        faces = order[faces]
    if fit:
        faces = fit_surface(kept, faces, points, normals=normals)
    return kept, faces, {**reconstruction, "fitted": fit}


def distances_to(
    vertices: FloatArray, faces: IntArray, points: FloatArray, *, kept: IntArray | None = None
) -> FloatArray:
    """Return how far points are from a surface, by MeshLab.

    Parameters
    ----------
    vertices, faces : numpy.ndarray, shapes (V, 3) and (F, 3)
        The surface; without faces, its vertices are taken.
    points : numpy.ndarray, shape (N, 3)
        In the unit of the vertices.
    kept : numpy.ndarray, shape (V,), int64, optional
        Which of the points the vertices are. Corners of the surface lie on it, so that MeshLab is
        asked only for the other points.

    Returns
    -------
    numpy.ndarray, shape (N,), float64

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> points = np.vstack([corners, [[0.2, 0.2, 3]]])
    >>> distances_to(corners, np.array([[0, 1, 2]]), points, kept=np.arange(3))
    array([0., 0., 0., 3.])
    """
    away = np.ones(len(points), dtype=bool)
    if kept is not None:
        away[kept[np.unique(faces)] if len(faces) else kept] = False
    found = np.zeros(len(points))
    if away.any():
        meshset = import_pymeshlab().MeshSet(verbose=False)
        add_layer(meshset, points[away])
        add_layer(meshset, vertices, faces=faces if len(faces) else None)
        found[away] = distances(meshset, 0, 1)
    return found


def worst_near(points: FloatArray, cloud: FloatArray, found: FloatArray) -> FloatArray:
    """Return, for each of some points, the largest distance of those cloud points nearest to it.

    Parameters
    ----------
    points : numpy.ndarray, shape (M, 3)
    cloud : numpy.ndarray, shape (N, 3)
    found : numpy.ndarray, shape (N,)
        The distance of each point of the cloud to the surface.

    Returns
    -------
    numpy.ndarray, shape (M,), float64
        0 where no point of the cloud is nearest.

    Examples
    --------
    >>> cloud = np.array([[0.0, 0, 0], [1, 0, 0], [9, 0, 0]])
    >>> worst_near(cloud[[0, 2]], cloud, np.array([0.0, 0.5, 0.0]))
    array([0.5, 0. ])
    """
    from scipy.spatial import cKDTree

    worst = np.zeros(len(points))
    away = found > 0
    _, nearest = cKDTree(points).query(cloud[away], workers=-1)
    np.maximum.at(worst, nearest, found[away])
    return worst


def error_scale(found: FloatArray) -> float:
    """Return where the colour scale of distances ends: their 99th percentile, if that is not 0.

    Examples
    --------
    >>> error_scale(np.array([0.0, 0.0, 0.5]))
    0.49
    """
    return float(np.percentile(found, 99)) or float(found.max())


def errors(found: FloatArray, diagonal: float) -> dict[str, Any]:
    """Summarise distances twice: all of them, and cut at 1 % of the diagonal as in the paper.

    Parameters
    ----------
    found : numpy.ndarray, shape (N,)
        In the cloud's unit.
    diagonal : float
        Of the original cloud's bounding box, in the same unit.

    Returns
    -------
    dict
        "uncut" and "cut", each by :func:`meshlab_filter.quality.summarise_errors`.
    """
    return {
        "uncut": summarise_errors(found, diagonal=diagonal),
        "cut": summarise_errors(found, diagonal=diagonal, cut=PAPER_CUT),
    }


def figures(outcome: Outcome) -> dict[str, Any]:
    """Gather what the report says about the outcome (docs/report.md)."""
    cloud, result = outcome.scan.cloud, outcome.result
    measured, base = outcome.measured, outcome.base
    diagonal = cloud.diagonal
    kept = outcome.kept
    clusters = len(result.entropy) if result.entropy is not None else None
    before = None
    error: dict[str, Any] = errors(measured.distances, diagonal)
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
            "threshold": result.threshold,
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
