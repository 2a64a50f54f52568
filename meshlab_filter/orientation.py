"""Sides of a surface in pieces: which of them face the same way.

Ball pivoting grows a surface from several seeds. Where the balls of two seeds roll on different
sides, their pieces never join, as each edge between them would run the same way twice.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .edges import edge_keys, sides
from .validation import FloatArray, IntArray, check_number, check_points

#: Entries at other borders that each end of a border is compared with.
_COMPARED = 12


def orient_coherently(vertices: npt.ArrayLike, faces: npt.ArrayLike, reach: float) -> IntArray:
    """Turn whole pieces of a mesh so that those whose borders are close face the same way.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
    faces : array_like, shape (F, 3), of integers
    reach : float
        Up to what distance borders are compared, in the unit of the vertices.

    Returns
    -------
    numpy.ndarray, shape (F, 3), int64
        The same faces in the same order, some with the opposite orientation.

    Notes
    -----
    Two pieces disagree if the normals at their borders, near borders counting more, point against
    each other on the whole. Of the disagreements the clearest are resolved, along a spanning tree;
    the larger part by area stays as it is.

    Examples
    --------
    >>> strip = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 1.1, 0], [1, 1.1, 0], [0, 3, 0]]
    >>> orient_coherently(strip, [[0, 1, 2], [1, 3, 2], [4, 6, 5]], 0.5).tolist()
    [[0, 1, 2], [1, 3, 2], [5, 6, 4]]
    """
    corners = check_points(vertices, name="vertices")
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    reach = check_number(reach, name="reach", minimum=0)
    if not len(triangles):
        return triangles
    piece, pieces = pieces_of(triangles)
    if pieces == 1:
        return triangles
    one, two, agreement = _agreements(corners, triangles, piece, pieces, reach)
    a, b, c = (corners[triangles[:, corner]] for corner in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    total = np.asarray(np.bincount(piece, weights=area, minlength=pieces), dtype=float)
    turned = _turned(one, two, agreement, total)
    flip = turned[piece]
    triangles[flip] = triangles[flip][:, ::-1]
    return triangles


def pieces_of(faces: IntArray) -> tuple[IntArray, int]:
    """Return the piece of each face, where faces hang together in an edge, and how many.

    Parameters
    ----------
    faces : numpy.ndarray, shape (F, 3), int64

    Returns
    -------
    piece : numpy.ndarray, shape (F,), int64
    count : int

    Examples
    --------
    >>> piece, count = pieces_of(np.array([[0, 1, 2], [0, 2, 3], [3, 4, 5]]))
    >>> piece.tolist(), count
    ([0, 0, 1], 2)
    """
    return groups_of(len(faces), *joints_of(faces))


def joints_of(faces: IntArray) -> tuple[IntArray, IntArray]:
    """Return the pairs of faces that share an edge.

    Parameters
    ----------
    faces : numpy.ndarray, shape (F, 3), int64

    Returns
    -------
    one, two : numpy.ndarray, shape (J,), int64

    Examples
    --------
    >>> one, two = joints_of(np.array([[0, 1, 2], [3, 4, 5], [0, 2, 3]]))
    >>> one.tolist(), two.tolist()
    ([0], [2])
    """
    keys = edge_keys(*sides(faces), int(faces.max()) + 1)
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    return order[same] // 3, order[same + 1] // 3


def groups_of(size: int, one: IntArray, two: IntArray) -> tuple[IntArray, int]:
    """Return the group of each of some things, of which pairs hang together, and how many.

    Parameters
    ----------
    size : int
        How many things there are.
    one, two : numpy.ndarray, shape (J,), int64

    Returns
    -------
    group : numpy.ndarray, shape (size,), int64
    count : int

    Examples
    --------
    >>> group, count = groups_of(3, np.array([0]), np.array([2]))
    >>> group.tolist(), count
    ([0, 1, 0], 2)
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(one)), (one, two)), shape=(size, size))
    count, group = connected_components(graph, directed=False)
    return group.astype(np.int64), int(count)


def _agreements(
    vertices: FloatArray, faces: IntArray, piece: IntArray, pieces: int, reach: float
) -> tuple[IntArray, IntArray, FloatArray]:
    """Compare normals at borders: pairs of pieces and how much they agree, from minus to plus."""
    from scipy.sparse import coo_matrix
    from scipy.spatial import cKDTree

    tail, head = sides(faces)
    keys = edge_keys(tail, head, len(vertices))
    _, place, count = np.unique(keys, return_inverse=True, return_counts=True)
    border = np.flatnonzero(count[place.ravel()] == 1)
    # An end of a border is a vertex and a piece: one vertex may be in several.
    ends = np.concatenate([tail[border], head[border]]) * pieces + np.tile(piece[border // 3], 2)
    ends = np.unique(ends)
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    normal = np.cross(b - a, c - a)
    # Each end gets the normals of its piece's faces there.
    corner = faces.ravel() * pieces + np.repeat(piece, 3)
    at = np.minimum(np.searchsorted(ends, corner), len(ends) - 1)
    found = ends[at] == corner
    summed = np.zeros((len(ends), 3))
    np.add.at(summed, at[found], np.repeat(normal, 3, axis=0)[found])
    summed /= np.maximum(np.linalg.norm(summed, axis=1), np.finfo(float).tiny)[:, None]
    where, mine = vertices[ends // pieces], ends % pieces
    compared = min(_COMPARED, len(ends))
    far, near = cKDTree(where).query(
        where, k=np.arange(1, compared + 1), distance_upper_bound=reach
    )
    rows, columns = np.nonzero(np.isfinite(far))
    other, far = near[rows, columns], far[rows, columns]
    apart = mine[rows] != mine[other]
    rows, other, far = rows[apart], other[apart], far[apart]
    weight = np.einsum("ij,ij->i", summed[rows], summed[other])
    weight /= 1 + (4 * far / reach) ** 2 if reach > 0 else 1
    low, high = np.minimum(mine[rows], mine[other]), np.maximum(mine[rows], mine[other])
    pairs = coo_matrix((weight, (low, high)), shape=(pieces, pieces)).tocsr().tocoo()
    return pairs.row.astype(np.int64), pairs.col.astype(np.int64), np.asarray(pairs.data)


def _turned(
    one: IntArray, two: IntArray, agreement: FloatArray, area: FloatArray
) -> npt.NDArray[np.bool_]:
    """Tell which pieces to turn, walking from the largest along the clearest agreements."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

    shape = (len(area), len(area))
    clear = np.abs(agreement) > np.finfo(float).eps
    one, two, agreement = one[clear], two[clear], agreement[clear]
    tree = minimum_spanning_tree(coo_matrix((1 / np.abs(agreement), (one, two)), shape=shape))
    against = coo_matrix((agreement < 0, (one, two)), shape=shape).tocsr()
    against = against + against.T
    turned, seen = np.zeros(len(area), dtype=bool), np.zeros(len(area), dtype=bool)
    for root in np.argsort(-area, kind="stable"):
        if seen[root]:
            continue
        order, before = breadth_first_order(tree, root, directed=False)
        for piece in order[1:]:
            turned[piece] = turned[before[piece]] ^ bool(against[piece, before[piece]])
        seen[order] = True
        if area[order][turned[order]].sum() > area[order][~turned[order]].sum():
            turned[order] = ~turned[order]
    return turned
