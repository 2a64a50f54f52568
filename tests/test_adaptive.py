"""The adaptive method: exact counts, one order for all counts, and what it keeps."""

import hypothesis.strategies as st
import numpy as np
import numpy.testing as npt
import pytest
from hypothesis import given, settings

from meshlab_filter.errors import InvalidCloudError, InvalidParameterError
from meshlab_filter.methods.adaptive import rank


def sphere(size, seed=0):
    p = np.random.default_rng(seed).normal(size=(size, 3))
    return p / np.linalg.norm(p, axis=1, keepdims=True)


def grid(side, height=lambda x, y: 0 * x):
    x, y = (a.ravel() for a in np.meshgrid(*2 * [np.linspace(-1, 1, side)]))
    return np.column_stack([x, y, height(x, y)])


@pytest.mark.parametrize("size", [1, 2, 3, 7, 8, 9, 30, 200])
def test_rank_is_a_permutation(size):
    """Every point has its own rank, for the smallest clouds too."""
    ranking = rank(sphere(size))
    npt.assert_array_equal(np.sort(ranking.rank), np.arange(size))
    assert ranking.threshold == 0


@pytest.mark.parametrize("count", [1, 5, 7, 8, 100, 299, 300])
def test_count_is_exact_and_a_prefix_of_the_full_run(count):
    """Stopping at a count removes the same points in the same order as running on."""
    cloud = sphere(300)
    full, stopped = rank(cloud), rank(cloud, count=count)
    assert len(stopped.indices) == count
    npt.assert_array_equal(np.sort(stopped.rank), np.arange(300))
    removed = stopped.rank < stopped.threshold
    npt.assert_array_equal(stopped.rank[removed], full.rank[removed])


@settings(max_examples=30, deadline=None)
@given(
    cells=st.lists(st.tuples(*3 * [st.integers(0, 3)]), min_size=1, max_size=60),
    seed=st.integers(0, 5),
)
def test_duplicates_and_degenerate_clouds(cells, seed):
    """Coincident, collinear and coplanar points are ranked without a warning or an error."""
    ranking = rank(np.array(cells, dtype=float), seed=seed)
    npt.assert_array_equal(np.sort(ranking.rank), np.arange(len(cells)))


@pytest.mark.parametrize(
    "move",
    [
        lambda p: p * 1e-6,
        lambda p: p * 1e6,
        lambda p: p + np.array([5e5, 4e6, 100.0]),
        lambda p: p @ np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0],
    ],
    ids=["small", "large", "far away", "turned"],
)
def test_invariant_to_scale_place_and_rotation(move):
    """Nearly all points keep their rank class wherever the cloud is and whatever its unit."""
    cloud = sphere(600) * [1, 0.7, 0.4]
    here, there = rank(cloud, count=200).indices, rank(move(cloud), count=200).indices
    assert len(np.intersect1d(here, there)) >= 195


def test_same_on_one_core_and_many(monkeypatch):
    """The number of threads has no effect."""
    cloud = sphere(3000)
    many = rank(cloud, count=1000).rank
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    npt.assert_array_equal(rank(cloud, count=1000).rank, many)


def test_seed_breaks_ties():
    """Another seed gives another order of equal points; the same seed the same."""
    flat = grid(15)
    npt.assert_array_equal(rank(flat, seed=3).rank, rank(flat, seed=3).rank)
    assert (rank(flat, seed=3).rank != rank(flat, seed=4).rank).any()


def test_signs_of_normals_do_not_matter():
    """The cost looks at tangent planes, which have no sign."""
    cloud = sphere(500)
    signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(500, 1))
    npt.assert_array_equal(rank(cloud, normals=cloud).rank, rank(cloud, normals=cloud * signs).rank)


def test_progress_ends_at_one():
    """Progress never falls and ends at one."""
    seen = []
    rank(sphere(300), count=30, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"count": 0}, InvalidParameterError, "Invalid count. Must be at least 1. Given: 0"),
        ({"count": 21}, InvalidParameterError, "Invalid count. Must be at most 20. Given: 21"),
        ({"evenness": -1}, InvalidParameterError, "Invalid evenness"),
        ({"crease_safety": np.nan}, InvalidParameterError, "Invalid crease_safety"),
        ({"normals": np.ones((3, 3))}, InvalidCloudError, "one for each of the 20 points"),
    ],
)
def test_refuses(options, error, message):
    """Unusable parameters are named together with what was given."""
    with pytest.raises(error, match=message):
        rank(sphere(20), **options)
