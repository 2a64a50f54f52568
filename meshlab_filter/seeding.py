"""Where the centroids of a clustering start."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .assignment import Assignment
from .errors import InvalidParameterError
from .validation import FloatArray, IntArray, check_choice, check_points

INITS = ("random", "k-means++", "spread")
# Passes of Lloyd's algorithm before a spread start moves centroids, and how often it does so.
_SPREAD_PASSES, _SPREAD_ROUNDS = 3, 2
# A centroid moves where giving its points to its neighbour costs less than this many times the
# inertia of the cluster it comes to halve. Both figures are from before anything settles; two
# gave the lowest inertia after it, on even and uneven clouds.
_WORTH = 2.0


def start(
    points: FloatArray,
    n_clusters: int,
    *,
    init: str | npt.ArrayLike,
    offset: FloatArray,
    seed: int,
) -> Assignment:
    """Return the centroids k-means starts from, and the points assigned to them.

    Parameters
    ----------
    points : numpy.ndarray, shape (N, 3)
        Points in the order of a Hilbert curve, near the origin.
    n_clusters : int
        How many centroids, 1 … N.
    init : {"random", "k-means++", "spread"} or array_like of shape (c, 3)
        As in :func:`meshlab_filter.clustering.kmeans`.
    offset : numpy.ndarray, shape (3,)
        What was taken from the points, and is to be taken from centroids that are given.
    seed : int
        Seed of the random starts; "spread" and given centroids do not use it.

    Returns
    -------
    Assignment

    Raises
    ------
    InvalidCloudError
        If centroids are given that are not a finite (c, 3) array.
    InvalidParameterError
        If the start is unknown or has the wrong number of centroids.
    """
    if not isinstance(init, str):
        given = check_points(init, name="start centroids")
        if len(given) != n_clusters:
            raise InvalidParameterError(
                f"Invalid init. Must have one row for each of {n_clusters} clusters. "
                f"Given: {len(given)} rows."
            )
        return Assignment(points, given - offset)
    init = check_choice(init, name="init", choices=INITS)
    if init == "spread":
        return _spread(points, n_clusters)
    rng = np.random.default_rng(seed)
    if init == "random":
        drawn = np.sort(rng.choice(len(points), n_clusters, replace=False))
    else:
        drawn = _plus_plus(points, n_clusters, rng)
    return Assignment(points, points[drawn])


def cluster_means(points: FloatArray, labels: IntArray, centroids: FloatArray) -> FloatArray:
    """Return the mean of each cluster, or its centroid where no point has its label.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [2, 0, 0]])
    >>> cluster_means(points, np.array([0, 0]), np.array([[0.0, 0, 0], [9, 9, 9]])).tolist()
    [[1.0, 0.0, 0.0], [9.0, 9.0, 9.0]]
    """
    c = len(centroids)
    counts = np.bincount(labels, minlength=c)
    sums = np.stack([np.bincount(labels, points[:, axis], c) for axis in range(3)], axis=1)
    return np.where(counts[:, None] > 0, sums / np.maximum(counts, 1)[:, None], centroids)


def _spread(points: FloatArray, n_clusters: int) -> Assignment:
    """Start from means of equal runs along the curve, then move centroids to where they matter.

    Lloyd's algorithm cannot carry a centroid across others. So after a few of its passes the
    centroids that are missed least move to the clusters of largest inertia and halve them, as in
    B. Fritzke, "The LBG-U method for vector quantization", Neural Processing Letters 5, 1997, but
    many at a time.
    """
    n = len(points)
    runs = np.arange(n, dtype=np.int64) * n_clusters // n
    starts = np.flatnonzero(np.diff(runs, prepend=-1))
    means = np.add.reduceat(points, starts, axis=0) / np.bincount(runs)[:, None]
    assignment = Assignment(points, means, guess=runs)
    for _ in range(_SPREAD_ROUNDS if n_clusters > 1 else 0):
        for _ in range(_SPREAD_PASSES):
            assignment.move(cluster_means(points, assignment.labels, assignment.centroids))
        assignment.move(_relocated(points, assignment))
    return assignment


def _relocated(points: FloatArray, assignment: Assignment) -> FloatArray:
    """Return the centroids after those missed least have moved to halve the worst clusters."""
    from scipy.spatial import cKDTree

    labels, centroids = assignment.labels, assignment.centroids
    c = len(centroids)
    counts = np.bincount(labels, minlength=c)
    inertia = np.bincount(labels, assignment.distances() ** 2, c)
    distances, near = cKDTree(centroids).query(centroids, k=np.arange(1, min(7, c) + 1), workers=-1)
    # Giving m points to a centroid at distance d raises their inertia by m d² (Huygens).
    cost = counts * distances[:, 1] ** 2
    around = np.where(near == np.arange(c)[:, None], np.inf, cost[near])
    # No two that go are neighbours, so that each leaves its points somebody to go to.
    leave = np.flatnonzero(cost < around.min(axis=1))
    leave = leave[np.argsort(cost[leave], kind="stable")]
    stays = np.ones(c, dtype=bool)
    stays[leave] = False
    halve = np.argsort(-inertia, kind="stable")
    halve = halve[stays[halve]][: len(leave)]
    worth = cost[leave[: len(halve)]] < _WORTH * inertia[halve]
    # Costs rise and inertias fall, so those worth it come first.
    leave, halve = leave[: worth.sum()], halve[: worth.sum()]
    step = _half_widths(points, assignment, halve, counts)
    moved = centroids.copy()
    moved[leave] = centroids[halve] + step
    moved[halve] -= step
    return moved


def _half_widths(
    points: FloatArray, assignment: Assignment, which: IntArray, counts: IntArray
) -> FloatArray:
    """Return for some clusters the vector to the centre of one half across its longest axis."""
    place = np.full(len(counts), -1)
    place[which] = np.arange(len(which))
    rows = np.flatnonzero(place[assignment.labels] >= 0)
    mine = place[assignment.labels[rows]]
    away = points[rows] - assignment.centroids[assignment.labels[rows]]
    covariance = np.empty((len(which), 3, 3))
    for i in range(3):
        for j in range(3):
            covariance[:, i, j] = np.bincount(mine, away[:, i] * away[:, j], len(which))
    variances, axes = np.linalg.eigh(covariance / counts[which][:, None, None])
    axis = axes[:, :, 2]
    # An eigenvector has no sign of its own: its largest component is made positive.
    largest = np.abs(axis).argmax(axis=1)
    axis = axis * np.sign(axis[np.arange(len(which)), largest])[:, None]
    # The mean of half a normal distribution is √(2/π) standard deviations from the centre.
    return np.asarray(axis * np.sqrt(np.maximum(variances[:, 2:], 0) * (2 / np.pi)))


def _plus_plus(points: FloatArray, n_clusters: int, rng: np.random.Generator) -> IntArray:
    """Return the indices of centroids drawn by k-means++.

    The points lie in blocks along the curve. A new centroid can only change the squared
    distances in blocks whose box is nearer to it than the largest of them, so a draw costs about
    the number of blocks rather than the number of points.
    """
    n = len(points)
    size = max(16, round(np.sqrt(n) / 4))
    starts = np.arange(0, n, size)
    low = np.minimum.reduceat(points, starts, axis=0)
    high = np.maximum.reduceat(points, starts, axis=0)
    squared = np.full(n, np.inf)
    largest = np.full(len(starts), np.inf)
    totals = np.zeros(len(starts))
    chosen = np.empty(n_clusters, dtype=np.int64)
    offsets = np.arange(size)
    pick = int(rng.integers(n))
    for draw in range(n_clusters):
        chosen[draw] = pick
        centre = points[pick]
        gap = np.maximum(low - centre, 0) + np.maximum(centre - high, 0)
        near = np.flatnonzero((gap * gap).sum(axis=1) < largest)
        rows = np.minimum(starts[near, None] + offsets, n - 1)
        reached = np.minimum(squared[rows], ((points[rows] - centre) ** 2).sum(axis=2))
        squared[rows] = reached
        largest[near] = reached.max(axis=1)
        # The last block is padded with its last point, which must not weigh more than once.
        totals[near] = np.where(starts[near, None] + offsets < n, reached, 0).sum(axis=1)
        cumulated = np.cumsum(totals)
        if cumulated[-1] == 0:
            # Every point lies on a centroid: k-means finds out what that means for its clusters.
            rest = np.setdiff1d(np.arange(n), chosen[: draw + 1])
            chosen[draw + 1 :] = rest[: n_clusters - draw - 1]
            break
        pick = _draw(squared, cumulated, float(rng.random()), size)
    return chosen


def _draw(squared: FloatArray, cumulated: FloatArray, uniform: float, size: int) -> int:
    """Return the point at a share of the summed squared distances, found block by block."""
    target = uniform * cumulated[-1]
    block = min(int(np.searchsorted(cumulated, target, side="right")), len(cumulated) - 1)
    inside = np.cumsum(squared[block * size : (block + 1) * size])
    rest = target - (cumulated[block - 1] if block else 0.0)
    # Rounding may put the share at or beyond the end of the block: its last point of weight.
    within = np.searchsorted(inside, min(rest, np.nextafter(inside[-1], 0)), side="right")
    return block * size + int(within)
