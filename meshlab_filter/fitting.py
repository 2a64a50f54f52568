"""Fitting a rebuilt surface to the original points, of which its vertices are a few."""

from __future__ import annotations

import numpy.typing as npt

from .flips import flip_edges
from .holes import close_holes
from .validation import IntArray


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
    return flip_edges(vertices, close_holes(vertices, faces, points), points)
