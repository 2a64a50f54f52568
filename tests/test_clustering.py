"""k-means: scikit-learn's result, without empty clusters, at any offset."""

import numpy as np
import numpy.testing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from meshlab_filter.clustering import kmeans
from meshlab_filter.errors import InvalidCloudError, InvalidParameterError

INITS = ["random", "k-means++", "spread"]


def sphere(n, seed=0):
    """Points on the unit sphere, denser towards one pole."""
    rng = np.random.default_rng(seed)
    points = rng.normal(loc=[0, 0, 0.7], size=(n, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


@pytest.mark.parametrize(
    ("n_clusters", "tol", "max_iter"), [(150, 1e-4, 300), (150, 0, 300), (150, 0, 3), (1, 0, 10)]
)
@pytest.mark.filterwarnings("ignore::sklearn.exceptions.ConvergenceWarning")
def test_same_as_scikit_learn(n_clusters, tol, max_iter):
    """From the same start labels, inertia and passes are those of scikit-learn's Lloyd."""
    from sklearn.cluster import KMeans

    points = sphere(3000)
    start = points[np.random.default_rng(1).choice(len(points), n_clusters, replace=False)]
    ours = kmeans(points, n_clusters, init=start, tol=tol, max_iter=max_iter)
    theirs = KMeans(
        n_clusters, init=start, n_init=1, tol=tol, max_iter=max_iter, algorithm="lloyd"
    ).fit(points)
    npt.assert_array_equal(ours.labels, theirs.labels_)
    npt.assert_allclose(ours.inertia, theirs.inertia_, rtol=1e-12)
    npt.assert_allclose(ours.centroids, theirs.cluster_centers_, atol=1e-12)
    assert ours.n_iter == theirs.n_iter_
    assert ours.converged == (max_iter > 3)


def test_same_as_scikit_learn_with_empty_clusters():
    """A start with idle centroids ends where scikit-learn's relocation ends."""
    from sklearn.cluster import KMeans

    points = sphere(400)
    start = np.concatenate([points[:20], points[:5] + 50.0])
    ours = kmeans(points, 25, init=start, tol=0, max_iter=300)
    theirs = KMeans(25, init=start, n_init=1, tol=0, max_iter=300, algorithm="lloyd").fit(points)
    npt.assert_allclose(ours.inertia, theirs.inertia_, rtol=1e-12)


@pytest.mark.parametrize("init", INITS)
def test_every_point_with_its_nearest_centroid(init):
    """Labels, inertia and centroids belong together for every start."""
    points = sphere(2000)
    result = kmeans(points, 100, init=init, seed=3)
    squared = ((points[:, None] - result.centroids[None]) ** 2).sum(axis=2)
    npt.assert_array_equal(result.labels, squared.argmin(axis=1))
    npt.assert_allclose(result.inertia, squared.min(axis=1).sum())
    assert result.labels.dtype == np.int64
    assert result.converged


@pytest.mark.parametrize("init", INITS)
def test_same_seed_same_bytes(init):
    """The same seed gives the same bytes, another seed of a random start does not."""
    points = sphere(1000)
    first, again = (kmeans(points, 50, init=init, seed=5) for _ in range(2))
    assert first.labels.tobytes() == again.labels.tobytes()
    assert first.centroids.tobytes() == again.centroids.tobytes()
    if init != "spread":
        assert not np.array_equal(first.labels, kmeans(points, 50, init=init, seed=6).labels)


@pytest.mark.parametrize("init", ["k-means++", "spread"])
def test_good_starts_beat_the_random_one(init):
    """The careful starts end at a lower inertia than the random one."""
    points = sphere(4000)
    careful = np.mean([kmeans(points, 200, init=init, seed=s).inertia for s in range(4)])
    random = np.mean([kmeans(points, 200, init="random", seed=s).inertia for s in range(4)])
    assert careful < random


@pytest.mark.parametrize("init", [*INITS, None])
@settings(deadline=None, max_examples=60)
@given(
    points=hnp.arrays(
        np.float64, st.tuples(st.integers(1, 40), st.just(3)), elements=st.integers(0, 3)
    ),
    data=st.data(),
)
def test_no_empty_cluster(init, points, data):
    """With as many distinct points as clusters none is empty, however many points coincide."""
    distinct = len(np.unique(points, axis=0))
    c = data.draw(st.integers(1, distinct))
    start = np.full((c, 3), 100.0) if init is None else init
    result = kmeans(points, c, init=start)
    assert np.bincount(result.labels, minlength=c).min() >= 1
    assert len(np.bincount(result.labels)) == c
    squared = ((points[:, None] - result.centroids[None]) ** 2).sum(axis=2)
    npt.assert_allclose(
        squared[np.arange(len(points)), result.labels], squared.min(axis=1), atol=1e-9
    )


@pytest.mark.parametrize("init", INITS)
def test_large_offset_loses_nothing(init):
    """At UTM coordinates the clusters are those found at the origin."""
    # Multiples of 2^-10 so that adding the offset is exact.
    points = np.round(sphere(1500) * 1024) / 1024
    offset = np.array([500_000.0, 5_400_000.0, 300.0])
    here = kmeans(points, 75, init=init)
    there = kmeans(points + offset, 75, init=init)
    npt.assert_array_equal(here.labels, there.labels)
    assert there.inertia == here.inertia


def test_as_many_clusters_as_points():
    """N clusters of N points leave each point alone with its centroid."""
    points = sphere(50)
    result = kmeans(points, 50, init="spread")
    npt.assert_array_equal(np.sort(result.labels), np.arange(50))
    npt.assert_allclose(result.inertia, 0, atol=1e-25)


def test_progress_ends_within_one():
    """Progress is a growing share of the work."""
    seen = []
    kmeans(sphere(200), 10, progress=seen.append)
    assert seen == sorted(seen)
    assert 0 < seen[-1] <= 1


def test_fewer_distinct_points_than_clusters():
    """Points that coincide cannot fill more clusters than there are places."""
    points = np.repeat(np.eye(3), 5, axis=0)
    with pytest.raises(InvalidCloudError, match=r"Too few distinct points\..*Given: 3 distinct"):
        kmeans(points, 4)


def test_fewer_points_than_clusters():
    """More clusters than points is an error of the cloud."""
    with pytest.raises(InvalidCloudError, match="Too few points"):
        kmeans(sphere(5), 6)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"n_clusters": 0}, "Invalid clusters"),
        ({"n_clusters": 2.0}, "Invalid clusters"),
        ({"init": "pca"}, r"Invalid init\. Must be one of random"),
        ({"init": np.zeros((4, 3))}, r"Invalid init\. Must have one row"),
        ({"max_iter": 0}, "Invalid max_iter"),
        ({"tol": -1.0}, "Invalid tol"),
        ({"seed": -1}, "Invalid seed"),
    ],
)
def test_invalid_parameters(options, message):
    """Every bad parameter is named."""
    with pytest.raises(InvalidParameterError, match=message):
        kmeans(sphere(20), **{"n_clusters": 3, **options})
