"""k-means in three dimensions for very many small clusters.

Lloyd's algorithm, in which a point compares itself with a few centroids rather than all of them
and after the first passes mostly with none, and which still gives every point its nearest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .assignment import Assignment
from .errors import InvalidCloudError
from .hilbert import hilbert_order
from .seeding import cluster_means, start
from .validation import FloatArray, IntArray, check_integer, check_number, check_points


@dataclass(frozen=True, kw_only=True)
class Clustering:
    """A partition of a cloud into clusters, each point with its nearest centroid.

    Attributes
    ----------
    labels : numpy.ndarray, shape (N,), int64
        The cluster of each point, 0 … c − 1; every cluster has a point.
    centroids : numpy.ndarray, shape (c, 3), float64
        In the unit of the points.
    inertia : float
        Sum of squared distances of the points to their centroids, unit of length squared.
    n_iter : int
        Passes of Lloyd's algorithm that were made.
    converged : bool
        Whether it stopped by itself rather than at ``max_iter``.
    """

    labels: IntArray
    centroids: FloatArray
    inertia: float
    n_iter: int
    converged: bool


def kmeans(
    points: npt.ArrayLike,
    n_clusters: int,
    *,
    init: str | npt.ArrayLike = "random",
    max_iter: int = 100,
    tol: float = 1e-4,
    seed: int = 0,
    progress: Callable[[float], object] | None = None,
) -> Clustering:
    """Partition points into clusters around their means by Lloyd's algorithm [1]_.

    ``max_iter``, ``tol`` and ``n_iter`` mean what they mean in scikit-learn's ``KMeans``, and from
    the same start the labels and the inertia are those of its ``algorithm="lloyd"``.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length. They are moved to the origin before use, so that large
        offsets (UTM coordinates) cost no accuracy.
    n_clusters : int
        How many clusters, 1 … N.
    init : {"random", "k-means++", "spread"} or array_like of shape (c, 3)
        The start: points drawn at random; points drawn with probability proportional to the
        squared distance to those drawn before [2]_; means of equal runs of points along a Hilbert
        curve, which are spread as the points are; or the centroids themselves.
    max_iter : int
        The most passes.
    tol : float
        Stop when the squared shifts of all centroids add up to at most ``tol`` times the mean
        variance of the coordinates; it also stops when no label changes.
    seed : int
        Seed of the random start.
    progress : callable, optional
        Called with the share of the passes that is done, 0 … 1.

    Returns
    -------
    Clustering

    Raises
    ------
    InvalidCloudError
        If there are fewer points, or fewer distinct ones, than clusters.
    InvalidParameterError
        If a parameter is out of range.

    Notes
    -----
    A centroid that no point is nearest to moves to the point that lies farthest from its own
    centroid, so no cluster is ever empty.

    References
    ----------
    .. [1] S. Lloyd, "Least squares quantization in PCM", IEEE Transactions on Information Theory
       28(2), 1982.
    .. [2] D. Arthur and S. Vassilvitskii, "k-means++: the advantages of careful seeding", SODA
       2007.

    Examples
    --------
    >>> result = kmeans([[0, 0, 0], [0, 0, 2], [9, 9, 0], [9, 9, 2]], 2, init="spread")
    >>> result.labels.tolist()
    [0, 0, 1, 1]
    >>> result.centroids.tolist()
    [[0.0, 0.0, 1.0], [9.0, 9.0, 1.0]]
    >>> result.inertia
    4.0
    """
    array = check_points(points)
    n_clusters = check_integer(n_clusters, name="clusters", minimum=1)
    max_iter = check_integer(max_iter, name="max_iter", minimum=1)
    tol = check_number(tol, name="tol", minimum=0)
    seed = check_integer(seed, name="seed", minimum=0)
    if n_clusters > len(array):
        raise InvalidCloudError(
            f"Too few points. Must be at least one for each of {n_clusters} clusters. "
            f"Given: {len(array)}."
        )
    order = hilbert_order(array)
    # Taking away one of the coordinates rather than their mean is exact for points on a grid.
    offset = array.min(axis=0)
    local = array[order]
    local -= offset
    shift_limit = tol * float(local.var(axis=0).mean())
    assignment = start(local, n_clusters, init=init, offset=offset, seed=seed)

    converged = False
    n_iter = 0
    while not converged and n_iter < max_iter:
        n_iter += 1
        moved = _means(local, assignment)
        shift = float(((moved - assignment.centroids) ** 2).sum())
        changed = assignment.move(moved)
        converged = shift <= shift_limit
        if not converged and changed == 0:
            # The next pass would change nothing; scikit-learn makes it to find that out.
            converged = True
            n_iter = min(n_iter + 1, max_iter)
        if progress is not None:
            progress(n_iter / max_iter)
    _fill_empty(local, assignment)
    labels = np.empty(len(array), dtype=np.int64)
    labels[order] = assignment.labels
    return Clustering(
        labels=labels,
        centroids=assignment.centroids + offset,
        inertia=float((assignment.distances() ** 2).sum()),
        n_iter=n_iter,
        converged=converged,
    )


def _means(points: FloatArray, assignment: Assignment) -> FloatArray:
    """Return the mean of each cluster; empty ones take over the points farthest from theirs."""
    labels, c = assignment.labels, len(assignment.centroids)
    empty = np.flatnonzero(np.bincount(labels, minlength=c) == 0)
    if len(empty):
        taken = _farthest(points, assignment, len(empty))
        labels = labels.copy()
        labels[taken] = empty[: len(taken)]
    # A cluster can only stay empty where distinct points run out; _fill_empty says so later.
    return cluster_means(points, labels, assignment.centroids)


def _farthest(points: FloatArray, assignment: Assignment, count: int) -> IntArray:
    """Return up to ``count`` distinct points far from their centroids, none its cluster's last.

    The point nearest each centroid stays with it, so that giving the others away empties nobody.
    """
    labels, distances = assignment.labels, assignment.distances()
    order = np.lexsort((distances, labels))
    stays = np.ones(len(order), dtype=bool)
    stays[1:] = labels[order[1:]] != labels[order[:-1]]
    free = order[~stays]
    free = free[distances[free] > 0]
    free = free[np.lexsort((free, -distances[free]))]
    # Equal points compete for one centroid: only one of them may start a cluster.
    head = free[: 4 * count + 64]
    first = np.unique(points[head], axis=0, return_index=True)[1]
    return head[np.sort(first)][:count]


def _fill_empty(points: FloatArray, assignment: Assignment) -> None:
    """Move centroids until every one has a point.

    Each round puts an idle centroid on a point it was away from, so the inertia falls with every
    round and the rounds end.
    """
    c = len(assignment.centroids)
    while True:
        empty = np.flatnonzero(np.bincount(assignment.labels, minlength=c) == 0)
        if not len(empty):
            return
        taken = _farthest(points, assignment, len(empty))
        if not len(taken):
            distinct = len(np.unique(points, axis=0))
            raise InvalidCloudError(
                f"Too few distinct points. Must be at least one for each of {c} clusters. "
                f"Given: {distinct} distinct among {len(points)}."
            )
        centroids = assignment.centroids.copy()
        centroids[empty[: len(taken)]] = points[taken]
        assignment.move(centroids)
