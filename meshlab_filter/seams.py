"""Seams of a rebuilt surface: borders that no closing of single holes removes.

Two borders run along each other, a hole has a flap in it, or every triangulation of a hole repeats
an edge. Taken out with the faces around it, such a place becomes a simple hole.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .edges import edge_keys, sides
from .flaps import border_sides
from .flips import nearest_faces, nearest_vertices
from .holes import close_holes
from .validation import FloatArray, IntArray, check_points

#: Holes made so may be this long.
LONGEST = 160
#: How far, as a share of the edges, the points may be from the faces laid anew (RMS).
_FARTHEST = 0.3


def relay_seams(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    points: npt.ArrayLike,
    *,
    rings: int = 1,
    near: IntArray | None = None,
) -> IntArray:
    """Lay the faces around borders anew, where that leaves less than half of the border.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
    faces : array_like, shape (F, 3), of integers
    points : array_like, shape (N, 3)
        The original points, in the unit of the vertices.
    rings : int
        How many rings of faces about the border are taken out.
    near : numpy.ndarray, shape (N, k), int64, optional
        What :func:`~meshlab_filter.flips.nearest_vertices` says of these points, if that is known
        already.

    Returns
    -------
    numpy.ndarray, shape (F', 3), int64
        Vertices may have lost their last face.

    Notes
    -----
    The border of an open scan stays: no points lie across it, so that nothing would close what is
    taken out there, and what was there is put back.

    Examples
    --------
    A slit in the middle of a sheet, as wide as nothing, is sewn up; the border around stays:

    >>> x, y = (a.ravel() for a in np.meshgrid(np.arange(9.0), np.arange(9.0)))
    >>> grid = np.column_stack([x, y, 0 * x])
    >>> cells = [i for i in range(72) if i % 9 < 8]
    >>> faces = np.array([f for i in cells for f in ([i, i + 1, i + 10], [i, i + 10, i + 9])])
    >>> slit = np.vstack([grid, grid[40] + [0, 0.1, 0]])  # vertex 40, once more above
    >>> faces[(faces.max(axis=1) > 44)] = np.where(faces == 40, 81, faces)[faces.max(axis=1) > 44]
    >>> int(border_sides(faces).sum()), int(border_sides(relay_seams(slit, faces, grid)).sum())
    (36, 32)
    """
    corners = check_points(vertices, name="vertices")
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    cloud = check_points(points)
    border = border_sides(triangles)
    if not border.any():
        return triangles
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2)
    out = np.isin(triangles, np.unique(ends[border])).any(axis=1)
    for _ in range(rings - 1):
        out = np.isin(triangles, triangles[out]).any(axis=1)
    taken, rest = triangles[out], triangles[~out]
    if not len(rest):
        return triangles
    place, places = _places(taken, len(corners))
    if near is None:
        near = nearest_vertices(corners, triangles, cloud)
    closed = close_holes(corners, rest, cloud, max_edges=LONGEST, bands=True)
    new = closed[len(rest) :]
    # Each vertex taken out belongs to one place, each new face to that of its vertices.
    of_vertex = np.full(len(corners), -1, dtype=np.int64)
    of_vertex[taken.ravel()] = np.repeat(place, 3)
    of_new = of_vertex[new].max(axis=1) if len(new) else np.empty(0, dtype=np.int64)

    def border_of(mesh: IntArray) -> IntArray:
        where = of_vertex[mesh[border_sides(mesh)]]
        return np.bincount(where[where >= 0], minlength=places)

    better = 2 * border_of(closed) <= border_of(triangles)
    better &= _is_near(corners, taken, place, closed, cloud, near, of_vertex, places)
    while True:
        mesh = np.vstack([rest, taken[~better[place]], new[better[of_new]]])
        # What is put back in one place may have an edge that a new face in another has, too.
        keys = edge_keys(*sides(mesh), len(corners))
        _, place_of, count = np.unique(keys, return_inverse=True, return_counts=True)
        crowded = np.asarray(count[place_of.ravel()] > 2).reshape(-1, 3)
        many = np.asarray(crowded.any(axis=1))[len(mesh) - int(better[of_new].sum()) :]
        if not many.any():
            return mesh
        better[of_new[better[of_new]][many]] = False


def _places(faces: IntArray, vertices: int) -> tuple[IntArray, int]:
    """Return the place of each face, where faces hang together be it in a vertex, and how many."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    rows = np.repeat(np.arange(len(faces)), 3)
    shape = (len(faces), vertices)
    corner = coo_matrix((np.ones(len(rows)), (rows, faces.ravel())), shape=shape).tocsr()
    count, place = connected_components(corner @ corner.T, directed=False)
    return place.astype(np.int64), int(count)


def _is_near(
    vertices: FloatArray,
    taken: IntArray,
    place: IntArray,
    closed: IntArray,
    points: FloatArray,
    near: IntArray,
    of_vertex: IntArray,
    places: int,
) -> npt.NDArray[np.bool_]:
    """Tell of each place whether the points there are near to the faces that are there now."""
    which = of_vertex[near[:, 0]]
    rows = np.flatnonzero(which >= 0)
    _, gap = nearest_faces(vertices, closed, points[rows])
    where = np.bincount(which[rows], minlength=places)
    mean = np.bincount(which[rows], weights=gap, minlength=places) / np.maximum(where, 1)
    square = np.sum((vertices[taken] - vertices[np.roll(taken, -1, axis=1)]) ** 2, axis=2)
    total = np.bincount(place, weights=square.mean(axis=1), minlength=places)
    edge = total / np.maximum(np.bincount(place, minlength=places), 1)
    return np.asarray(mean <= _FARTHEST**2 * edge)
