"""Figures that say how good a simplified cloud and its surface are."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .edges import edge_keys, sides
from .errors import InvalidCloudError, InvalidParameterError
from .validation import FloatArray, check_points

#: A triangle at least this compact is acceptable (Mahdaoui and Sbai 2020, below eq. 11).
ACCEPTABLE_COMPACTNESS = 0.6
#: Share of the diagonal at which the paper's errors are cut.
PAPER_CUT = 0.01


def median_spacing(points: npt.ArrayLike, *, neighbours: int = 6) -> float:
    """Return the median over all points of the mean distance to their nearest neighbours.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        In any unit of length.
    neighbours : int
        How many neighbours count; as many as there are, for smaller clouds.

    Returns
    -------
    float
        In the unit of the points; 0 for a single point.

    Examples
    --------
    >>> median_spacing([[0, 0, 0], [1, 0, 0], [2, 0, 0]], neighbours=1)
    1.0
    """
    return spacing_and_regularity(points, neighbours=neighbours)[0]


def regularity(points: npt.ArrayLike, *, neighbours: int = 6) -> float:
    """Return how evenly spaced points are from neighbour to neighbour, whatever their density.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        In any unit of length, at least two.
    neighbours : int
        How many neighbours count; as many as there are, for smaller clouds.

    Returns
    -------
    float
        The median of the distance to the nearest neighbour over the mean distance to the nearest
        few: 1 on a hexagonal grid, 0.6 to 0.9 for scans, about a half for points thrown at random
        on a surface.

    Examples
    --------
    >>> regularity([[0, 0, 0], [1, 0, 0], [3, 0, 0]])
    0.6667
    """
    array = check_points(points, minimum=2)
    return spacing_and_regularity(array, neighbours=neighbours)[1]


def spacing_and_regularity(points: npt.ArrayLike, *, neighbours: int = 6) -> tuple[float, float]:
    """Return :func:`median_spacing` and :func:`regularity`, from one search for neighbours.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        In any unit of length.
    neighbours : int
        How many neighbours count; as many as there are, for smaller clouds.

    Returns
    -------
    spacing : float
        In the unit of the points.
    regularity : float
        Both are 0 for a single point.

    Examples
    --------
    >>> spacing, even = spacing_and_regularity([[0, 0, 0], [1, 0, 0], [3, 0, 0]])
    >>> spacing, round(even, 3)
    (2.0, 0.667)
    """
    from scipy.spatial import cKDTree

    array = check_points(points)
    nearest = min(neighbours, len(array) - 1)
    if nearest < 1:
        return 0.0, 0.0
    found = cKDTree(array).query(array, k=nearest + 1, workers=-1)[0][:, 1:]
    mean = found.mean(axis=1)
    apart = mean > 0
    even = float(np.median(found[apart, 0] / mean[apart])) if apart.any() else 0.0
    return float(np.median(mean)), even


def summarise_errors(
    distances: npt.ArrayLike, *, diagonal: float, cut: float | None = None
) -> dict[str, Any]:
    """Summarise distances to a surface, as shares of the bounding-box diagonal.

    Parameters
    ----------
    distances : array_like, shape (N,)
        Distance of each original point to the surface, in the cloud's unit.
    diagonal : float
        Diagonal of the original cloud's bounding box, in the same unit.
    cut : float, optional
        Share of the diagonal; samples farther away are dropped, as MeshLab's filter does.

    Returns
    -------
    dict
        "mean" (eq. 9), "rms", "p95", "p99", "max" (eq. 8), all divided by the diagonal;
        "samples" counted and "dropped". The figures are None when every sample was dropped.

    Raises
    ------
    InvalidParameterError
        If the diagonal is not positive.

    References
    ----------
    A. Mahdaoui, E. H. Sbai, Advances in Multimedia 2020, 8825205, eqs 8–10.

    Examples
    --------
    >>> summarise_errors([0.0, 0.1, 2.0], diagonal=10.0, cut=0.01)["max"]
    0.01
    """
    if not diagonal > 0:
        raise InvalidParameterError(f"Invalid diagonal. Must be positive. Given: {diagonal}.")
    shares = np.asarray(distances, dtype=np.float64) / diagonal
    total = len(shares)
    if cut is not None:
        shares = shares[shares <= cut]
    if not len(shares):
        return {
            "mean": None, "rms": None, "p95": None, "p99": None, "max": None,
            "samples": 0, "dropped": total,
        }  # fmt: skip
    p95, p99 = np.percentile(shares, [95, 99])
    return {
        "mean": float(shares.mean()),
        "rms": float(np.sqrt(np.mean(shares**2))),
        "p95": float(p95),
        "p99": float(p99),
        "max": float(shares.max()),
        "samples": len(shares),
        "dropped": total - len(shares),
    }


def compactness(points: npt.ArrayLike, faces: npt.ArrayLike) -> FloatArray:
    """Return the compactness of triangles: 1 if equilateral, 0 if degenerate (eq. 11).

    Parameters
    ----------
    points : array_like, shape (N, 3)
    faces : array_like, shape (F, 3), of integers
        Indices into the points.

    Returns
    -------
    numpy.ndarray, shape (F,), float64
        4√3·area / (L1² + L2² + L3²), dimensionless, in 0 … 1.

    References
    ----------
    A. Mahdaoui, E. H. Sbai, Advances in Multimedia 2020, 8825205, eq. 11.

    Examples
    --------
    >>> compactness([[0, 0, 0], [1, 0, 0], [0.5, 0.75**0.5, 0]], [[0, 1, 2]])
    array([1.])
    """
    array = check_points(points)
    triangles = array[np.asarray(faces, dtype=np.int64).reshape(-1, 3)]
    sides = triangles - np.roll(triangles, -1, axis=1)
    squares = np.einsum("fij,fij->f", sides, sides)
    doubled_area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    positive = squares > 0
    out = np.zeros(len(triangles))
    out[positive] = 2 * np.sqrt(3) * doubled_area[positive] / squares[positive]
    return out


def acceptable_share(compactnesses: FloatArray) -> float | None:
    """Return the share of triangles with compactness 0.6 and above, None without triangles.

    Examples
    --------
    >>> acceptable_share(np.array([0.5, 0.6, 1.0, 1.0]))
    0.75
    """
    if not len(compactnesses):
        return None
    return float(np.mean(compactnesses >= ACCEPTABLE_COMPACTNESS))


def edge_defects(faces: npt.ArrayLike) -> dict[str, int]:
    """Count what keeps a triangle mesh from being closed and manifold.

    Parameters
    ----------
    faces : array_like, shape (F, 3), of integers

    Returns
    -------
    dict
        "boundary_edges" (one face), "nonmanifold_edges" (three faces or more) and "holes":
        the connected groups of boundary edges.

    Examples
    --------
    >>> edge_defects([[0, 1, 2], [0, 2, 3]])
    {'boundary_edges': 4, 'nonmanifold_edges': 0, 'holes': 1}
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    triangles = np.asarray(faces, dtype=np.int64).reshape(-1, 3)
    vertices = int(triangles.max()) + 1 if len(triangles) else 1
    keys, counts = np.unique(edge_keys(*sides(triangles), vertices), return_counts=True)
    boundary = np.column_stack(np.divmod(keys[counts == 1], vertices))
    holes = 0
    if len(boundary):
        _, ends = np.unique(boundary, return_inverse=True)
        start, end = ends.reshape(boundary.shape).T
        size = int(ends.max()) + 1
        graph = coo_array((np.ones(len(start)), (start, end)), shape=(size, size))
        holes = int(connected_components(graph, directed=False)[0])
    return {
        "boundary_edges": len(boundary),
        "nonmanifold_edges": int((counts > 2).sum()),
        "holes": holes,
    }


def covering_radius(points: npt.ArrayLike, kept: npt.ArrayLike) -> float:
    """Return how far the worst original point is from the nearest kept point.

    Parameters
    ----------
    points : array_like, shape (N, 3)
    kept : array_like, shape (M, 3)

    Returns
    -------
    float
        In the unit of the points.

    Raises
    ------
    InvalidCloudError
        If no point is kept.

    Examples
    --------
    >>> covering_radius([[0, 0, 0], [1, 0, 0], [3, 0, 0]], [[0, 0, 0]])
    3.0
    """
    from scipy.spatial import cKDTree

    remaining = check_points(kept, name="kept points")
    if not len(remaining):
        raise InvalidCloudError("A covering radius needs kept points. Given: 0.")
    found, _ = cKDTree(remaining).query(check_points(points), workers=-1)
    return float(found.max())
