"""Peaks that a reconstruction cut off: vertices left out where the surface should come to them.

Over a feature narrower than the spacing the ball rolls past its tip. The vertices there are far
from the surface, or beyond an end of it, so that no face or side lies under them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from .edges import sides, without_face
from .flips import faces_around, nearest_faces
from .triangles import squared_distances
from .validation import FloatArray, IntArray, check_points

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

#: The sum of squared distances of the points around must fall to this share.
_NEARER = 0.95
#: How far a vertex may be from the surface, in sides of the faces there.
_FARTHEST = 2.0
#: What fewer points than this come nearer with is no outlier if it is within so many spacings.
_FEW, _SPACINGS, _NEIGHBOURS = 3, 2.0, 6
#: Points count for a vertex that are no further from it than this times the surface is.
_AROUND = 1.5


def restore_peaks(
    vertices: npt.ArrayLike, faces: npt.ArrayLike, points: npt.ArrayLike, *, max_rounds: int = 8
) -> IntArray:
    """Put vertices without a face into the face, or the side, that brings most points nearer.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
    faces : array_like, shape (F, 3), of integers
    points : array_like, shape (N, 3)
        The original points, in the unit of the vertices, which are some of them.
    max_rounds : int
        In each round, no two vertices are put in beside each other.

    Returns
    -------
    numpy.ndarray, shape (F', 3), int64
        The faces that were not split, then the parts of those that were.

    Notes
    -----
    Tried are the faces at the corners of the nearest one, and the sides between them. A vertex
    stays out if the points around it do not come nearer on the whole, if it is further away than
    two sides of the faces there, or if it is an outlier: on its own, above the surface rather than
    beyond its end, and off by more than two spacings of the points around.

    Examples
    --------
    The tip of a tent that was left out, far above its floor:

    >>> tent = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [1, 1, 3.0]])
    >>> walls = np.vstack([tent] + [(1 - t) * tent[:4] + t * tent[4] for t in (0.3, 0.5, 0.7)])
    >>> restore_peaks(tent, [[0, 1, 2], [0, 2, 3]], walls).tolist()
    [[2, 3, 4], [3, 0, 4], [0, 1, 4], [1, 2, 4]]
    """
    from scipy.spatial import cKDTree

    corners = check_points(vertices, name="vertices")
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    if not len(triangles) or not len(without_face(triangles, len(corners))):
        return triangles
    tree = cKDTree(check_points(points))
    for _ in range(max_rounds):
        restored = _restore(corners, triangles, tree)
        if restored is None:
            break
        triangles = restored
    return triangles


def _restore(vertices: FloatArray, faces: IntArray, tree: cKDTree) -> IntArray | None:
    """Put in what is not beside what is put in already, the farthest first; None if nothing is."""
    out = without_face(faces, len(vertices))
    if not len(out):
        return None
    home, square = nearest_faces(vertices, faces, vertices[out])
    gap = np.sqrt(square)
    spacing = _spacing_beside(vertices[out], tree)
    owner, beside = faces_around(faces, faces[home], len(vertices))
    a, b, c = (vertices[faces[home, corner]] for corner in range(3))
    normal = np.cross(b - a, c - a)
    height = np.abs(np.einsum("ij,ij->i", vertices[out] - a, normal))
    above = height > gap * np.linalg.norm(normal, axis=1) / 2
    touched = np.zeros(len(vertices), dtype=bool)
    stays = np.ones(len(faces), dtype=bool)
    new = []
    for row in np.argsort(-gap, kind="stable"):
        which = np.unique(beside[owner == row])
        patch = faces[which]
        side = vertices[patch] - vertices[np.roll(patch, 1, axis=1)]
        length = float(np.sqrt(np.mean(np.sum(side**2, axis=2))))
        if gap[row] > _FARTHEST * length or touched[patch].any():
            continue
        reach = max(_AROUND * float(gap[row]), length)
        around = tree.data[tree.query_ball_point(vertices[out[row]], reach)]
        split, parts, improved, nearer = _best_split(vertices, patch, int(out[row]), around)
        alone = nearer < _FEW and above[row] and gap[row] > _SPACINGS * spacing[row]
        if improved and not alone:
            stays[which[split]] = False
            touched[patch] = True
            new.append(parts)
    return np.vstack([faces[stays], *new]) if new else None


def _spacing_beside(places: FloatArray, tree: cKDTree) -> FloatArray:
    """Return how far the points nearest to some places, one of them each, are from others."""
    count = np.arange(1, min(_NEIGHBOURS + 1, tree.n) + 1)
    beside = tree.query(places, k=count)[1][:, 1:]
    far = tree.query(tree.data[beside.ravel()], k=count)[0][:, 1:].mean(axis=1)
    return np.asarray(np.median(far.reshape(beside.shape), axis=1))


def _best_split(
    vertices: FloatArray, patch: IntArray, vertex: int, points: FloatArray
) -> tuple[list[int], IntArray, bool, int]:
    """Try a vertex in each face and on each inner side of a patch.

    Returns the rows of the patch to split, the parts, whether the sum of squared distances falls
    far enough, and how many points come at least twice as near.
    """
    gap = _squares(vertices, patch, points)
    before = gap.min(axis=1)
    tail, head = (ends.tolist() for ends in sides(patch))
    face_of = {side: row // 3 for row, side in enumerate(zip(tail, head))}
    tries = [[row] for row in range(len(patch))]
    inner = [(a, b) for a, b in face_of if a < b and (b, a) in face_of]
    tries += [[face_of[a, b], face_of[b, a]] for a, b in inner]
    best: tuple[list[int], IntArray, float, int] = [], patch[:0], np.inf, 0
    for rows in tries:
        every = [side for row in rows for side in zip(tail[3 * row :][:3], head[3 * row :][:3])]
        rim = [(a, b) for a, b in every if (b, a) not in every]
        if len(rim) != len(rows) + 2:  # a triangle that lies on its own back
            continue
        parts = np.array([(a, b, vertex) for a, b in rim], dtype=np.int64)
        left = np.delete(gap, rows, axis=1).min(axis=1, initial=np.inf)
        after = np.minimum(left, _squares(vertices, parts, points).min(axis=1))
        total = float(after.sum())
        if total < best[2]:
            best = rows, parts, total, int((after < before / 4).sum())
    rows, parts, total, nearer = best
    return rows, parts, total <= _NEARER * float(before.sum()), nearer


def _squares(vertices: FloatArray, faces: IntArray, points: FloatArray) -> FloatArray:
    """Return the squared distance of every point to every face, shape (P, F)."""
    corner = (vertices[np.tile(faces[:, i], len(points))] for i in range(3))
    found = squared_distances(np.repeat(points, len(faces), axis=0), *corner)
    return found.reshape(len(points), len(faces))
