"""Edge flips that bring a surface nearer to the points it was made from.

Ball pivoting joins the points that stay without knowing of those that went. Between two triangles
the other diagonal may lie nearer to the original points; it is taken where their sum of squared
distances falls.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .edges import are_among, corners_of, edge_keys, sides
from .triangles import squared_distances
from .validation import FloatArray, IntArray, check_points

#: A flip must lower the sum of squares by this share of the mean squared edge, so that rounding
#: decides nothing.
_LEAST_GAIN = 1e-9
#: Cosine between a new triangle and the two it replaces, below which the surface would fold.
_LEAST_COSINE = -0.3
#: Pairs of point and triangle that are worked on at once: what fits the processor's cache.
_BLOCK = 50_000


def flip_edges(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    points: npt.ArrayLike,
    *,
    near: IntArray | None = None,
    max_rounds: int = 30,
) -> IntArray:
    """Flip edges of a triangle mesh until no flip brings it nearer to the points.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
    faces : array_like, shape (F, 3), of integers
    points : array_like, shape (N, 3)
        The original points, in the unit of the vertices.
    near : numpy.ndarray, shape (N, k), int64, optional
        What :func:`nearest_vertices` says of these points, if that is known already.
    max_rounds : int
        In each round all flips that do not touch each other are done at once.

    Returns
    -------
    numpy.ndarray, shape (F, 3), int64
        The faces, in the same order of places and with the same orientation.

    Notes
    -----
    Edges at a border, edges of more than two faces and edges whose faces disagree in orientation
    stay. A point counts for the triangle it is nearest to; ties and equal gains go to the lower
    index, so the result does not depend on the machine.

    Examples
    --------
    A ridge runs from corner 0 to corner 2, and a point on it says so:

    >>> corners = [[0, 0, 1], [1, 0, 0], [1, 1, 1], [0, 1, 0]]
    >>> flip_edges(corners, [[0, 1, 3], [1, 2, 3]], [[0.5, 0.5, 1.0]]).tolist()
    [[1, 2, 0], [2, 3, 0]]
    """
    corners = check_points(vertices, name="vertices")
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    witnesses = check_points(points)
    if not len(triangles):
        return triangles
    home, _ = nearest_faces(corners, triangles, witnesses, near=near)
    tail, head = sides(triangles)
    squares = np.sum((corners[head] - corners[tail]) ** 2, axis=1)
    least = _LEAST_GAIN * float(np.mean(squares))
    changed = np.ones(len(triangles), dtype=bool)
    for _ in range(max_rounds):
        quads = _quads(triangles)
        quads = quads.take(changed[quads.left] | changed[quads.right])
        quads = quads.take(_may_flip(quads, corners, triangles))
        gain = _gains(quads, corners, witnesses, home, len(triangles))
        chosen = _independent(quads, gain, least, len(triangles))
        changed = np.zeros(len(triangles), dtype=bool)
        if not chosen.any():
            break
        done = quads.take(chosen)
        triangles[done.left] = np.column_stack([done.a, done.d, done.c])
        triangles[done.right] = np.column_stack([done.d, done.b, done.c])
        changed[done.left] = changed[done.right] = True
        _rehome(done, corners, witnesses, home, len(triangles))
    return triangles


@dataclass(frozen=True)
class _Quads:
    """Pairs of faces across an edge a–b: left is (a, b, c), right is (b, a, d)."""

    a: IntArray
    b: IntArray
    c: IntArray
    d: IntArray
    left: IntArray
    right: IntArray

    def take(self, chosen: npt.NDArray[np.bool_]) -> _Quads:
        return _Quads(*(getattr(self, name)[chosen] for name in self.__dataclass_fields__))


def nearest_vertices(
    vertices: FloatArray, faces: IntArray, points: FloatArray, *, neighbours: int = 4
) -> IntArray:
    """Return for each point the nearest of the vertices that are corners, nearest first.

    Parameters
    ----------
    vertices, faces : numpy.ndarray, shapes (V, 3) and (F, 3)
    points : numpy.ndarray, shape (N, 3)
    neighbours : int
        How many; as many as there are, for smaller meshes.

    Returns
    -------
    numpy.ndarray, shape (N, k), int64
    """
    from scipy.spatial import cKDTree

    used = corners_of(faces)
    count = min(neighbours, len(used))
    # Ranks, not a number: for one neighbour, too, the answer has a column for each.
    found = cKDTree(vertices[used]).query(points, k=np.arange(1, count + 1), workers=-1)[1]
    return np.asarray(used[found])


def nearest_faces(
    vertices: FloatArray,
    faces: IntArray,
    points: FloatArray,
    *,
    near: IntArray | None = None,
    neighbours: int = 3,
) -> tuple[IntArray, FloatArray]:
    """Return for each point a face that is nearer than all beside it.

    The search begins with the faces around the nearest vertices and walks across sides; in meshes
    of very long triangles it may miss the nearest of all.

    Parameters
    ----------
    vertices, faces : numpy.ndarray, shapes (V, 3) and (F, 3)
    points : numpy.ndarray, shape (N, 3)
    near : numpy.ndarray, shape (N, k), int64, optional
        What :func:`nearest_vertices` says of these points, if that is known already.
    neighbours : int
        How many of the nearest vertices have their faces tried.

    Returns
    -------
    face : numpy.ndarray, shape (N,), int64
    gap : numpy.ndarray, shape (N,), float64
        Squared distance to it.
    """
    if not len(points):
        return np.empty(0, dtype=np.int64), np.empty(0)
    if near is None:
        near = nearest_vertices(vertices, faces, points, neighbours=neighbours)
    near = near[:, :neighbours]
    home = np.full(len(points), -1, dtype=np.int64)
    gap = np.full(len(points), np.inf)
    block = max(1, _BLOCK // (6 * near.shape[1]))
    incidence = _incidence(faces, len(vertices))
    for first in range(0, len(points), block):
        rows = near[first : first + block]
        owner, tried = _around(incidence, rows)
        found = squared_distances(
            points[first + owner], *(vertices[faces[tried, corner]] for corner in range(3))
        )
        best = np.lexsort((tried, found, owner))
        _, first_of = np.unique(owner[best], return_index=True)
        home[first : first + len(rows)] = tried[best][first_of]
        gap[first : first + len(rows)] = found[best][first_of]
    _walk(vertices, faces, points, home, gap)
    return home, gap


def faces_around(faces: IntArray, near: IntArray, vertices: int) -> tuple[IntArray, IntArray]:
    """List the faces at some vertices of each point, as pairs.

    Parameters
    ----------
    faces : numpy.ndarray, shape (F, 3), int64
    near : numpy.ndarray, shape (N, k), int64
        Vertices, a row for each point.
    vertices : int
        How many vertices there are.

    Returns
    -------
    row, face : numpy.ndarray, shape (P,), int64
        A face that has several of a row's vertices comes as often.

    Examples
    --------
    >>> fan = np.array([[0, 1, 2], [0, 2, 3]])
    >>> [pair.tolist() for pair in faces_around(fan, np.array([[1], [2]]), 4)]
    [[0, 1, 1], [0, 0, 1]]
    """
    return _around(_incidence(faces, vertices), near)


def _incidence(faces: IntArray, vertices: int) -> tuple[IntArray, IntArray]:
    """Return the places of corners in ``faces.ravel()``, by vertex, and where each begins."""
    order = np.argsort(faces.ravel(), kind="stable")
    return order, np.searchsorted(faces.ravel()[order], np.arange(vertices + 1))


def _around(incidence: tuple[IntArray, IntArray], near: IntArray) -> tuple[IntArray, IntArray]:
    order, start = incidence
    count = (start[near + 1] - start[near]).ravel()
    ends = np.cumsum(count)
    total = int(ends[-1]) if len(ends) else 0
    position = np.arange(total) - np.repeat(ends - count, count)
    face = order[np.repeat(start[near].ravel(), count) + position] // 3
    return np.repeat(np.repeat(np.arange(len(near)), near.shape[1]), count), face


def _walk(
    vertices: FloatArray, faces: IntArray, points: FloatArray, home: IntArray, gap: FloatArray
) -> None:
    """Move points to the face across a side as long as one of them is nearer.

    In a long triangle a point can be far from the corners and so not have it among its own.
    """
    quads = _quads(faces)
    beside = np.full((len(faces), 3), -1, dtype=np.int64)
    used = np.zeros(len(faces), dtype=np.int64)
    for one, other in ((quads.left, quads.right), (quads.right, quads.left)):
        # A face is left of several edges: number them.
        order = np.argsort(one, kind="stable")
        sorted_faces = one[order]
        first = np.searchsorted(sorted_faces, sorted_faces)
        place = used[sorted_faces] + np.arange(len(order)) - first
        beside[sorted_faces, place] = other[order]
        used += np.bincount(one, minlength=len(faces))
    moving = np.arange(len(points))
    while len(moving):
        near = beside[home[moving]]
        rows, columns = np.nonzero(near >= 0)
        tried, who = near[rows, columns], moving[rows]
        found = squared_distances(
            points[who], *(vertices[faces[tried, corner]] for corner in range(3))
        )
        best = np.lexsort((tried, found, rows))
        first = best[np.unique(rows[best], return_index=True)[1]]
        better = first[found[first] < gap[who[first]] * (1 - _LEAST_GAIN)]
        moving = who[better]
        home[moving], gap[moving] = tried[better], found[better]


def _quads(faces: IntArray) -> _Quads:
    """Find the edges between exactly two faces that run through them in opposite directions."""
    tail, head = sides(faces)
    apex = np.roll(faces, -2, axis=1).ravel()
    key = edge_keys(tail, head, int(faces.max()) + 1)
    order = np.argsort(key, kind="stable")
    key = key[order]
    first = np.flatnonzero(np.r_[True, key[1:] != key[:-1]])
    pairs = first[np.diff(np.r_[first, len(key)]) == 2]
    one, two = order[pairs], order[pairs + 1]
    # The left face is the one that runs from the lower to the higher vertex.
    swap = tail[one] > head[one]
    one, two = np.where(swap, two, one), np.where(swap, one, two)
    opposite = (tail[one] == head[two]) & (head[one] == tail[two])
    one, two = one[opposite], two[opposite]
    return _Quads(tail[one], head[one], apex[one], apex[two], one // 3, two // 3)


def _may_flip(quads: _Quads, vertices: FloatArray, faces: IntArray) -> npt.NDArray[np.bool_]:
    """Tell which flips keep the mesh a mesh: no edge twice, no triangle folded over."""
    size = len(vertices)
    edges = np.sort(edge_keys(*sides(faces), size))
    free = ~are_among(edge_keys(quads.c, quads.d, size), edges) & (quads.c != quads.d)
    a, b, c, d = (vertices[index] for index in (quads.a, quads.b, quads.c, quads.d))
    before = np.cross(b - a, c - a) + np.cross(a - b, d - b)
    upright = np.ones(len(a), dtype=bool)
    for normal in (np.cross(d - a, c - a), np.cross(b - d, c - d)):
        cosine = np.einsum("ij,ij->i", normal, before)
        limit = np.linalg.norm(normal, axis=1) * np.linalg.norm(before, axis=1)
        upright &= cosine > _LEAST_COSINE * limit
    return np.asarray(free & upright)


def _gains(
    quads: _Quads,
    vertices: FloatArray,
    points: FloatArray,
    home: IntArray,
    faces: int,
) -> FloatArray:
    """Return by how much each flip lowers the sum of squared distances."""
    owner, witness = _witnesses_of(quads, home, faces)
    gain = np.zeros(len(quads.a))
    for first in range(0, len(owner), _BLOCK):
        rows, who = owner[first : first + _BLOCK], points[witness[first : first + _BLOCK]]
        a, b, c, d = (vertices[index[rows]] for index in (quads.a, quads.b, quads.c, quads.d))
        before = np.minimum(squared_distances(who, a, b, c), squared_distances(who, b, a, d))
        after = np.minimum(squared_distances(who, a, d, c), squared_distances(who, d, b, c))
        gain += np.bincount(rows, weights=before - after, minlength=len(gain))
    return gain


def _witnesses_of(quads: _Quads, home: IntArray, faces: int) -> tuple[IntArray, IntArray]:
    """List the points at home in either face of each quad, as pairs (quad, point)."""
    order = np.argsort(home, kind="stable")
    start = np.searchsorted(home[order], np.arange(faces + 1))
    owners, witnesses = [], []
    for side in (quads.left, quads.right):
        count = start[side + 1] - start[side]
        ends = np.cumsum(count)
        total = int(ends[-1]) if len(ends) else 0
        position = np.arange(total) - np.repeat(ends - count, count)
        owners.append(np.repeat(np.arange(len(side)), count))
        witnesses.append(order[np.repeat(start[side], count) + position])
    return np.concatenate(owners), np.concatenate(witnesses)


def _independent(
    quads: _Quads, gain: FloatArray, least: float, faces: int
) -> npt.NDArray[np.bool_]:
    """Choose the flips that gain most among all that share a face or make the same edge."""
    order = np.lexsort((np.arange(len(gain)), -gain))
    place = np.empty(len(gain), dtype=np.int64)
    place[order] = np.arange(len(gain))
    place[gain <= least] = len(gain)
    first = np.full(faces, len(gain), dtype=np.int64)
    np.minimum.at(first, quads.left, place)
    np.minimum.at(first, quads.right, place)
    chosen = (place < len(gain)) & (first[quads.left] == place) & (first[quads.right] == place)
    picked = np.flatnonzero(chosen)
    ends = np.column_stack([np.minimum(quads.c, quads.d), np.maximum(quads.c, quads.d)])[picked]
    _, keep = np.unique(ends, axis=0, return_index=True)
    out = np.zeros(len(gain), dtype=bool)
    out[picked[keep]] = True
    return out


def _rehome(
    done: _Quads, vertices: FloatArray, points: FloatArray, home: IntArray, faces: int
) -> None:
    """Give the points of flipped pairs to the nearer of the new faces."""
    rows, who = _witnesses_of(done, home, faces)
    a, b, c, d = (vertices[index[rows]] for index in (done.a, done.b, done.c, done.d))
    right = squared_distances(points[who], d, b, c) < squared_distances(points[who], a, d, c)
    home[who] = np.where(right, done.right[rows], done.left[rows])
