"""From points to the indices of those that stay."""

import numpy as np
import numpy.testing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshlab_filter.amounts import parse_amount, points_to_keep
from meshlab_filter.errors import InvalidCloudError, InvalidParameterError
from meshlab_filter.simplification import simplify


def cloud(count=600, seed=0):
    """Return points on a wavy sheet."""
    xy = np.random.default_rng(seed).random((count, 2))
    return np.column_stack([xy, 0.1 * np.sin(9 * xy[:, 0])])


@given(st.integers(3, 300), st.data())
@settings(max_examples=25, deadline=None)
def test_a_count_is_exact_and_a_subset_in_order(total, data):
    """The default method keeps exactly as many points as asked, ascending."""
    count = data.draw(st.integers(1, total))
    result = simplify(cloud(total), count=count)
    assert result.method == "adaptive"
    assert len(result.indices) == count
    assert (np.diff(result.indices) > 0).all()
    npt.assert_array_equal(result.indices, np.flatnonzero(result.rank >= result.threshold))
    assert result.missed == 0


def test_the_paper_is_the_default_where_no_count_is_asked():
    """7.4 % of the clusters, which are 5 % of the points."""
    result = simplify(cloud())
    assert result.method == "cluster-entropy"
    assert len(result.entropy) == 30
    assert result.threshold == round(0.074 * 30)


def test_clusters_of_lowest_entropy_go():
    """What goes is whole clusters, and none that stays has a lower entropy."""
    result = simplify(cloud(), clusters=30, delete=7)
    gone = np.setdiff1d(result.labels, result.labels[result.indices])
    assert len(gone) == 7
    assert result.entropy[gone].max() <= np.delete(result.entropy, gone).min()


def test_a_count_with_clusters_is_approached():
    """Asking the paper's rule for a count says by how much it missed."""
    result = simplify(cloud(), clusters=30, count=300)
    assert result.method == "cluster-entropy"
    assert result.missed == len(result.indices) - 300
    assert abs(result.missed) <= np.bincount(result.labels).max()


def test_representatives_stay():
    """Every cluster that is deleted leaves one point."""
    bare = simplify(cloud(), clusters=30, delete=7)
    kept = simplify(cloud(), clusters=30, delete=7, keep_representative=True)
    assert len(kept.indices) == len(bare.indices) + 7
    assert len(np.unique(kept.labels[kept.indices])) == 30


def test_same_seed_same_result():
    """And another seed another one."""
    first, again, other = (simplify(cloud(), clusters=30, delete=7, seed=s) for s in (1, 1, 2))
    npt.assert_array_equal(first.rank, again.rank)
    assert not np.array_equal(first.rank, other.rank)


def test_progress_is_told():
    """Shares rise from 0 to 1 at the most."""
    told = []
    simplify(cloud(), count=60, progress=told.append)
    assert told == sorted(told)
    assert 0 <= told[0] <= told[-1] <= 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"count": 0}, "at least 1"),
        ({"count": 601}, "at most 600"),
        ({"count": 2.5}, "whole number"),
        ({"count": 5, "keep": 0.1}, "Only one"),
        ({"keep": 0.0}, "at least one"),
        ({"keep": 1.5}, "at most 1"),
        ({"keep": 60}, "share"),
        ({"method": "adaptve", "count": 5}, "adaptive"),
        ({"method": "random", "count": 5, "evenness": 1.0}, "evenness"),
        ({"delete": 30, "clusters": 30}, "delete"),
        ({"delete": -1}, "delete"),
        ({"clusters": 0}, "clusters"),
        ({"clusters": 601}, "clusters"),
    ],
)
def test_bad_parameters_are_named(options, message):
    """The sentence names the parameter and what was given."""
    with pytest.raises((InvalidParameterError, InvalidCloudError), match=message) as caught:
        simplify(cloud(), **options)
    assert str(caught.value).count("\n") == 0
    assert "Given" in str(caught.value)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.empty((0, 3)), "at least 3"),
        ([[0, 0, 0], [1, 1, 1]], "at least 3"),
        ([[1, 1, 1]] * 9, "one place"),
        (np.ones((5, 2)), r"shape \(N, 3\)"),
        ([[0, 0, np.nan]] * 4, "finite"),
        ([["a", "b", "c"]] * 4, "numbers"),
    ],
)
def test_bad_clouds_are_named(points, message):
    """The sentence says what is wrong with the points."""
    with pytest.raises(InvalidCloudError, match=message):
        simplify(points, count=2)


def test_bad_normals_are_named():
    """Normals must be one a point, and finite."""
    with pytest.raises(InvalidCloudError, match="normals"):
        simplify(cloud(), normals=np.ones((5, 3)), count=5)


@pytest.mark.parametrize(
    ("text", "value"), [("60", 60), ("0", 0), ("7.4%", 0.074), (" 100% ", 1.0), ("1e1%", 0.1)]
)
def test_amounts(text, value):
    """Whole numbers are numbers, percentages are shares."""
    found = parse_amount(text, name="delete")
    assert found == pytest.approx(value)
    assert type(found) is type(value)


@pytest.mark.parametrize("text", ["", "%", "-5", "7.4", "101%", "-1%", "nan%", "inf%", "a few"])
def test_bad_amounts(text):
    """Anything else is refused with an example of what will do."""
    with pytest.raises(InvalidParameterError, match=r"Invalid delete\..*Given"):
        parse_amount(text, name="delete")


def test_share_is_rounded_to_points():
    """A share asks for the nearest whole number of points."""
    assert points_to_keep(28088, keep=0.1) == 2809
    assert points_to_keep(10) is None
