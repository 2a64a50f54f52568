"""Mahdaoui et al. 2018 against the definition, point by point."""

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter.entropy import cluster_entropy
from meshlab_filter.errors import InvalidParameterError
from meshlab_filter.methods.mahdaoui2018 import entropy_change, rank


@pytest.mark.parametrize("k", [1, 2, 4])
def test_change_is_that_of_the_definition(k):
    """The closed form equals the entropy computed anew without each point."""
    rng = np.random.default_rng(0)
    points, labels = rng.random((60, 3)), rng.integers(0, 4, 60)
    found = entropy_change(points, labels, k=k)
    whole = cluster_entropy(points, labels, k=k)
    for index in range(60):
        rest = np.arange(60) != index
        left = cluster_entropy(points[rest], labels[rest], k=k)[labels[index]]
        npt.assert_allclose(found[index], abs(whole[labels[index]] - left), rtol=1e-9)


def test_uneven_cluster_by_hand():
    """Points at 0, 1, 3, k = 1: R = 1, 1, 2, so the weights are 1, 1, 1/8."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0]])
    q = np.array([8, 8, 1]) / 17
    whole = -(q * np.log(q)).sum()
    # Two points left see each other at one distance: equal shares, ln 2, whichever goes.
    npt.assert_allclose(entropy_change(points, np.zeros(3, dtype=int), k=1), abs(whole - np.log(2)))


def test_small_clusters_are_left_alone():
    """Without one of its two points a cluster has no entropy."""
    points = np.arange(15.0).reshape(5, 3)
    change = entropy_change(points, np.array([0, 0, 0, 1, 1]))
    assert np.isinf(change[3:]).all()
    assert np.isfinite(change[:3]).all()


def test_threshold_cuts_where_the_change_is_small():
    """A threshold keeps exactly the points whose change exceeds it."""
    points = np.random.default_rng(2).random((200, 3))
    result = rank(points, threshold=0.02, clusters=8)
    change = entropy_change(points, result.labels)
    npt.assert_array_equal(result.indices, np.flatnonzero(change > 0.02))
    assert 0 < len(result.indices) < 200


def test_count_and_threshold_exclude_each_other():
    """Both at once are refused."""
    with pytest.raises(InvalidParameterError, match="left out where a count is given"):
        rank(np.random.default_rng(2).random((20, 3)), threshold=0.02, count=5)
