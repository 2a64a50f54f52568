"""Surface first: the points that remain of a surface through all of them."""

from __future__ import annotations

import numpy as np

from .bridge.collapse import collapse
from .bridge.layer import add_layer
from .bridge.session import import_pymeshlab
from .bridge.surface import THROUGH_POINTS, reconstruct
from .errors import InvalidParameterError, MeshLabError
from .measure import Measured, Scan, distances_to
from .simplification import Simplification
from .validation import FloatArray, IntArray

METHOD = "surface-first"


def simplify_surface(
    scan: Scan, count: int, *, surface: str = "ball-pivoting", move: bool = False
) -> tuple[Simplification, Measured]:
    """Build a surface through all points and collapse its edges until ``count`` points stay.

    Parameters
    ----------
    scan : Scan
    count : int
        How many points to keep, at least 4.
    surface : str
        "ball-pivoting" or "ball-pivoting-auto".
    move : bool
        Let MeshLab move points to where the error is least. They are no longer points of the
        cloud then; the simplification names the nearest that are.

    Returns
    -------
    Simplification
        Of the method "surface-first", with ranks 0 and 1.
    Measured
        The collapsed surface and the distances to it.

    Raises
    ------
    InvalidParameterError
        If the surface is of a kind that does not go through the points.
    MeshLabError
        If MeshLab cannot build or collapse the surface.
    """
    if surface not in THROUGH_POINTS:
        raise InvalidParameterError(
            "Invalid surface. Must be ball-pivoting or ball-pivoting-auto when the surface comes "
            f"first. Given: {surface!r}."
        )
    points = scan.cloud.points - scan.origin
    meshset = import_pymeshlab().MeshSet(verbose=False)
    add_layer(meshset, points, normals=scan.normals)
    reconstruction = reconstruct(meshset, surface=surface)
    reconstruction["fitted"] = False
    mesh = meshset.current_mesh()
    if mesh.face_number() == 0:
        raise MeshLabError(f"MeshLab found no triangle through the {len(points)} points.")
    collapse(meshset, count, move=move)
    vertices = np.ascontiguousarray(mesh.vertex_matrix())
    indices = _nearest(points, vertices, exact=not move)
    rank = np.zeros(len(points), dtype=np.int64)
    rank[indices] = 1
    result = Simplification(
        indices=np.flatnonzero(rank),
        rank=rank,
        threshold=1,
        labels=None,
        entropy=None,
        method=METHOD,
        parameters={"move": move},
        asked=count,
    )
    faces = np.asarray(mesh.face_matrix(), dtype=np.int64).reshape(-1, 3)
    measured = Measured(
        points=vertices + scan.origin if move else scan.cloud.points[indices],
        faces=faces,
        distances=distances_to(vertices, faces, points, kept=None if move else indices),
        reconstruction=reconstruction,
    )
    return result, measured


def _nearest(points: FloatArray, vertices: FloatArray, *, exact: bool) -> IntArray:
    from scipy.spatial import cKDTree

    gaps, indices = cKDTree(points).query(vertices, workers=-1)
    if exact and gaps.max() > 0:
        raise MeshLabError(
            f"MeshLab moved {int((gaps > 0).sum())} of {len(vertices)} points while collapsing."
        )
    return np.asarray(indices, dtype=np.int64)
