"""k-NN density inside clusters, and the entropy of clusters made from it (equations 1–7).

A. Mahdaoui and E. H. Sbai, "3D Point Cloud Simplification Based on k-Nearest Neighbor and
Clustering", Advances in Multimedia 2020, article 8825205.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .errors import InvalidParameterError
from .grouping import Groups, kth_distances
from .validation import FloatArray, check_choice, check_integer, check_points

DEFINITIONS = ("normalized", "differential", "raw")
# C_d of equation 3 for d = 3: the volume of the unit ball.
_UNIT_BALL = 4 * np.pi / 3


def knn_density(
    points: npt.ArrayLike, labels: npt.ArrayLike, *, k: int | None = None
) -> FloatArray:
    """Estimate the density at each point from its k nearest neighbours in its own cluster.

    p(x) = k / (m · V_k(x)) with V_k(x) = 4π/3 · R_k(x)³ for a cluster of m points, where R_k(x) is
    the distance from x to its k-th nearest neighbour (equations 1–4 of the paper).

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    labels : array_like, shape (N,), int
        The cluster of each point, 0 or greater.
    k : int, optional
        Which neighbour; never beyond the m − 1 others of the cluster. Defaults to √m rounded to
        the nearest whole number (equation 4).

    Returns
    -------
    numpy.ndarray, shape (N,), float64
        Share of the cluster per unit of length cubed. The only point of a cluster has no density:
        NaN.

    Raises
    ------
    InvalidCloudError
        If the points are not a finite (N, 3) array.
    InvalidParameterError
        If the labels do not fit the points or k is less than 1.

    Notes
    -----
    Where more than k points coincide R_k is 0. They count as being as dense as the densest other
    point of their cluster: R_k is then the smallest positive R_k of the cluster, and if there is
    none, of the cloud, and if there is none, 1.

    Examples
    --------
    Each of two points one unit apart finds half of the cluster in a ball of radius 1.

    >>> knn_density([[0, 0, 0], [1, 0, 0]], [0, 0], k=1)
    array([0.119, 0.119])
    """
    array, groups, ks = _prepare(points, labels, k)
    density = np.empty(len(array))
    density[groups.order] = _density(groups, ks, _radii(array, groups, ks))
    return density


def cluster_entropy(
    points: npt.ArrayLike,
    labels: npt.ArrayLike,
    *,
    k: int | None = None,
    definition: str = "normalized",
) -> FloatArray:
    """Return the entropy of each cluster from the k-NN density of its points.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    labels : array_like, shape (N,), int
        The cluster of each point, 0 … C − 1.
    k : int, optional
        As in :func:`knn_density`.
    definition : {"normalized", "differential", "raw"}
        "normalized" is −Σ q ln q with q = p / Σ p over the cluster (equations 5–7), which does not
        change with scale, translation or rotation; "differential" is the mean of −ln p over the
        cluster; "raw" is −Σ p ln p, whose order depends on the unit of length. The last two are
        there for study.

    Returns
    -------
    numpy.ndarray, shape (C,), float64
        In nats; C is the largest label plus one. A cluster of one point has no density: its
        entropy is infinite, so that deleting the lowest never takes it. The same holds for a
        label without points.

    Raises
    ------
    InvalidCloudError
        If the points are not a finite (N, 3) array.
    InvalidParameterError
        If the labels do not fit the points, k is less than 1 or the definition is unknown.

    Examples
    --------
    Four points at the corners of a square are equally dense: the entropy is ln 4.

    >>> corners = [[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0]]
    >>> cluster_entropy(corners, [0, 0, 0, 0])
    array([1.386])
    """
    definition = check_choice(definition, name="definition", choices=DEFINITIONS)
    array, groups, ks = _prepare(points, labels, k)
    radii = _radii(array, groups, ks)
    several = groups.counts > 1
    entropy = np.full(len(several), np.inf)
    if definition == "normalized":
        # q ∝ R^-3 inside a cluster. R relative to the cluster's smallest keeps the powers in range
        # whatever the unit of length.
        weights = (groups.spread(groups.minimum(radii)) / radii) ** 3
        q = weights / groups.spread(groups.total(weights))
        entropy[several] = groups.total(-_x_log_x(q))[several]
        return entropy
    density = _density(groups, ks, radii)
    if definition == "differential":
        entropy[several] = groups.total(-np.log(density))[several] / groups.counts[several]
    else:
        entropy[several] = groups.total(-_x_log_x(density))[several]
    return entropy


def default_k(counts: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return max(1, √m rounded) for each cluster of m points (equation 4 with k0 = 1)."""
    return np.maximum(np.rint(np.sqrt(counts)).astype(np.int64), 1)


def _prepare(
    points: npt.ArrayLike, labels: npt.ArrayLike, k: int | None
) -> tuple[FloatArray, Groups, npt.NDArray[np.int64]]:
    """Check the arguments; return the points, their groups and the k of each group."""
    array = check_points(points)
    given = np.asarray(labels)
    if given.shape != (len(array),) or given.dtype.kind not in "iu":
        raise InvalidParameterError(
            f"Invalid labels. Must be one whole number for each of {len(array)} points. "
            f"Given: shape {given.shape} of {given.dtype}."
        )
    if given.min() < 0:
        raise InvalidParameterError(
            f"Invalid labels. Must be 0 or greater. Given: {int(given.min())}."
        )
    groups = Groups.of(given.astype(np.int64, copy=False))
    if k is None:
        ks = default_k(groups.counts)
    else:
        ks = np.full(len(groups.counts), check_integer(k, name="k", minimum=1))
    return array, groups, np.minimum(ks, groups.counts - 1)


def _radii(points: FloatArray, groups: Groups, ks: npt.NDArray[np.int64]) -> FloatArray:
    """Return R_k of each point in group order: positive, NaN for the only point of a cluster."""
    radii = kth_distances(points, groups, ks)
    zero = radii == 0
    if zero.any():
        positive = np.where(radii > 0, radii, np.inf)
        smallest = groups.minimum(positive)
        overall = smallest.min()
        smallest[np.isinf(smallest)] = overall if np.isfinite(overall) else 1.0
        radii[zero] = groups.spread(smallest)[zero]
    return radii


def _density(groups: Groups, ks: npt.NDArray[np.int64], radii: FloatArray) -> FloatArray:
    """Return k / (m V_k) of each point in group order (equation 2)."""
    share = ks / np.maximum(groups.counts, 1)
    return groups.spread(share) / (_UNIT_BALL * radii**3)


def _x_log_x(x: FloatArray) -> FloatArray:
    """Return x ln x, and its limit 0 where x vanishes."""
    return np.where(x > 0, x * np.log(np.where(x > 0, x, 1)), np.where(np.isnan(x), x, 0))
