"""Fitting a rebuilt surface to the original points, of which its vertices are a few."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .flips import flip_edges, nearest_vertices
from .holes import close_holes
from .validation import IntArray, check_points


def fit_surface(vertices: npt.ArrayLike, faces: npt.ArrayLike, points: npt.ArrayLike) -> IntArray:
    """Close the holes that the points lie across, then flip edges toward the points.

    The reconstruction knows only the points that stay; the others still say where the surface
    was. No vertex moves or is added.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
    faces : array_like, shape (F, 3), of integers
    points : array_like, shape (N, 3)
        The original points, in the unit of the vertices.

    Returns
    -------
    numpy.ndarray, shape (F + new, 3), int64

    See Also
    --------
    meshlab_filter.holes.close_holes, meshlab_filter.flips.flip_edges

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
    # New faces go between corners of old ones, so the nearest corners stay the same.
    near = nearest_vertices(corners, triangles, cloud)
    closed = close_holes(corners, triangles, cloud, near=near)
    return flip_edges(corners, closed, cloud, near=near)
