"""Starts of k-means: the Hilbert curve and k-means++."""

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter.errors import InvalidCloudError
from meshlab_filter.seeding import hilbert_order, start_centroids


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
        drawn = start_centroids(points, 2, init="k-means++", offset=np.zeros(3), seed=seed)
        first, second = (int(np.flatnonzero(points[:, 0] == x)[0]) for x in drawn[:, 0])
        counts[first, second] += 1
    shares = counts / counts.sum(axis=1, keepdims=True)
    npt.assert_allclose(shares, [[0, 0.1, 0.9], [0.2, 0, 0.8], [9 / 13, 4 / 13, 0]], atol=0.06)


def test_plus_plus_blocks_give_all_distances():
    """Drawn centroids are distinct points while there are any, in every block."""
    points = np.random.default_rng(0).normal(size=(500, 3))
    drawn = start_centroids(points, 500, init="k-means++", offset=np.zeros(3), seed=0)
    npt.assert_array_equal(np.unique(drawn, axis=0), np.unique(points, axis=0))


def test_spread_follows_the_points():
    """Every start of a spread is the mean of as many points."""
    points = np.random.default_rng(0).normal(size=(1000, 3))
    start = start_centroids(points, 50, init="spread", offset=np.zeros(3), seed=0)
    npt.assert_allclose(start.mean(axis=0), points.mean(axis=0), atol=1e-12)
    assert len(np.unique(start, axis=0)) == 50


def test_given_start_must_be_finite():
    """A start with NaN is named as what it is."""
    with pytest.raises(InvalidCloudError, match="Invalid start centroids"):
        start_centroids(np.eye(3), 1, init=[[np.nan, 0, 0]], offset=np.zeros(3), seed=0)
