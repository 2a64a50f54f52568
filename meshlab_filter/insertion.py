"""Vertices that a reconstruction left out, put into the surface they lie on.

A ball that rolls over a fine feature touches only some of its points. Those it does not touch stay
without a face, though they were kept because the shape needs them.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .edges import edge_keys, sides, without_face
from .flips import nearest_faces
from .triangles import barycentric
from .validation import FloatArray, IntArray, check_points

#: A foot with a barycentric coordinate below this lies on a side: the side is split.
_ON_SIDE = 0.02
#: Squared height over a face, in squared sides of the face, above which a vertex is no part of the
#: surface but an outlier.
_STEEPEST = 0.5


def insert_vertices(
    vertices: npt.ArrayLike, faces: npt.ArrayLike, *, max_rounds: int = 8
) -> IntArray:
    """Split the face, or the side, nearest to each vertex that has no face.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
    faces : array_like, shape (F, 3), of integers
    max_rounds : int
        In each round every face is split once at most.

    Returns
    -------
    numpy.ndarray, shape (F', 3), int64
        The faces that were not split, then the parts of those that were.

    Notes
    -----
    A vertex stays out if it is higher over its face than some two thirds of the face's sides, as an
    outlier is, or if a corner is what is nearest to it.

    Examples
    --------
    >>> corners = [[0, 0, 0], [3, 0, 0], [0, 3, 0], [1, 1, 0.5], [9, 9, 9]]
    >>> insert_vertices(corners, [[0, 1, 2]]).tolist()
    [[0, 1, 3], [1, 2, 3], [2, 0, 3]]
    """
    corners = check_points(vertices, name="vertices")
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    if not len(triangles):
        return triangles
    for _ in range(max_rounds):
        out = without_face(triangles, len(corners))
        split = _split(corners, triangles, out) if len(out) else None
        if split is None:
            break
        triangles = split
    return triangles


def _split(vertices: FloatArray, faces: IntArray, out: IntArray) -> IntArray | None:
    """Put in the vertices that lie over a face, no two into one face; None if there is none."""
    home, gap = nearest_faces(vertices, faces, vertices[out])
    corner = vertices[faces[home]]
    weights = barycentric(vertices[out], *(corner[:, i] for i in range(3)))
    # The least weight is that of the corner across the side the foot is nearest to.
    row = np.arange(len(out))
    across = weights.argmin(axis=1)
    least = weights[row, across]
    begin = corner[row, (across + 1) % 3]
    side = corner[row, (across + 2) % 3] - begin
    along = np.einsum("ij,ij->i", vertices[out] - begin, side)
    along /= np.maximum(np.einsum("ij,ij->i", side, side), np.finfo(float).tiny)
    on_side = (along > _ON_SIDE) & (along < 1 - _ON_SIDE)
    square = np.sum((corner - np.roll(corner, 1, axis=1)) ** 2, axis=(1, 2)) / 3
    fits = (gap <= _STEEPEST * square) & ((least >= _ON_SIDE) | on_side)
    out, home, across, least = out[fits], home[fits], across[fits], least[fits]
    if not len(out):
        return None
    partner = np.where(least < _ON_SIDE, _across(faces, home, across), home)
    # A side of more than two faces, or with faces turned the other way, is not split; nor is one
    # of a triangle that lies on its own back.
    possible = partner >= -1
    back = np.sort(faces[np.maximum(partner, 0)], axis=1) == np.sort(faces[home], axis=1)
    possible &= (partner == home) | ~back.all(axis=1) | (partner == -1)
    turn = np.full(len(faces) + 1, len(out))
    mine = np.arange(len(out))[possible]
    np.minimum.at(turn, home[possible], mine)
    np.minimum.at(turn, partner[possible], mine)  # -1, a border, is the row too many
    first = turn[home] == np.arange(len(out))
    first &= (partner == -1) | (turn[partner] == np.arange(len(out)))
    first &= possible
    if not first.any():
        return None
    out, home, across, partner = out[first], home[first], across[first], partner[first]
    inside = partner == home
    parts = [np.delete(faces, np.concatenate([home, partner[~inside & (partner >= 0)]]), axis=0)]
    a, b, c = faces[home[inside]].T
    x = out[inside]
    parts += [np.column_stack(p) for p in ((a, b, x), (b, c, x), (c, a, x))]
    parts += _halves(faces[home[~inside]], across[~inside], out[~inside])
    there = ~inside & (partner >= 0)
    if there.any():
        one, other = faces[home[there]], faces[partner[there]]
        row = np.arange(len(one))
        begin, end = (one[row, (across[there] + shift) % 3] for shift in (1, 2))
        apex = np.argmax((other != begin[:, None]) & (other != end[:, None]), axis=1)
        parts += _halves(other, apex, out[there])
    return np.vstack(parts)


def _halves(faces: IntArray, apex: IntArray, x: IntArray) -> list[IntArray]:
    """Split faces from an apex to a vertex on the side across."""
    row = np.arange(len(faces))
    c, a, b = (faces[row, (apex + shift) % 3] for shift in range(3))
    return [np.column_stack([a, x, c]), np.column_stack([x, b, c])]


def _across(faces: IntArray, home: IntArray, apex: IntArray) -> IntArray:
    """Return the face beyond the side across a corner, -1 at a border, -2 where it is not one."""
    size = int(faces.max()) + 1
    tail, head = sides(faces)
    keys = edge_keys(tail, head, size)
    order = np.argsort(keys, kind="stable")
    place = 3 * home + (apex + 1) % 3  # the side from the next corner on
    first = np.searchsorted(keys[order], keys[place])
    count = np.searchsorted(keys[order], keys[place], side="right") - first
    one = order[first]
    two = order[np.minimum(first + 1, len(order) - 1)]
    other = np.where(one == place, two, one)
    turned = tail[other] == tail[place]
    found = np.where((count == 2) & ~turned, other // 3, -2)
    return np.where(count == 1, -1, found)
