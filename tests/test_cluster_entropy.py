"""The paper's Algorithm 1 as a ranking."""

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter.clustering import kmeans
from meshlab_filter.entropy import cluster_entropy
from meshlab_filter.errors import InvalidCloudError, InvalidParameterError
from meshlab_filter.methods.cluster_entropy import rank


def sphere(n, seed=0):
    """Points on the unit sphere, denser towards one pole."""
    rng = np.random.default_rng(seed)
    points = rng.normal(loc=[0, 0, 0.7], size=(n, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


def test_algorithm_1():
    """The clusters deleted are those of lowest entropy, whole."""
    points = sphere(2000)
    result = rank(points, delete=12, seed=4)
    clustering = kmeans(points, 100, init="random", seed=4)
    npt.assert_array_equal(result.labels, clustering.labels)
    npt.assert_array_equal(result.entropy, cluster_entropy(points, clustering.labels))
    deleted = np.argsort(result.entropy)[:12]
    npt.assert_array_equal(result.indices, np.flatnonzero(~np.isin(clustering.labels, deleted)))
    assert result.threshold == 12
    assert result.info["clusters"] == 100
    assert result.info["missed"] == 0


@pytest.mark.parametrize("init", ["random", "k-means++", "spread"])
def test_cores_do_not_show(init, monkeypatch):
    """One thread and several give the same bytes."""
    points = sphere(20_000)
    results = []
    for cores in (1, 2, 5):
        monkeypatch.setattr("os.cpu_count", lambda cores=cores: cores)
        results.append(rank(points, delete=50, init=init, max_iter=20))
    for other in results[1:]:
        assert other.rank.tobytes() == results[0].rank.tobytes()
        assert other.entropy.tobytes() == results[0].entropy.tobytes()


def test_ranks_order_the_entropies():
    """Every point has its cluster's place in ascending order of entropy."""
    result = rank(sphere(1000), delete=1)
    places = np.empty(50)
    places[result.labels] = result.rank
    npt.assert_array_equal(np.sort(places), np.arange(50))
    assert (np.diff(result.entropy[np.argsort(places)]) >= 0).all()


def test_ties_by_cluster_number():
    """Of clusters of the same entropy the one of lower number goes first."""
    square = np.array([[0.0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0]])
    points = np.concatenate([square + np.array([x, 0, 0]) for x in (0, 16, 32, 48)])
    result = rank(points, clusters=4, delete=2, init=points[[8, 0, 12, 4]] + 0.25)
    npt.assert_array_equal(result.indices, [4, 5, 6, 7, 12, 13, 14, 15])


@pytest.mark.parametrize(("delete", "deleted"), [(0, 0), (7, 7), (0.074, 7), (0.5, 50), (99, 99)])
def test_delete(delete, deleted):
    """A whole number is clusters, another number a share of them."""
    assert rank(sphere(2000), delete=delete).threshold == deleted


@pytest.mark.parametrize("keep_representative", [False, True])
@pytest.mark.parametrize("count", [1, 300, 1500, 1999, 2000])
def test_count_is_reached_as_nearly_as_clusters_allow(count, keep_representative):
    """No other number of deleted clusters comes nearer, and the miss is told."""
    points = sphere(2000)
    result = rank(points, count=count, keep_representative=keep_representative)
    misses = [
        abs(len(rank(points, delete=n, keep_representative=keep_representative).indices) - count)
        for n in {max(result.threshold - 1, 0), result.threshold, min(result.threshold + 1, 99)}
    ]
    assert result.info["missed"] == len(result.indices) - count
    assert abs(result.info["missed"]) == min(misses)


def test_keep_representative():
    """Each deleted cluster leaves the point nearest its centroid, ranked above all clusters."""
    points = sphere(1000)
    result = rank(points, delete=20, keep_representative=True)
    centroids = kmeans(points, 50, init="random").centroids
    left = np.flatnonzero(result.rank == 50)
    assert len(np.unique(result.labels[left])) == len(left) == 20
    for index in left:
        members = np.flatnonzero(result.labels == result.labels[index])
        away = np.linalg.norm(points[members] - centroids[result.labels[index]], axis=1)
        assert members[away.argmin()] == index


def test_single_point_clusters_are_never_deleted():
    """Clusters of one point rank last and deleting them is refused."""
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.normal(size=(20, 3)), [[100, 0, 0]], [[0, 100, 0]]])
    start = np.concatenate([points[[0, 5]], points[20:]])
    result = rank(points, clusters=4, delete=2, init=start)
    npt.assert_array_equal(result.indices, [20, 21])
    with pytest.raises(InvalidParameterError, match="at most 2, the clusters of more than one"):
        rank(points, clusters=4, delete=3, init=start)
    assert rank(points, clusters=4, count=1, init=start).info["missed"] == 1


def test_ranking_alone_deletes_nothing():
    """Without a target every point stays, and still has its rank."""
    result = rank(sphere(1000))
    assert len(result.indices) == 1000
    npt.assert_array_equal(result.rank, rank(sphere(1000), delete=9).rank)


def test_default_clusters_of_few_distinct_points():
    """The default is never more clusters than distinct points; a number given is an error."""
    points = np.repeat(np.eye(3), 40, axis=0)
    assert rank(points, delete=1).info["clusters"] == 3
    with pytest.raises(InvalidCloudError, match="Too few distinct points"):
        rank(points, delete=1, clusters=6)


def test_default_clusters_of_a_tiny_cloud():
    """Five per cent of a few points is one cluster."""
    assert rank(sphere(3), delete=0).info["clusters"] == 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"delete": 1, "count": 9}, "left out where count is given. Given: delete=1, count=9"),
        ({"delete": 5}, r"Invalid delete\. Must be less than the 5 clusters\. Given: 5"),
        ({"delete": -1}, r"Invalid delete\. Must be at least 0"),
        ({"delete": 1.5}, r"Invalid delete\. A share must be"),
        ({"delete": 0.99}, r"Invalid delete\. Must be less than the 5 clusters"),
        ({"delete": 0.0}, r"Invalid delete\. A share must be"),
        ({"delete": float("nan")}, "Invalid delete"),
        ({"count": 0}, "Invalid count"),
        ({"count": 101}, r"Invalid count\. Must be at most 100"),
        ({"clusters": 0, "delete": 0}, "Invalid clusters"),
        ({"clusters": "many", "delete": 0}, "Invalid clusters"),
    ],
)
def test_invalid_parameters(options, message):
    """Every bad target is one sentence."""
    with pytest.raises(InvalidParameterError, match=message):
        rank(sphere(100), **options)


def test_more_clusters_than_points():
    """Fewer points than clusters is an error of the cloud."""
    with pytest.raises(InvalidCloudError, match="Too few points"):
        rank(sphere(10), clusters=11, delete=1)


def test_removed_points_of_the_paper(bunny16k):
    """Table 1 and Fig. 7: removed points of the bunny lie within two standard deviations.

    The paper does not give k0 of k = k0 √m; k = 2, a k0 of one half at 20 points a cluster, fits.
    """
    removed = np.array(
        [
            [len(bunny16k) - int((result.rank >= deleted).sum()) for deleted in (60, 40, 30)]
            for result in (rank(bunny16k, clusters=807, delete=60, k=2, seed=s) for s in range(12))
        ]
    )
    away = (removed.mean(axis=0) - [641, 446, 317]) / removed.std(axis=0, ddof=1)
    assert (np.abs(away) <= 2).sum() >= 2
