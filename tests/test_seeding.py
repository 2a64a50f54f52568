"""Starts of k-means: the Hilbert curve and k-means++."""

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter.errors import InvalidCloudError
from meshlab_filter.hilbert import hilbert_order
from meshlab_filter.seeding import start


def grid(size):
    """Every cell of a cube, one point each, shuffled."""
    cells = np.stack(np.meshgrid(*[np.arange(size)] * 3), axis=-1).reshape(-1, 3)
    return np.random.default_rng(0).permutation(cells).astype(float)


@pytest.mark.parametrize("size", [2, 4, 16])
def test_hilbert_curve_goes_from_neighbour_to_neighbour(size):
    """On a full cube each step of the curve is one cell along one axis."""
    points = grid(size)
    order = hilbert_order(points)
    npt.assert_array_equal(np.sort(order), np.arange(size**3))
    npt.assert_array_equal(np.abs(np.diff(points[order], axis=0)).sum(axis=1), 1)


def test_hilbert_order_of_equal_points():
    """Points in one place keep their order."""
    npt.assert_array_equal(hilbert_order(np.ones((5, 3))), np.arange(5))


def test_plus_plus_draws_by_squared_distance():
    """The second centroid is drawn with probability proportional to the squared distance."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0]])
    counts = np.zeros((3, 3))
    for seed in range(3000):
        drawn = start(points, 2, init="k-means++", offset=np.zeros(3), seed=seed).centroids
        first, second = (int(np.flatnonzero(points[:, 0] == x)[0]) for x in drawn[:, 0])
        counts[first, second] += 1
    shares = counts / counts.sum(axis=1, keepdims=True)
    npt.assert_allclose(shares, [[0, 0.1, 0.9], [0.2, 0, 0.8], [9 / 13, 4 / 13, 0]], atol=0.06)


def test_plus_plus_blocks_give_all_distances():
    """Drawn centroids are distinct points while there are any, in every block."""
    points = np.random.default_rng(0).normal(size=(500, 3))
    drawn = start(points, 500, init="k-means++", offset=np.zeros(3), seed=0).centroids
    npt.assert_array_equal(np.unique(drawn, axis=0), np.unique(points, axis=0))


def test_spread_of_many_densities():
    """Where the density varies a spread start is as good as k-means++ or better."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(6000, 3)) * [1, 1, 0.01]
    points = points[hilbert_order(points)]
    inertia = {
        init: (start(points, 300, init=init, offset=np.zeros(3), seed=0).distances() ** 2).sum()
        for init in ("spread", "k-means++")
    }
    assert inertia["spread"] < 0.8 * inertia["k-means++"]


@pytest.mark.parametrize("n_clusters", [1, 2, 5, 999, 1000])
def test_spread_has_every_number_of_clusters(n_clusters):
    """From one cluster to as many as points, the centroids are finite and distinct."""
    points = np.random.default_rng(0).normal(size=(1000, 3))
    centroids = start(points, n_clusters, init="spread", offset=np.zeros(3), seed=0).centroids
    assert len(np.unique(centroids, axis=0)) == n_clusters


def test_given_start_must_be_finite():
    """A start with NaN is named as what it is."""
    with pytest.raises(InvalidCloudError, match="Invalid start centroids"):
        start(np.eye(3), 1, init=[[np.nan, 0, 0]], offset=np.zeros(3), seed=0)
