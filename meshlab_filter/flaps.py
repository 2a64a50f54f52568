"""Flaps of a rebuilt surface: sheets that lie on another sheet of it and end there.

Where the spacing of the points changes quickly, ball pivoting covers some places twice: one ball
rolls over points that another reaches later from the side. The second sheet hangs on the border of
the first and adds nothing but a border of its own.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .edges import are_among, edge_keys, sides
from .flips import faces_around, nearest_faces, nearest_vertices
from .orientation import pieces_of
from .triangles import squared_distances
from .validation import FloatArray, IntArray, check_points

#: A face goes if the points on it are this much nearer to another sheet than to the faces beside
#: it: the mean square over the mean square.
_COVERED = 0.25
_NEIGHBOURS = 6
#: Pieces of so few faces may be scraps.
_SCRAP = 50


def remove_flaps(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    points: npt.ArrayLike,
    *,
    near: IntArray | None = None,
    max_rounds: int = 40,
) -> IntArray:
    """Remove faces at a border that lie on other faces, and scraps beside a larger piece.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
    faces : array_like, shape (F, 3), of integers
    points : array_like, shape (N, 3)
        The original points, in the unit of the vertices.
    near : numpy.ndarray, shape (N, k), int64, optional
        What :func:`~meshlab_filter.flips.nearest_vertices` says of these points, if that is known
        already.
    max_rounds : int
        In each round the faces that are at the border by then are looked at.

    Returns
    -------
    numpy.ndarray, shape (F − removed, 3), int64
        The other faces, in the same order.

    Notes
    -----
    A face is tried with the points nearest to it and its own centre. It is covered if these lie
    so near to faces other than itself and those beside it that the sum of squared distances is at
    most a quarter of that to its sides: a second wall of a thin sheet is not, as long as it is
    further away than some eighth of an edge.

    Examples
    --------
    Of a sheet of eight triangles and one that lies on two of them, the latter goes:

    >>> x, y = (a.ravel() for a in np.meshgrid(np.arange(3.0), np.arange(3.0)))
    >>> grid = np.column_stack([x, y, 0 * x])
    >>> sheet = [f for i in (0, 1, 3, 4) for f in ([i, i + 1, i + 4], [i, i + 4, i + 3])]
    >>> flap = [[0.8, 0.1, 0.02], [1.9, 0.5, 0.02], [1.1, 0.8, 0.02]]
    >>> len(remove_flaps(np.vstack([grid, flap]), [*sheet, [9, 10, 11]], grid))
    8
    """
    corners = check_points(vertices, name="vertices")
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    cloud = check_points(points)
    suspects = np.flatnonzero(border_sides(triangles).any(axis=1))
    if not len(suspects):
        return triangles
    rim = np.unique(triangles[np.isin(triangles, triangles[suspects]).any(axis=1)])
    if near is None:
        near = nearest_vertices(corners, triangles, cloud)
    witnesses = cloud[np.isin(near, rim).any(axis=1)]
    suspect = np.zeros(len(triangles), dtype=bool)
    suspect[suspects] = True
    for _ in range(max_rounds):
        if not suspect.any():
            break
        covered = _covered(corners, triangles, witnesses, np.flatnonzero(suspect))
        if not len(covered):
            break
        gone = np.zeros(len(triangles), dtype=bool)
        gone[covered] = True
        # Those beside are at the border now; the others have been looked at.
        keys = edge_keys(*sides(triangles), len(corners)).reshape(-1, 3)
        beside = are_among(keys, np.sort(keys[gone], axis=None)).any(axis=1)
        triangles, suspect = triangles[~gone], np.asarray(beside)[~gone]
    return _without_scraps(corners, triangles)


def _without_scraps(vertices: FloatArray, faces: IntArray) -> IntArray:
    """Leave out small pieces that lie beside others, no further than an edge is long.

    Their borders would be closed by their own backs.
    """
    if not len(faces):
        return faces
    piece, pieces = pieces_of(faces)
    small = (np.bincount(piece, minlength=pieces) <= _SCRAP)[piece]
    if not small.any() or small.all():
        return faces
    scraps, rest = faces[small], faces[~small]
    ends = vertices[scraps]
    square = np.sum((ends - np.roll(ends, 1, axis=1)) ** 2, axis=(1, 2)) / 3
    _, gap = nearest_faces(vertices, rest, ends.reshape(-1, 3))
    near = np.sqrt(gap).reshape(-1, 3).max(axis=1)
    farthest = np.zeros(pieces)
    np.maximum.at(farthest, piece[small], near)
    edge = np.sqrt(np.bincount(piece[small], weights=square, minlength=pieces))
    edge /= np.sqrt(np.maximum(np.bincount(piece[small], minlength=pieces), 1))
    stays = ~small | (farthest > edge)[piece]
    return faces[stays]


def border_sides(faces: IntArray) -> npt.NDArray[np.bool_]:
    """Tell which sides of faces no other face shares.

    Parameters
    ----------
    faces : numpy.ndarray, shape (F, 3), int64

    Returns
    -------
    numpy.ndarray, shape (F, 3), bool
        Of the sides from each corner to the next.

    Examples
    --------
    >>> border_sides(np.array([[0, 1, 2], [0, 2, 3]])).tolist()
    [[True, True, False], [False, True, True]]
    """
    if not len(faces):
        return np.empty((0, 3), dtype=bool)
    keys = edge_keys(*sides(faces), int(faces.max()) + 1)
    _, place, count = np.unique(keys, return_inverse=True, return_counts=True)
    return np.asarray(count[place.ravel()] == 1).reshape(-1, 3)


def _covered(
    vertices: FloatArray, faces: IntArray, points: FloatArray, suspects: IntArray
) -> IntArray:
    """Return which of the suspected faces other faces cover."""
    suspect = np.zeros(len(faces), dtype=bool)
    suspect[suspects] = True
    home, _ = nearest_faces(vertices, faces, points)
    there = suspect[home]
    where = np.vstack([points[there], vertices[faces[suspects]].mean(axis=1)])
    home = np.concatenate([home[there], suspects])
    near = nearest_vertices(vertices, faces, where, neighbours=_NEIGHBOURS)
    rows, tried = faces_around(faces, near, len(vertices))
    other = tried != home[rows]
    rows, tried = rows[other], tried[other]
    found = squared_distances(where[rows], *(vertices[faces[tried, i]] for i in range(3)))
    second = np.full(len(where), np.inf)
    np.minimum.at(second, rows, found)
    alone = border_sides(faces)[home]
    beside = np.full(len(where), np.inf)
    for i in range(3):
        one, two = vertices[faces[home, i]], vertices[faces[home, (i + 1) % 3]]
        along = squared_distances(where, one, two, two)
        beside = np.where(alone[:, i], beside, np.minimum(beside, along))
    # A lone triangle has nothing beside it: then its corners stand for it.
    lone = np.flatnonzero(alone.all(axis=1))
    beside[lone] = np.sum((where[lone] - vertices[faces[home[lone], 0]]) ** 2, axis=1)
    size = len(faces)
    away = np.bincount(home, weights=np.minimum(second, _FAR), minlength=size)
    limit = _COVERED * np.bincount(home, weights=beside, minlength=size)
    return suspects[away[suspects] <= limit[suspects]]


_FAR = 1e300
