"""Holes of a rebuilt surface, closed where the original points say that there is surface.

Ball pivoting leaves a hole where the ball falls through or two normals disagree. Border of the
scan and hole of the reconstruction look alike to a mesh filter; they differ in that original
points lie across the one and not across the other.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .edges import edge_keys, sides
from .evidence import Evidence
from .flips import nearest_vertices
from .validation import FloatArray, IntArray, check_points


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
    density around the hole promises, and if it does not reach what lies off the mesh there either.
    A single missing face is always closed.

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
    evidence = Evidence(corners, triangles, cloud, near, rim)
    added = [triangles]
    for loop in loops:
        patch = triangulate(corners, loop, known)
        if patch is None:
            continue
        # One face missing amid its neighbours needs no witness, unless it is a face seen from
        # behind: the border of a lone triangle.
        single = len(patch) == 1 and not (np.sort(triangles, axis=1) == np.sort(patch)).all(1).any()
        if (
            single
            or evidence.supports(patch)
            or evidence.reaches(patch)
            or (covered and evidence.covers(patch))
        ):
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
