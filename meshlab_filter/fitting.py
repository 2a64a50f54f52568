"""Fitting a rebuilt surface to the original points, of which its vertices are a few."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .flaps import border_sides, remove_flaps
from .flips import flip_edges, nearest_vertices
from .holes import close_holes
from .insertion import insert_vertices
from .inversions import turn_inverted
from .peaks import restore_peaks
from .seams import LONGEST, relay_seams
from .validation import FloatArray, IntArray, check_points

#: A surface is mended so often at most, as long as each time its border falls below this share.
_MENDINGS, _WORTH = 3, 0.9


def fit_surface(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    points: npt.ArrayLike,
    *,
    normals: npt.ArrayLike | None = None,
) -> IntArray:
    """Mend a surface where the points say how it should be, and bring it nearer to them.

    The reconstruction knows only the points that stay; the others still say where the surface
    was. Parts that are inside out are turned, flaps go, holes and seams across which points lie are
    closed, vertices without a face are put into the surface, and edges are flipped toward the
    points. No vertex moves or is added.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
    faces : array_like, shape (F, 3), of integers
    points : array_like, shape (N, 3)
        The original points, in the unit of the vertices.
    normals : array_like, shape (V, 3), optional
        Normals of the vertices: with them, parts that are inside out are turned.

    Returns
    -------
    numpy.ndarray, shape (F', 3), int64

    See Also
    --------
    meshlab_filter.inversions.turn_inverted, meshlab_filter.flaps.remove_flaps,
    meshlab_filter.holes.close_holes, meshlab_filter.seams.relay_seams,
    meshlab_filter.insertion.insert_vertices, meshlab_filter.peaks.restore_peaks,
    meshlab_filter.flips.flip_edges

    Examples
    --------
    >>> corners = [[0, 0, 1], [1, 0, 0], [1, 1, 1], [0, 1, 0]]
    >>> fit_surface(corners, [[0, 1, 3], [1, 2, 3]], [[0.5, 0.5, 1.0]]).tolist()
    [[1, 2, 0], [2, 3, 0]]
    """
    corners, cloud = check_points(vertices, name="vertices"), check_points(points)
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    if not len(triangles):
        return triangles
    directions = None if normals is None else check_points(normals, name="normals")
    border = int(border_sides(triangles).sum())
    for _ in range(_MENDINGS):
        triangles = _mend(corners, triangles, cloud, directions)
        before, border = border, int(border_sides(triangles).sum())
        if border == 0 or border > _WORTH * before:
            break
    triangles = flip_edges(corners, insert_vertices(corners, triangles), cloud)
    # Flips open places that were too narrow or too steep for a vertex.
    inserted = restore_peaks(corners, insert_vertices(corners, triangles), cloud)
    return flip_edges(corners, inserted, cloud) if len(inserted) > len(triangles) else triangles


def _mend(
    corners: FloatArray, triangles: IntArray, cloud: FloatArray, normals: FloatArray | None
) -> IntArray:
    """Take away what lies double or inside out and close what is open."""
    if normals is not None:
        triangles = turn_inverted(corners, triangles, normals)
    near = nearest_vertices(corners, triangles, cloud)
    bared = remove_flaps(corners, triangles, cloud, near=near)
    triangles = bared if len(bared) else triangles  # of a few faces, each may cover the others
    triangles = close_holes(corners, triangles, cloud)
    for rings in (1, 2, 1, 2):
        triangles = relay_seams(corners, triangles, cloud, rings=rings, near=near)
    # What is still open there is where two sheets cover the same points.
    return close_holes(corners, triangles, cloud, max_edges=LONGEST, covered=True, bands=True)
