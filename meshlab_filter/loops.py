"""Loops of boundary edges: holes of a triangle mesh, and pairs of them with a band between."""

from __future__ import annotations

import numpy as np

from .edges import edge_keys, sides
from .validation import FloatArray, IntArray

#: Two borders face each other if they are on average at most this many of their edges apart.
_FACING = 4.0
#: Loops of fewer edges are small holes, not the ends of something.
_SHORTEST = 6


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


def facing_loops(vertices: FloatArray, loops: list[IntArray]) -> list[tuple[int, int, IntArray]]:
    """Join pairs of loops that run against each other, not much further apart than their edges.

    Parameters
    ----------
    vertices : numpy.ndarray, shape (V, 3)
    loops : list of numpy.ndarray
        As from :func:`boundary_loops`.

    Returns
    -------
    list of (int, int, numpy.ndarray)
        The two, and the loop that runs around one of them, over a bridge to the other, around that
        and back: the first vertex of both occurs twice. No loop is in two pairs.

    Examples
    --------
    >>> ring = np.array([[2, 0], [1, 2], [-1, 2], [-2, 0], [-1, -2], [1, -2]])
    >>> prism = np.vstack([np.column_stack([ring, np.full(6, z)]) for z in (0.0, 0.5)])
    >>> facing = facing_loops(prism, [np.arange(6), np.arange(11, 5, -1)])
    >>> [(one, two, loop.tolist()) for one, two, loop in facing]
    [(0, 1, [5, 0, 1, 2, 3, 4, 5, 11, 10, 9, 8, 7, 6, 11])]
    """
    from scipy.spatial import cKDTree

    long = [number for number, loop in enumerate(loops) if len(loop) >= _SHORTEST]
    place = [vertices[loops[number]] for number in long]
    along = [np.roll(p, -1, axis=0) - np.roll(p, 1, axis=0) for p in place]
    step = [float(np.linalg.norm(np.roll(p, -1, axis=0) - p, axis=1).mean()) for p in place]
    low = np.array([p.min(axis=0) - _FACING * s for p, s in zip(place, step)]).reshape(-1, 3)
    high = np.array([p.max(axis=0) + _FACING * s for p, s in zip(place, step)]).reshape(-1, 3)
    near_enough = (low[:, None] <= high).all(axis=2) & (high[:, None] >= low).all(axis=2)
    found = []
    for one, two in zip(*(side.tolist() for side in np.nonzero(np.triu(near_enough, 1)))):
        if len(np.intersect1d(loops[long[one]], loops[long[two]])):
            continue
        gap, near = cKDTree(place[one]).query(place[two])
        back = cKDTree(place[two]).query(place[one])[0]
        wide = float(gap.mean() + back.mean()) / 2
        against = float(np.einsum("ij,ij->i", along[two], along[one][near]).sum())
        if wide <= _FACING * (step[one] + step[two]) / 2 and against < 0:
            j = int(gap.argmin())
            found.append((wide, one, two, int(near[j]), j))
    joined: list[tuple[int, int, IntArray]] = []
    used: set[int] = set()
    for _, one, two, i, j in sorted(found):
        if not {one, two} & used:
            used |= {one, two}
            first, second = np.roll(loops[long[one]], -i), np.roll(loops[long[two]], -j)
            around = np.concatenate([first, first[:1], second, second[:1]])
            joined.append((long[one], long[two], around))
    return joined
