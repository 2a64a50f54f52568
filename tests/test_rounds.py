"""Removal in rounds against removal one by one."""

import numpy as np
import numpy.testing as npt
import pytest
from scipy.spatial import cKDTree

from meshlab_filter.methods.rounds import remove_in_rounds


def gap_of(points):
    """Return the information of a point as the distance to its nearest neighbour."""

    def gap(left, near):
        return np.linalg.norm(points[left] - points[left[near[:, 0]]], axis=1)

    return gap


def test_only_the_least_of_its_neighbours_goes():
    """Of two near pairs one point each goes first, the nearer pair's before the other's."""
    x = np.array([0.0, 1.0, 1.25, 10, 20, 30, 30.5, 40, 50, 60, 70, 80])
    points = np.column_stack([x, 0 * x, 0 * x])
    order = remove_in_rounds(points, gap_of(points), neighbors=1, count=10, seed=0)
    assert set(order[:2]) <= {1, 2, 5, 6}
    assert order[0] in (1, 2)
    assert order[1] in (5, 6)


def test_points_left_are_apart():
    """Half of a random cloud, thinned by its gaps, has fewer near pairs than a random half."""
    points = np.random.default_rng(0).random((400, 3))
    order = remove_in_rounds(points, gap_of(points), neighbors=2, count=200, seed=0)

    def smallest(kept):
        return np.sort(cKDTree(points[kept]).query(points[kept], k=2)[0][:, 1])[:20].mean()

    assert smallest(order[200:]) > 2 * smallest(np.arange(200))


@pytest.mark.parametrize("count", [None, 1, 7, 60])
def test_every_point_has_its_turn(count):
    """The order is a permutation, whatever is kept."""
    points = np.random.default_rng(1).random((60, 3))
    order = remove_in_rounds(points, gap_of(points), neighbors=3, count=count, seed=0)
    npt.assert_array_equal(np.sort(order), np.arange(60))


def test_seed_decides_between_equals():
    """Points that all tell the same go in an order that depends on the seed alone."""
    points = np.random.default_rng(1).random((60, 3))

    def nothing(left, near):
        return np.zeros(len(left))

    first, again, other = (
        remove_in_rounds(points, nothing, neighbors=3, count=20, seed=seed) for seed in (0, 0, 1)
    )
    npt.assert_array_equal(first, again)
    assert (first != other).any()
