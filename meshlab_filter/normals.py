"""Normals of a cloud: estimated, made consistent, and used to smooth it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .errors import InvalidCloudError
from .validation import FloatArray, IntArray, check_integer, check_points

# Points handled at a time, so that their neighbours' coordinates stay in cache.
_CHUNK = 8192
# Added to the length of every edge of the spanning tree: a sparse graph drops edges of length 0.
_LEAST_LENGTH = 1e-6
# Rounds of voting on signs: islands of wrong ones shrink by about a point a round.
_MOST_VOTES = 20


def nearest_neighbours(points: FloatArray, k: int) -> IntArray:
    """Find the k nearest other points of each point: indices, shape (N, min(k, N - 1)), int64."""
    from scipy.spatial import cKDTree

    k = min(k, len(points) - 1)
    if k < 1:
        return np.empty((len(points), 0), dtype=np.int64)
    found = cKDTree(points).query(points, k=k + 1, workers=-1)[1]
    # A point comes first in its own list, but for duplicates, where it may come anywhere or not at
    # all: then the last is dropped.
    other = found != np.arange(len(points))[:, None]
    other[other.all(axis=1), -1] = False
    return np.asarray(found[other].reshape(len(points), k), dtype=np.int64)


def estimate_normals(points: npt.ArrayLike, *, k: int = 12, orient: bool = True) -> FloatArray:
    """Find the direction in which each point's neighbourhood extends least.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    k : int
        How many nearest neighbours, besides the point itself, the plane is fitted to.
    orient : bool
        Whether to make the signs consistent (:func:`orient_normals`).

    Returns
    -------
    numpy.ndarray, shape (N, 3), float64
        Unit normals. Where a neighbourhood has no plane (all its points in one place or on one
        line), some direction perpendicular to it.

    Raises
    ------
    InvalidCloudError
        If the points are not usable.
    InvalidParameterError
        If k is less than 2.

    References
    ----------
    H. Hoppe et al., "Surface reconstruction from unorganized points", SIGGRAPH 1992, section 3.1.

    Examples
    --------
    >>> import numpy as np
    >>> x, y = np.meshgrid(np.arange(5.0), np.arange(5.0))
    >>> plane = np.column_stack([x.ravel(), y.ravel(), np.zeros(25)])
    >>> np.unique(abs(estimate_normals(plane)), axis=0)
    array([[0., 0., 1.]])
    """
    cloud = check_points(points)
    k = check_integer(k, name="k", minimum=2)
    cloud = cloud - cloud.mean(axis=0)
    neighbours = nearest_neighbours(cloud, k)
    normals = np.empty_like(cloud)
    for start in range(0, len(cloud), _CHUNK):
        rows = slice(start, start + _CHUNK)
        around = np.concatenate([cloud[rows, None], cloud[neighbours[rows]]], axis=1)
        around -= around.mean(axis=1, keepdims=True)
        normals[rows] = np.linalg.eigh(around.transpose(0, 2, 1) @ around)[1][:, :, 0]
    return _orient(cloud, normals, neighbours) if orient else normals


def orient_normals(points: npt.ArrayLike, normals: npt.ArrayLike, *, k: int = 12) -> FloatArray:
    """Give normals consistent signs, pointing outward where each connected part is outermost.

    Signs spread along the minimum spanning tree of the graph of k nearest neighbours, whose edges
    are the shorter the more parallel the normals at their ends are.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    normals : array_like, shape (N, 3)
        Normals of any length and sign.
    k : int
        Neighbours of each point in the graph.

    Returns
    -------
    numpy.ndarray, shape (N, 3), float64
        Unit normals.

    Raises
    ------
    InvalidCloudError
        If the points or normals are not usable.
    InvalidParameterError
        If k is less than 1.

    References
    ----------
    H. Hoppe et al., "Surface reconstruction from unorganized points", SIGGRAPH 1992, section 3.3.

    Examples
    --------
    >>> import numpy as np
    >>> a = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    >>> ring = np.column_stack([np.cos(a), np.sin(a), np.zeros(24)])
    >>> mixed = ring * np.where(np.arange(24) % 3, 1, -1)[:, None]
    >>> bool(np.allclose(orient_normals(ring, mixed, k=2), ring))
    True
    """
    cloud = check_points(points)
    k = check_integer(k, name="k", minimum=1)
    return _orient(cloud, unit_normals(normals, cloud), nearest_neighbours(cloud, k))


def repair_signs(
    points: npt.ArrayLike, normals: npt.ArrayLike, *, k: int = 12
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Flip the few normals whose sign their neighbours vote down, and leave the others alone.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    normals : array_like, shape (N, 3)
        Normals of any length, most of them with the right sign.
    k : int
        How many nearest neighbours vote; the more parallel to the point's normal, the more the
        vote counts.

    Returns
    -------
    normals : numpy.ndarray, shape (N, 3), float64
        Unit normals.
    flipped : numpy.ndarray, shape (N,), bool
        Which of them were turned round.

    Raises
    ------
    InvalidCloudError
        If the points or normals are not usable.
    InvalidParameterError
        If k is less than 1.

    Examples
    --------
    >>> import numpy as np
    >>> x, y = np.meshgrid(np.arange(5.0), np.arange(5.0))
    >>> plane = np.column_stack([x.ravel(), y.ravel(), np.zeros(25)])
    >>> normals = np.tile([0.0, 0.0, 1.0], (25, 1))
    >>> normals[7] *= -1
    >>> np.flatnonzero(repair_signs(plane, normals)[1])
    array([7])
    """
    cloud = check_points(points)
    k = check_integer(k, name="k", minimum=1)
    directions = unit_normals(normals, cloud)
    neighbours = nearest_neighbours(cloud, k)
    sign = np.ones(len(cloud))
    agreement = np.empty(neighbours.shape)
    for start in range(0, len(cloud), _CHUNK):
        rows = slice(start, start + _CHUNK)
        dot = np.einsum("nkj,nj->nk", directions[neighbours[rows]], directions[rows])
        agreement[rows] = dot * np.abs(dot)
    for _ in range(_MOST_VOTES):
        against = sign * (agreement * sign[neighbours]).sum(axis=1)
        # Only the most outvoted of a neighbourhood turns: two that disagree must not both.
        turn = (against < 0) & (against <= against[neighbours].min(axis=1, initial=0.0))
        if not turn.any():
            break
        sign[turn] *= -1
    return directions * sign[:, None], sign < 0


def unit_normals(normals: npt.ArrayLike, points: FloatArray) -> FloatArray:
    """Scale normals to length one; where a given one has no length, estimate it.

    Parameters
    ----------
    normals : array_like, shape (N, 3)
        Normals of any length.
    points : numpy.ndarray, shape (N, 3)
        The points they belong to.

    Returns
    -------
    numpy.ndarray, shape (N, 3), float64

    Raises
    ------
    InvalidCloudError
        If the normals are not finite or not as many as the points.
    """
    given = check_points(normals, name="normals")
    if len(given) != len(points):
        raise InvalidCloudError(
            f"Invalid normals. Must be one for each of the {len(points)} points. "
            f"Given: {len(given)}."
        )
    largest = np.abs(given).max(axis=1)
    missing = largest == 0
    scaled = given / np.where(missing, 1.0, largest)[:, None]
    unit = scaled / np.where(missing, 1.0, np.linalg.norm(scaled, axis=1))[:, None]
    if missing.any():
        unit[missing] = estimate_normals(points, orient=False)[missing]
    return np.asarray(unit)


def smooth_to_tangent_planes(points: FloatArray, normals: FloatArray, *, k: int = 12) -> FloatArray:
    """Move each point along its normal to the mean height of itself and its k neighbours.

    Parameters
    ----------
    points, normals : numpy.ndarray, shape (N, 3)
        Coordinates and unit normals.
    k : int
        How many nearest neighbours take part in the mean.

    Returns
    -------
    numpy.ndarray, shape (N, 3), float64
    """
    neighbours = nearest_neighbours(points, k)
    moved = points.copy()
    for start in range(0, len(points), _CHUNK):
        rows = slice(start, start + _CHUNK)
        d = points[neighbours[rows]] - points[rows, None]
        height = np.einsum("nkj,nj->n", d, normals[rows]) / (neighbours.shape[1] + 1)
        moved[rows] += height[:, None] * normals[rows]
    return moved


def _orient(points: FloatArray, normals: FloatArray, neighbours: IntArray) -> FloatArray:
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import (
        breadth_first_order,
        connected_components,
        minimum_spanning_tree,
    )

    size, k = neighbours.shape
    start = np.repeat(np.arange(size), k)
    end = neighbours.ravel()
    dot = np.einsum("nj,nj->n", normals[start], normals[end])
    length = 1.0 - np.minimum(np.abs(dot), 1.0) + _LEAST_LENGTH
    # Both directions of an edge have one length; taken once, coo_matrix would add them up.
    low, high = np.minimum(start, end), np.maximum(start, end)
    _, once = np.unique(low * size + high, return_index=True)
    graph = coo_matrix((length[once], (low[once], high[once])), shape=(size, size)).tocsr()
    parts, part = connected_components(graph, directed=False)
    # Each part starts at its point farthest from its centroid, where outward is known.
    members = np.maximum(np.bincount(part, minlength=parts), 1)
    centre = np.column_stack([np.bincount(part, points[:, a], parts) / members for a in range(3)])
    outward = points - centre[part]
    far = np.einsum("nj,nj->n", outward, outward)
    by_part = np.lexsort((-far, part))
    roots = by_part[np.searchsorted(part[by_part], np.arange(parts))]
    # One more vertex joins the roots of all parts, so that one walk reaches every point.
    tree = minimum_spanning_tree(graph).tocoo()
    joined = coo_matrix(
        (
            np.ones(len(tree.row) + parts),
            (np.append(tree.row, np.full(parts, size)), np.append(tree.col, roots)),
        ),
        shape=(size + 1, size + 1),
    ).tocsr()
    parent = breadth_first_order(joined, size, directed=False)[1].astype(np.int64)
    parent[size] = size
    everyone = np.arange(size)
    sign = np.ones(size + 1)
    above = np.where(parent[:size] == size, everyone, parent[:size])
    sign[:size] = np.where(np.einsum("nj,nj->n", normals, normals[above]) < 0, -1.0, 1.0)
    sign[roots] = np.where(np.einsum("nj,nj->n", normals[roots], outward[roots]) < 0, -1.0, 1.0)
    # The sign of a point is the product along its path to the root; each pass doubles the path.
    while (parent != size).any():
        sign *= sign[parent]
        parent = parent[parent]
    return normals * sign[:size, None]
