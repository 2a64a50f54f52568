"""Patches for holes: a loop of vertices filled with triangles."""

from __future__ import annotations

import numpy as np

from .edges import are_among, edge_keys, sides
from .validation import FloatArray, IntArray


def triangulate(
    vertices: FloatArray, loop: IntArray, known: IntArray, around: FloatArray
) -> IntArray | None:
    """Triangulate a loop with little area and no fold, by dynamic programming over its chords.

    Parameters
    ----------
    vertices : numpy.ndarray, shape (V, 3)
    loop : numpy.ndarray, shape (n,), int64
    known : numpy.ndarray, int64
        Sorted keys of edges that the mesh has already, which no chord may repeat.
    around : numpy.ndarray, shape (n, 3)
        Unit normals of the faces beyond the sides of the loop, that from its first vertex to its
        second first.

    Returns
    -------
    numpy.ndarray, shape (n - 2, 3), int64, or None
        None if every triangulation repeats an edge, or the best one has one twice.

    Notes
    -----
    A triangulation costs its area (G. Barequet, M. Sharir, "Filling gaps in the boundary of a
    polyhedron", Computer Aided Geometric Design 12, 1995) and, for each edge at which two faces are
    folded to less than a right angle, the square of that edge times the cosine.

    Examples
    --------
    >>> square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.1], [0, 1, 0]])
    >>> triangulate(square, np.arange(4), np.empty(0, dtype=np.int64), np.zeros((4, 3))).tolist()
    [[0, 1, 3], [1, 2, 3]]
    """
    n = len(loop)
    place = vertices[loop]
    first, last = np.meshgrid(loop, loop, indexing="ij")
    keys = edge_keys(first, last, len(vertices))
    barred = are_among(keys, known)
    cost = np.full((n, n), np.inf)
    best = np.zeros((n, n), dtype=np.int64)
    cost[np.arange(n - 1), np.arange(1, n)] = 0.0
    # The unit normal of the face on a chord, where the best triangulation below it has one.
    unit = np.zeros((n, n, 3))
    unit[np.arange(n - 1), np.arange(1, n)] = around[:-1]
    for gap in range(2, n):
        i = np.arange(n - gap)
        j = i + gap
        middle = i[:, None] + np.arange(1, gap)
        one, two = place[middle] - place[i, None], place[j, None] - place[i, None]
        normal = np.cross(one, two)
        doubled = np.linalg.norm(normal, axis=2)
        normal /= np.maximum(doubled, np.finfo(float).tiny)[..., None]
        total = cost[i[:, None], middle] + cost[middle, j[:, None]] + doubled / 2
        sides_ = [(one, unit[i[:, None], middle]), (two - one, unit[middle, j[:, None]])]
        if gap == n - 1:
            sides_.append((two, np.broadcast_to(around[-1], normal.shape)))
        for side, beyond in sides_:
            folded = np.maximum(-np.einsum("ijk,ijk->ij", normal, beyond), 0)
            total += folded * np.einsum("ijk,ijk->ij", side, side)
        choice = total.argmin(axis=1)
        row = np.arange(len(i))
        found = total[row, choice]
        unit[i, j] = normal[row, choice]
        if gap < n - 1:
            found[barred[i, j]] = np.inf
        cost[i, j] = found
        best[i, j] = middle[row, choice]
    if not np.isfinite(cost[0, n - 1]):
        return None
    out: list[tuple[int, int, int]] = []
    open_ = [(0, n - 1)]
    while open_:
        begin, end = open_.pop()
        if end - begin >= 2:
            apex = int(best[begin, end])
            out.append((int(loop[begin]), int(loop[apex]), int(loop[end])))
            open_ += [(begin, apex), (apex, end)]
    patch = np.array(out, dtype=np.int64)
    # A vertex that the loop passes twice may have got an edge twice.
    tail, head = sides(patch)
    return patch if len(np.unique(tail * len(vertices) + head)) == len(tail) else None


class SideNormals:
    """Unit normals of the faces of a mesh, by the sides that run through them."""

    def __init__(self, vertices: FloatArray, faces: IntArray) -> None:
        a, b, c = (vertices[faces[:, corner]] for corner in range(3))
        normal = np.cross(b - a, c - a)
        length = np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)
        self.unit = normal / length[:, None]
        self.size = len(vertices)
        tail, head = sides(faces)
        keys = tail * self.size + head
        self.order = np.argsort(keys, kind="stable")
        self.keys = keys[self.order]

    def beyond(self, loop: IntArray) -> FloatArray:
        """Return the normals beyond the sides of a loop, zero where there is no face."""
        face = self.faces_beyond(loop)
        return np.asarray(np.where((face >= 0)[:, None], self.unit[face], 0.0))

    def faces_beyond(self, loop: IntArray) -> IntArray:
        """Return the faces beyond the sides of a loop, -1 where there is none."""
        keys = np.roll(loop, -1) * self.size + loop
        place = np.minimum(np.searchsorted(self.keys, keys), len(self.keys) - 1)
        return np.asarray(np.where(self.keys[place] == keys, self.order[place] // 3, -1))
