"""Holes of a rebuilt surface, closed where the original points say that there is surface.

Ball pivoting leaves a hole where the ball falls through or two normals disagree. Border of the
scan and hole of the reconstruction look alike to a mesh filter; they differ in that original
points lie across the one and not across the other.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .edges import edge_keys, sides
from .flips import nearest_faces, nearest_vertices
from .validation import FloatArray, IntArray, check_points

#: Share of the points expected on a triangle, by the density around, that must be there.
_LEAST_SUPPORT = 0.2
#: Points expected below which their number says nothing and the triangle counts as supported.
_FEW = 3.0
#: Points lie all over a patch if this share of samples on it has a point within so many spacings.
_ALL_OVER, _NEAR = 0.9, 1.2
_STEPS = 40


def close_holes(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    points: npt.ArrayLike,
    *,
    near: IntArray | None = None,
    max_edges: int = 64,
    covered: bool = False,
) -> IntArray:
    """Close holes of a triangle mesh across which the original points lie.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
    faces : array_like, shape (F, 3), of integers
    points : array_like, shape (N, 3)
        The original points, in the unit of the vertices.
    near : numpy.ndarray, shape (N, k), int64, optional
        What :func:`~meshlab_filter.flips.nearest_vertices` says of these points, if that is known
        already.
    max_edges : int
        Holes with more edges stay as they are.
    covered : bool
        Close as well what other faces cover already, as long as there are points all over it.

    Returns
    -------
    numpy.ndarray, shape (F + new, 3), int64
        The faces given, then the new ones, oriented as those around.

    Notes
    -----
    A hole gets the triangulation of least area that makes no edge twice (G. Barequet, M. Sharir,
    "Filling gaps in the boundary of a polyhedron", Computer Aided Geometric Design 12, 1995). It
    stays open if on less than half of that area there are about as many original points as their
    density around the hole promises. A single missing face is always closed.

    Examples
    --------
    A square without its middle, on which there are points, and again without them:

    >>> grid = np.stack(np.meshgrid(*[np.arange(4.0)] * 2, [0.0]), axis=-1).reshape(-1, 3)
    >>> cells = (0, 1, 2, 4, 6, 8, 9, 10)
    >>> faces = [f for i in cells for f in ([i, i + 1, i + 5], [i, i + 5, i + 4])]
    >>> dense = np.stack(np.meshgrid(*[np.linspace(0, 3, 31)] * 2, [0.0]), axis=-1).reshape(-1, 3)
    >>> len(faces), len(close_holes(grid, faces, dense))
    (16, 18)
    >>> around = (np.abs(dense[:, :2] - 1.5) > 0.5).any(axis=1)
    >>> len(close_holes(grid, faces, dense[around]))
    16
    """
    corners = check_points(vertices, name="vertices")
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    cloud = check_points(points)
    loops = [loop for loop in boundary_loops(triangles) if len(loop) <= max_edges]
    if not loops:
        return triangles
    known = np.unique(edge_keys(*sides(triangles), len(corners)))
    if near is None:
        near = nearest_vertices(corners, triangles, cloud)
    rim = np.unique(np.concatenate(loops))
    evidence = _Evidence(corners, triangles, cloud, near, rim)
    added = [triangles]
    for loop in loops:
        patch = triangulate(corners, loop, known)
        if patch is None:
            continue
        # One face missing amid its neighbours needs no witness, unless it is a face seen from
        # behind: the border of a lone triangle.
        single = len(patch) == 1 and not (np.sort(triangles, axis=1) == np.sort(patch)).all(1).any()
        if single or evidence.supports(patch) or (covered and evidence.covers(patch)):
            added.append(patch)
            known = np.union1d(known, edge_keys(*sides(patch), len(corners)))
    return np.vstack(added)


def boundary_loops(faces: IntArray) -> list[IntArray]:
    """Return the loops of boundary edges, each in the direction of the faces that close it.

    Parameters
    ----------
    faces : numpy.ndarray, shape (F, 3)

    Returns
    -------
    list of numpy.ndarray
        Vertices of each loop. Holes that touch in a vertex are loops of their own.

    Examples
    --------
    >>> [loop.tolist() for loop in boundary_loops(np.array([[0, 1, 2], [0, 2, 3]]))]
    [[0, 3, 2, 1]]
    """
    tail, head = sides(faces)
    keys = edge_keys(tail, head, int(faces.max()) + 1 if len(faces) else 0)
    _, place, count = np.unique(keys, return_index=True, return_counts=True)
    single = np.sort(place[count == 1])
    # The new face runs through the edge the other way.
    begin, end = head[single], tail[single]
    ways: dict[int, list[int]] = {}
    for one, two in zip(begin[::-1].tolist(), end[::-1].tolist()):
        ways.setdefault(one, []).append(two)
    loops = []
    for start in sorted(ways):
        path, position = [start], {start: 0}
        while ways.get(path[-1]):
            vertex = ways[path[-1]].pop()
            if vertex not in position:
                position[vertex] = len(path)
                path.append(vertex)
                continue
            # Back where the path has been: what lies between is a loop of its own.
            loop = path[position[vertex] :]
            del path[position[vertex] + 1 :]
            for gone in loop[1:]:
                del position[gone]
            if len(loop) >= 3:
                loops.append(np.array(loop, dtype=np.int64))
    return loops


def triangulate(vertices: FloatArray, loop: IntArray, known: IntArray) -> IntArray | None:
    """Triangulate a loop with the least area, by dynamic programming over its chords.

    Parameters
    ----------
    vertices : numpy.ndarray, shape (V, 3)
    loop : numpy.ndarray, shape (n,), int64
    known : numpy.ndarray, int64
        Sorted keys of edges that the mesh has already, which no chord may repeat.

    Returns
    -------
    numpy.ndarray, shape (n - 2, 3), int64, or None
        None if every triangulation repeats an edge.
    """
    n = len(loop)
    place = vertices[loop]
    first, last = np.meshgrid(loop, loop, indexing="ij")
    barred = np.isin(edge_keys(first, last, len(vertices)), known)
    cost = np.full((n, n), np.inf)
    best = np.zeros((n, n), dtype=np.int64)
    cost[np.arange(n - 1), np.arange(1, n)] = 0.0
    for gap in range(2, n):
        i = np.arange(n - gap)
        j = i + gap
        middle = i[:, None] + np.arange(1, gap)
        one, two = place[middle] - place[i, None], place[j, None] - place[i, None]
        area = np.linalg.norm(np.cross(one, two), axis=2) / 2
        total = cost[i[:, None], middle] + cost[middle, j[:, None]] + area
        choice = total.argmin(axis=1)
        found = total[np.arange(len(i)), choice]
        if gap < n - 1:
            found[barred[i, j]] = np.inf
        cost[i, j] = found
        best[i, j] = middle[np.arange(len(i)), choice]
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
    return np.array(out, dtype=np.int64)


class _Evidence:
    """The original points, asked whether a patch is missing from a mesh."""

    def __init__(
        self,
        vertices: FloatArray,
        faces: IntArray,
        points: FloatArray,
        near: IntArray,
        rim: IntArray,
    ) -> None:
        from scipy.spatial import cKDTree

        self.vertices, self.points = vertices, points
        self.tree = cKDTree(points)
        # Points in a hole have its rim near; the mesh has all the others.
        beside = np.isin(near, rim).any(axis=1)
        self.gap = np.zeros(len(points))
        found = nearest_faces(vertices, faces, points[beside], near=near[beside])[1]
        self.gap[beside] = np.sqrt(found)

    def supports(self, patch: IntArray) -> bool:
        """Tell whether points that the mesh misses lie on at least half of a patch's area."""
        a, b, c = (self.vertices[patch[:, corner]] for corner in range(3))
        normal = np.cross(b - a, c - a)
        doubled = np.linalg.norm(normal, axis=1)
        spacing = self._spacing(patch)
        if spacing == 0.0:
            return False
        # A point has about the square of the spacing to itself.
        expected = doubled / 2 / spacing**2
        centre = (a + b + c) / 3
        reach = np.linalg.norm(np.stack([a, b, c]) - centre, axis=2).max(axis=0)
        held = float(doubled[expected < _FEW].sum())
        for index in np.flatnonzero(expected >= _FEW):
            near = self.tree.query_ball_point(centre[index], reach[index])
            relative = self.points[near] - a[index]
            unit = normal[index] / doubled[index]
            height = np.abs(relative @ unit)
            v = np.cross(relative, c[index] - a[index]) @ unit
            w = np.cross(b[index] - a[index], relative) @ unit
            inside = (v > 0) & (w > 0) & (v + w < doubled[index])
            inside &= height < np.sqrt(doubled[index]) / 2
            missed = int((inside & (self.gap[near] > height + 1e-6 * reach[index])).sum())
            if missed >= _LEAST_SUPPORT * expected[index]:
                held += float(doubled[index])
        return bool(held >= doubled.sum() / 2)

    def covers(self, patch: IntArray) -> bool:
        """Tell whether points lie all over a patch, be they missed by the mesh or not."""
        spacing = self._spacing(patch)
        if spacing == 0.0:
            return False
        corner = self.vertices[patch]
        longest = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max()
        steps = int(np.clip(np.ceil(longest / spacing), 2, _STEPS))
        # Barycentric coordinates of an even grid, corners left out: these are points themselves.
        grid = np.array(
            [(i, j, steps - i - j) for i in range(steps + 1) for j in range(steps + 1 - i)]
        )
        grid = grid[grid.max(axis=1) < steps] / steps
        samples = np.einsum("sc,tcd->tsd", grid, corner).reshape(-1, 3)
        gap = self.tree.query(samples, workers=-1)[0]
        return bool(np.mean(gap <= _NEAR * spacing) >= _ALL_OVER)

    def _spacing(self, patch: IntArray) -> float:
        """Spacing of the original points around a hole: the mean distance of six neighbours."""
        rim = self.vertices[np.unique(patch)]
        far = self.tree.query(rim, k=min(7, len(self.points)))[0].reshape(len(rim), -1)
        return float(np.median(far[:, 1:].mean(axis=1))) if far.shape[1] > 1 else 0.0
