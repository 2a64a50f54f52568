"""Mahdaoui et al. 2018: inside each cluster, take away what changes its entropy least."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..clustering import kmeans
from ..entropy import default_k
from ..errors import InvalidParameterError
from ..validation import FloatArray, IntArray, check_integer, check_number, check_points
from .ranking import Ranking
from .selection import check_count, diagonal


def rank(
    points: npt.ArrayLike,
    *,
    normals: npt.ArrayLike | None = None,
    count: int | None = None,
    seed: int = 0,
    clusters: int | None = None,
    k: int | None = None,
    threshold: float | None = None,
) -> Ranking:
    """Rank points by how much their cluster's entropy changes without them.

    k-means splits the cloud into clusters R. With the normalised entropy H of the k-NN density, a
    point i has ΔH = |H(R) − H(R without i)|; the points of least ΔH go first.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    normals : array_like, optional
        Taken for the sake of the common interface; not used.
    count : int, optional
        Points to keep, met exactly; ``threshold`` must not be given then.
    seed : int
        Of the random start of k-means.
    clusters : int, optional
        Number of clusters; 5 % of the points where it is not given.
    k : int, optional
        Which neighbour gives the density; the cluster's rounded root where it is not given.
    threshold : float, optional
        Points with a ΔH of at most this go; in nats. Without it and a count none is cut.

    Returns
    -------
    Ranking
        A total order by ΔH; ``labels`` are the clusters.

    Raises
    ------
    InvalidCloudError
        If the points are not finite or there are fewer distinct ones than clusters.
    InvalidParameterError
        If a parameter is out of range, or both count and threshold are given.

    Notes
    -----
    Source: A. Mahdaoui, A. Marhraoui Hsaini, A. Bouazi and E. H. Sbai, "Entropic method for 3D
    point cloud simplification", Innovations in Smart Cities and Applications, 2018. Chosen here:
    the entropy is that of :mod:`meshlab_filter.entropy`, k stays as it is when a point is left
    out, all ΔH are taken against the whole cluster, and clusters of fewer than three points,
    which have no entropy without one of them, are never touched before all others are gone.

    Examples
    --------
    >>> points = np.random.default_rng(0).random((200, 3))
    >>> len(rank(points, count=60).indices)
    60
    """
    cloud = check_points(points)
    count = check_count(count, len(cloud))
    seed = check_integer(seed, name="seed", minimum=0)
    if k is not None:
        k = check_integer(k, name="k", minimum=1)
    if threshold is not None:
        threshold = check_number(threshold, name="threshold", minimum=0.0)
        if count is not None:
            raise InvalidParameterError(
                "Invalid threshold. Must be left out where a count is given. "
                f"Given: {threshold} and {count}."
            )
    if clusters is None:
        clusters = min(max(1, round(0.05 * len(cloud))), len(np.unique(cloud, axis=0)))
    labels = kmeans(cloud, clusters, init="random", seed=seed).labels
    change = entropy_change(cloud, labels, k=k)
    order = np.lexsort((np.arange(len(cloud)), change))
    place = np.empty(len(cloud), dtype=np.int64)
    place[order] = np.arange(len(cloud))
    cut = 0 if count is None else len(cloud) - count
    if threshold is not None:
        cut = int((change <= threshold).sum())
    return Ranking(
        rank=place, threshold=cut, labels=labels, info={"clusters": int(labels.max()) + 1}
    )


def entropy_change(points: FloatArray, labels: IntArray, *, k: int | None = None) -> FloatArray:
    """Return how much the entropy of each point's cluster changes without the point.

    With weights w = R_k^-3 the shares are q = w / Σw and the entropy is ln Σw − Σ w ln w / Σw.
    Leaving a point out takes its own weight from the sums, and those that had it among their k
    nearest look one neighbour farther.

    Parameters
    ----------
    points : numpy.ndarray, shape (N, 3)
        Coordinates in any unit of length.
    labels : numpy.ndarray, shape (N,), int64
        The cluster of each point, from 0.
    k : int, optional
        Which neighbour gives the density, at most two fewer than the cluster has points; the
        cluster's rounded root where it is not given.

    Returns
    -------
    numpy.ndarray, shape (N,), float64
        In nats; infinite in clusters of fewer than three points.

    Examples
    --------
    The middle one of three evenly spaced points changes the entropy as the outer two do, which all
    leave two equal shares: from ln 3 to ln 2.

    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    >>> entropy_change(points, np.zeros(3, dtype=int), k=1) / np.log(1.5)
    array([1., 1., 1.])
    """
    from scipy.spatial import cKDTree

    size = np.bincount(labels)
    ks = default_k(size) if k is None else np.full(len(size), k)
    ks = np.clip(ks, 1, np.maximum(size - 2, 1))
    large = size[labels] >= 3
    # A fourth coordinate keeps the clusters apart, so that one tree finds all neighbours.
    apart = labels * (4.0 * (diagonal(points) or 1.0))
    most = int(ks.max()) + 2
    away, near = cKDTree(np.column_stack([points, apart])).query(
        np.column_stack([points, apart]), k=min(most, len(points)), workers=-1
    )
    away, near = _without_self(away, near)
    row = np.arange(len(points))
    reach = np.minimum(ks[labels], away.shape[1] - 1)
    smallest = away[large][away[large] > 0].min(initial=np.inf)
    floor = smallest if np.isfinite(smallest) else 1.0
    radius = np.maximum(away[row, reach - 1], floor)
    farther = np.maximum(away[row, reach], floor)
    weight, other = (radius / floor) ** -3.0, (farther / floor) ** -3.0
    weighted, otherwise = weight * np.log(weight), other * np.log(other)

    def without(values: FloatArray, replaced: FloatArray) -> FloatArray:
        """Return the sum over the cluster of each point, without the point."""
        total = np.bincount(labels, weights=values)[labels] - values
        used = np.arange(away.shape[1]) < reach[:, None]
        gain = np.repeat(replaced - values, used.sum(axis=1))
        result: FloatArray = total + np.bincount(near[used], weights=gain, minlength=len(points))
        return result

    whole = np.bincount(labels, weights=weight)
    entropy = (np.log(whole) - np.bincount(labels, weights=weighted) / whole)[labels]
    change = np.full(len(points), np.inf)
    rest = np.where(large, without(weight, other), 1.0)
    left = np.log(rest) - without(weighted, otherwise) / rest
    change[large] = np.abs(entropy - left)[large]
    return change


def _without_self(away: FloatArray, near: IntArray) -> tuple[FloatArray, IntArray]:
    """Drop each point from its own neighbours; of many duplicates that hide it, the last."""
    other = near != np.arange(len(near))[:, None]
    other[other.all(axis=1), -1] = False
    shape = (len(near), near.shape[1] - 1)
    return away[other].reshape(shape), near[other].reshape(shape).astype(np.int64)
