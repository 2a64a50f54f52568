"""Counts, normals, rankings and the search that the methods share."""

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter.errors import InvalidCloudError
from meshlab_filter.methods.interval import search_grid
from meshlab_filter.methods.selection import (
    check_normals,
    nearest_in_group,
    ranking_from_order,
    ranking_from_subset,
    search_parameter,
)

UP, SIDE = [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]


def test_order_becomes_ranks():
    """The first of the order has rank 0; the threshold keeps the last ones."""
    result = ranking_from_order(np.array([3, 1, 0, 2]), count=1)
    npt.assert_array_equal(result.rank, [2, 1, 3, 0])
    npt.assert_array_equal(result.indices, [2])


def test_order_without_count_keeps_all():
    """Without a count nothing is cut."""
    assert len(ranking_from_order(np.arange(4), count=None).indices) == 4


def test_subset_says_what_was_missed():
    """The difference to the count asked for stands in the figures."""
    result = ranking_from_subset(np.array([1, 2, 5]), 6, count=2, space_interval=0.5)
    npt.assert_array_equal(result.rank, [0, 1, 1, 0, 0, 1])
    assert result.info == {"space_interval": 0.5, "missed": 1}


def test_normals_are_made_unit():
    """The length of a normal does not matter."""
    npt.assert_array_equal(check_normals(np.zeros((2, 3)), [[0, 0, 5], [2, 0, 0]]), [UP, SIDE])


def test_normals_are_estimated_where_there_are_none():
    """On a plane the estimate is the plane's normal."""
    grid = np.mgrid[0:6, 0:6].reshape(2, -1).T
    normals = check_normals(np.column_stack([grid, np.zeros(36)]), None)
    npt.assert_allclose(abs(normals), np.tile(UP, (36, 1)), atol=1e-12)


def test_normals_must_be_as_many_as_points():
    """One normal for two points is refused."""
    with pytest.raises(InvalidCloudError, match="normals"):
        check_normals(np.zeros((2, 3)), [[0, 0, 5]])


def test_nearest_in_group_prefers_the_first_of_equals():
    """Among equal distances the lowest index wins."""
    npt.assert_array_equal(nearest_in_group(np.array([1, 0, 1]), np.zeros(3)), [1, 0])


@pytest.mark.parametrize("start", [0.02, 1.0, 70.0])
@pytest.mark.parametrize("count", [3, 50, 400])
def test_search_finds_the_value(start, count):
    """Wherever it begins, the search ends within one point of the count."""
    _, kept = search_parameter(
        lambda value: np.arange(int(100 / value)), count, start=start, low=0.01, high=100.0
    )
    assert abs(len(kept) - count) <= 1


def test_search_returns_the_nearest_it_can():
    """A count between two plateaus ends on the nearer one."""
    _, kept = search_parameter(
        lambda value: np.arange(10 if value < 1 else 2), 8, start=3.0, low=0.1, high=10.0
    )
    assert len(kept) == 10


def cells(interval, threshold):
    """Return as many points as a surface of area 1 has cells, and more where normals spread."""
    return np.arange(round(interval**-2 + 300 * max(0.0, 1.0 - threshold)))


def grid_search(count, *, free=(True, True), interval=0.1):
    """Search with the cells above, from a threshold of 0.5."""
    return search_grid(
        cells, count, interval=interval, threshold=0.5, loosest=1.0, extent=1.0, free=free
    )


def test_grid_search_prefers_the_interval():
    """A count that the interval alone can meet leaves the threshold as it is."""
    interval, threshold, kept = grid_search(1000)
    assert (threshold, len(kept)) == (0.5, 1000)
    npt.assert_allclose(interval, 850**-0.5, rtol=1e-3)


def test_grid_search_shares_out_small_counts():
    """Where splits alone give too many, the cells give three quarters and the splits the rest."""
    interval, threshold, kept = grid_search(80)
    assert len(kept) == 80
    npt.assert_allclose(interval, 60**-0.5, rtol=1e-2)
    npt.assert_allclose(threshold, 1.0 - 20 / 300, rtol=1e-2)


@pytest.mark.parametrize("count", [110, 380])
def test_grid_search_moves_the_threshold_both_ways(count):
    """With the interval given, 100 cells, the threshold is lowered or raised."""
    interval, _, kept = grid_search(count, free=(False, True))
    assert (interval, len(kept)) == (0.1, count)


def test_grid_search_leaves_what_is_given():
    """With both given there is nothing to search."""
    interval, threshold, kept = grid_search(80, free=(False, False))
    assert (interval, threshold, len(kept)) == (0.1, 0.5, 250)
