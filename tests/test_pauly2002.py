"""Pauly et al. 2002 against cases worked out by hand."""

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter.methods.pauly2002 import rank

LINE = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [10, 0, 0], [11, 0, 0.0], [12, 0, 0]])


def test_regions_are_split_across_their_extent():
    """Seven points split at their mean, 5.57; of each half the point nearest its mean stays."""
    result = rank(LINE, size=4)
    npt.assert_array_equal(result.labels[:4] == result.labels[0], True)
    assert len(set(result.labels)) == 2
    assert result.indices[1] == 5


def test_count_splits_the_largest_first():
    """The half of four points is split before the half of three."""
    labels = rank(LINE, count=3).labels
    assert len({labels[0], labels[2], labels[4]}) == 3
    assert labels[0] == labels[1]
    assert labels[2] == labels[3]
    assert labels[4] == labels[5] == labels[6]


def test_bent_regions_are_split_further():
    """Four corners of a tetrahedron have the variation 1/3: a lower limit splits them, 1/3 not."""
    points = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    assert len(rank(points, size=4).indices) == 1
    assert len(rank(points, size=4, variation=0.3).indices) > 1


@pytest.mark.parametrize("size", [1, 5, 50])
def test_no_region_is_too_large(size):
    """Every region has at most so many points, and one of them stays."""
    points = np.random.default_rng(0).random((300, 3))
    result = rank(points, size=size)
    members = np.bincount(result.labels)
    assert members.max() <= size
    npt.assert_array_equal(np.sort(result.labels[result.indices]), np.arange(len(members)))


def test_bent_parts_get_more_points():
    """With a limit on the variation the ridge of a roof is sampled more densely than its slopes."""
    x, y = np.mgrid[-15:16, 0:31].reshape(2, -1)
    points = np.column_stack([x, y, -abs(x)]).astype(float)
    kept = rank(points, size=30, variation=0.02).indices
    assert (abs(x[kept]) <= 2).mean() > 1.5 * (abs(x) <= 2).mean()
