"""The paper's rule: clusters of low k-NN entropy are deleted whole (Algorithm 1).

A. Mahdaoui and E. H. Sbai, "3D Point Cloud Simplification Based on k-Nearest Neighbor and
Clustering", Advances in Multimedia 2020, article 8825205, doi 10.1155/2020/8825205.
"""

from __future__ import annotations

import numbers
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ..clustering import Clustering, kmeans
from ..entropy import cluster_entropy
from ..errors import InvalidCloudError, InvalidParameterError
from ..validation import (
    FloatArray,
    IntArray,
    check_integer,
    check_number,
    check_points,
    check_switch,
)
from .ranking import Ranking

# "The size of the clusters is 5 %": 20 points to a cluster on average.
_CLUSTER_SHARE = 0.05


def rank(
    points: npt.ArrayLike,
    *,
    normals: npt.ArrayLike | None = None,
    clusters: int | None = None,
    delete: int | float | None = None,
    count: int | None = None,
    k: int | None = None,
    init: str | npt.ArrayLike = "random",
    max_iter: int = 100,
    tol: float = 1e-4,
    definition: str = "normalized",
    keep_representative: bool = False,
    seed: int = 0,
    progress: Callable[[float], object] | None = None,
) -> Ranking:
    """Rank points by the entropy of their cluster: those of the lowest go first, together.

    k-means splits the cloud, every cluster gets the entropy of the k-NN density of its points, and
    the clusters of lowest entropy are deleted whole. Say how many with either ``delete`` or
    ``count``; without both the points are ranked and none is deleted.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    normals : array_like, optional
        Not used; every method takes it.
    clusters : int, optional
        How many clusters. Defaults to 5 % of the points, at least 1 and at most as many as there
        are distinct points.
    delete : int or float, optional
        How many clusters are deleted, or which share of them, more than 0 and less than 1.
    count : int, optional
        How many points to keep, reached as nearly as whole clusters allow.
    k : int, optional
        Which neighbour gives the density. Defaults to √m rounded in a cluster of m points.
    init, max_iter, tol
        As in :func:`meshlab_filter.clustering.kmeans`.
    definition : {"normalized", "differential", "raw"}
        As in :func:`meshlab_filter.entropy.cluster_entropy`.
    keep_representative : bool
        Leave the point nearest the centroid of each deleted cluster.
    seed : int
        Seed of the random start of the clustering.
    progress : callable, optional
        Called with the share of the work that is done, from 0 to 1.

    Returns
    -------
    Ranking
        ``rank`` is the place of the point's cluster in ascending order of entropy, ties by the
        number of the cluster, 0 … c − 1; a representative of a deleted cluster has rank c.
        ``threshold`` is how many clusters are deleted. ``info`` has ``clusters``, ``deleted``,
        ``missed`` (points kept beyond those asked for, negative if fewer; 0 with ``delete``),
        ``inertia``, ``iterations`` and ``converged``.

    Raises
    ------
    InvalidCloudError
        If there are fewer points, or fewer distinct ones, than clusters.
    InvalidParameterError
        If a parameter is out of range, or more clusters are to be deleted than have an entropy.

    Notes
    -----
    A cluster of one point has no density, hence no entropy: it ranks above the others and is
    never deleted.

    Examples
    --------
    Two clusters of four points on a line, the first evenly spaced, the other not: the uneven one
    has the lower entropy.

    >>> x = [0, 1, 2, 3, 100, 101, 102, 108]
    >>> points = [[value, 0, 0] for value in x]
    >>> result = rank(points, clusters=2, delete=1, init="spread")
    >>> result.indices.tolist()
    [0, 1, 2, 3]
    >>> result.rank.tolist()
    [1, 1, 1, 1, 0, 0, 0, 0]
    """
    array = check_points(points)
    n = len(array)
    report = progress or (lambda done: None)

    def cluster(number: int) -> Clustering:
        # The entropy takes about as long as two or three of the passes.
        return kmeans(
            array,
            number,
            init=init,
            max_iter=max_iter,
            tol=tol,
            seed=seed,
            progress=lambda done: report(0.9 * done),
        )

    keep_representative = check_switch(keep_representative, name="keep_representative")
    given = clusters is not None
    clusters = clusters if given else max(1, round(_CLUSTER_SHARE * n))
    clusters = check_integer(clusters, name="clusters", minimum=1)
    wanted = target_of(n, clusters, delete=delete, count=count)
    try:
        clustering = cluster(clusters)
    except InvalidCloudError:
        # Nobody asked for more clusters than there are distinct points.
        if given:
            raise
        clusters = len(np.unique(array, axis=0))
        wanted = target_of(n, clusters, delete=delete, count=count)
        clustering = cluster(clusters)
    labels = clustering.labels
    entropy = cluster_entropy(array, labels, k=k, definition=definition)
    order = np.argsort(entropy, kind="stable")
    place = np.empty(clusters, dtype=np.int64)
    place[order] = np.arange(clusters)
    deleted = how_many_to_delete(
        np.bincount(labels, minlength=clusters)[order],
        entropy[order],
        wanted,
        keep_representative=keep_representative,
    )
    ranks = place[labels]
    if keep_representative:
        ranks[representatives(array, labels, clustering.centroids, order[:deleted])] = clusters
    kept = int((ranks >= deleted).sum())
    report(1.0)
    return Ranking(
        rank=ranks,
        threshold=deleted,
        labels=labels,
        entropy=entropy,
        info={
            "clusters": clusters,
            "deleted": deleted,
            "missed": kept - wanted["count"] if "count" in wanted else 0,
            "inertia": clustering.inertia,
            "iterations": clustering.n_iter,
            "converged": clustering.converged,
        },
    )


def target_of(n: int, clusters: int, *, delete: Any, count: Any) -> dict[str, int]:
    """Return what is asked for: {"delete": clusters} or {"count": points that stay}."""
    if delete is not None and count is not None:
        raise InvalidParameterError(
            f"Invalid delete. Must be left out where count is given. "
            f"Given: delete={delete}, count={count}."
        )
    if count is not None:
        return {"count": check_integer(count, name="count", minimum=1, maximum=n)}
    if delete is None:
        return {"delete": 0}
    if isinstance(delete, numbers.Integral):
        deleted = check_integer(delete, name="delete", minimum=0)
    else:
        deleted = round(_share(delete) * clusters)
    if deleted >= clusters:
        raise InvalidParameterError(
            f"Invalid delete. Must be less than the {clusters} clusters. Given: {deleted}."
        )
    return {"delete": deleted}


def _share(value: Any) -> float:
    share = check_number(value, name="delete")
    if not 0 < share < 1:
        raise InvalidParameterError(
            f"Invalid delete. A share must be more than 0 and less than 1. Given: {share}."
        )
    return share


def how_many_to_delete(
    sizes: IntArray, entropy: FloatArray, target: dict[str, int], *, keep_representative: bool
) -> int:
    """Return how many of the clusters go, given in the order they go.

    Parameters
    ----------
    sizes : numpy.ndarray, shape (c,), int64
        Points of each cluster.
    entropy : numpy.ndarray, shape (c,)
        Ascending; infinite for clusters that are never deleted.
    target : dict
        As from :func:`target_of`. A count is reached as nearly as whole clusters allow; of two
        numbers of clusters that come equally near, the fewer.
    keep_representative : bool
        Whether each deleted cluster leaves a point.

    Raises
    ------
    InvalidParameterError
        If more clusters are to be deleted than have an entropy.

    Examples
    --------
    >>> sizes, entropy = np.array([3, 5, 4, 1]), np.array([0.5, 0.9, 1.1, np.inf])
    >>> how_many_to_delete(sizes, entropy, {"count": 6}, keep_representative=False)
    2
    """
    deletable = int(np.isfinite(entropy).sum())
    if "delete" in target:
        if target["delete"] > deletable:
            raise InvalidParameterError(
                f"Invalid delete. Must be at most {deletable}, the clusters of more than one "
                f"point out of {len(sizes)}. Given: {target['delete']}."
            )
        return target["delete"]
    losses = sizes[: min(deletable, len(sizes) - 1)] - int(keep_representative)
    left = int(sizes.sum()) - np.concatenate([[0], np.cumsum(losses)])
    return int(np.argmin(np.abs(left - target["count"])))


def representatives(
    points: FloatArray, labels: IntArray, centroids: FloatArray, which: IntArray
) -> IntArray:
    """Return the point nearest the centroid of each of the clusters, the first of equals."""
    chosen = np.zeros(len(centroids), dtype=bool)
    chosen[which] = True
    rows = np.flatnonzero(chosen[labels])
    squared = ((points[rows] - centroids[labels[rows]]) ** 2).sum(axis=1)
    order = np.lexsort((rows, squared, labels[rows]))
    first = np.ones(len(order), dtype=bool)
    first[1:] = labels[rows[order[1:]]] != labels[rows[order[:-1]]]
    return rows[order[first]]
