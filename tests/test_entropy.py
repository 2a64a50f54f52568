"""k-NN density and entropy of clusters: hand-computed cases and invariants."""

import numpy as np
import numpy.testing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshlab_filter.entropy import DEFINITIONS, cluster_entropy, default_k, knn_density
from meshlab_filter.errors import InvalidParameterError
from meshlab_filter.grouping import Groups

BALL = 4 * np.pi / 3


def cloud(n, clusters, seed=0):
    """Random points with random labels."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(n, 3)), rng.integers(clusters, size=n)


def reference(points, labels, k, definition):
    """Equations 1-7 as a loop over clusters with all distances."""
    entropy = np.full(labels.max() + 1, np.inf)
    for j in np.unique(labels):
        x = points[labels == j]
        m = len(x)
        if m == 1:
            continue
        kk = min(k or max(1, round(np.sqrt(m))), m - 1)
        radii = np.sort(np.linalg.norm(x[:, None] - x[None], axis=2), axis=1)[:, kk]
        p = kk / (m * BALL * radii**3)
        q = p / p.sum()
        entropy[j] = {
            "normalized": -(q * np.log(q)).sum(),
            "differential": -np.log(p).mean(),
            "raw": -(p * np.log(p)).sum(),
        }[definition]
    return entropy


@pytest.mark.parametrize("definition", DEFINITIONS)
@pytest.mark.parametrize("k", [None, 1, 3, 1000])
@pytest.mark.parametrize(("n", "clusters"), [(600, 40), (900, 2), (500, 1), (60, 40)])
def test_equations(definition, k, n, clusters):
    """Small and large clusters agree with the equations written out."""
    points, labels = cloud(n, clusters)
    npt.assert_allclose(
        cluster_entropy(points, labels, k=k, definition=definition),
        reference(points, labels, k, definition),
        rtol=1e-9,
    )


def test_density_by_hand():
    """Three points on a line, k = 1 and 2, in the order of the points."""
    points = np.array([[0.0, 0, 0], [3, 0, 0], [1, 0, 0]])
    npt.assert_allclose(knn_density(points, [0, 0, 0], k=1), 1 / (3 * BALL * np.array([1, 8, 1])))
    npt.assert_allclose(knn_density(points, [0, 0, 0], k=2), 2 / (3 * BALL * np.array([27, 27, 8])))


def test_entropy_by_hand():
    """Two dense points and one of an eighth of their density."""
    points = [[0.0, 0, 0], [3, 0, 0], [1, 0, 0]]
    q = np.array([8, 1, 8]) / 17
    npt.assert_allclose(cluster_entropy(points, [0, 0, 0], k=1), [-(q * np.log(q)).sum()])


def test_default_k():
    """K is the square root of the size, rounded, and at least 1."""
    npt.assert_array_equal(
        default_k(np.array([1, 2, 3, 6, 7, 20, 21, 10000])), [1, 1, 2, 2, 3, 4, 5, 100]
    )


@settings(deadline=None, max_examples=50)
@given(
    scale=st.floats(1e-6, 1e6),
    shift=st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3),
    quaternion=st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(
        lambda q: np.linalg.norm(q) > 0.1
    ),
    seed=st.integers(0, 1000),
)
def test_invariant_to_similarity(scale, shift, quaternion, seed):
    """Scale, translation and rotation leave the normalized entropy as it is."""
    from scipy.spatial.transform import Rotation

    points, labels = cloud(300, 12, seed)
    moved = scale * (Rotation.from_quat(quaternion).apply(points) + shift)
    npt.assert_allclose(cluster_entropy(moved, labels), cluster_entropy(points, labels), rtol=1e-6)


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 1000))
def test_invariant_to_order(seed):
    """The order of the points leaves entropies and densities as they are."""
    points, labels = cloud(300, 12, seed)
    order = np.random.default_rng(seed).permutation(300)
    npt.assert_allclose(
        cluster_entropy(points[order], labels[order]), cluster_entropy(points, labels)
    )
    npt.assert_array_equal(
        knn_density(points[order], labels[order]), knn_density(points, labels)[order]
    )


def test_normalized_entropy_is_at_most_log_size():
    """The entropy lies between 0 and ln m."""
    points, labels = cloud(2000, 60)
    entropy = cluster_entropy(points, labels)
    assert (entropy > 0).all()
    assert (entropy <= np.log(np.bincount(labels)) + 1e-12).all()


@pytest.mark.parametrize("definition", DEFINITIONS)
def test_duplicates_stay_finite(definition):
    """Coinciding points have the density of the densest other point of their cluster."""
    points = np.array([[0.0, 0, 0], [0, 0, 0], [2, 0, 0], [3, 0, 0], [9, 9, 9], [9, 9, 9]])
    labels = np.array([0, 0, 0, 0, 1, 1])
    density = knn_density(points, labels, k=1)
    npt.assert_allclose(density[:4], 1 / (4 * BALL))
    npt.assert_allclose(density[4:], 1 / (2 * BALL))
    assert np.isfinite(cluster_entropy(points, labels, k=1, definition=definition)).all()
    if definition == "normalized":
        npt.assert_allclose(
            cluster_entropy(points, labels, k=1, definition=definition), np.log([4, 2])
        )


@pytest.mark.parametrize("definition", DEFINITIONS)
def test_all_points_equal(definition):
    """A cloud in one place has a finite entropy: all points are equally dense."""
    entropy = cluster_entropy(np.ones((200, 3)), np.zeros(200, dtype=int), definition=definition)
    assert np.isfinite(entropy).all()


@pytest.mark.parametrize("definition", DEFINITIONS)
def test_single_points_have_no_density(definition):
    """The only point of a cluster has no density, and its cluster an infinite entropy."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [5, 5, 5]])
    labels = np.array([0, 0, 3])
    npt.assert_array_equal(np.isnan(knn_density(points, labels)), [False, False, True])
    entropy = cluster_entropy(points, labels, definition=definition)
    assert np.isfinite(entropy[0])
    npt.assert_array_equal(entropy[1:], [np.inf] * 3)


def test_large_clusters_at_large_offsets():
    """Clusters too large for all pairs have the same radii as small ones, UTM offset or not."""
    rng = np.random.default_rng(0)
    points = np.round(rng.random((4000, 3)) * 1024) / 1024
    labels = np.repeat([0, 1, 2, 3], 1000)
    there = knn_density(points + np.array([5e5, 5.4e6, 0]), labels)
    npt.assert_allclose(there, knn_density(points, labels), rtol=1e-6)
    npt.assert_allclose(
        cluster_entropy(points, labels), reference(points, labels, None, "normalized")
    )


@pytest.mark.parametrize(
    ("labels", "message"),
    [
        ([0, 0], r"Invalid labels\. Must be one whole number for each of 3 points"),
        ([0.0, 0.0, 1.0], r"Invalid labels\..*float64"),
        ([0, -1, 0], r"Invalid labels\. Must be 0 or greater\. Given: -1"),
    ],
)
def test_invalid_labels(labels, message):
    """Labels that do not fit are named."""
    with pytest.raises(InvalidParameterError, match=message):
        cluster_entropy(np.eye(3), labels)


@pytest.mark.parametrize(
    ("options", "message"), [({"k": 0}, "Invalid k"), ({"definition": "shannon"}, "one of normal")]
)
def test_invalid_parameters(options, message):
    """Every bad parameter is named."""
    with pytest.raises(InvalidParameterError, match=message):
        cluster_entropy(np.eye(3), [0, 0, 0], **options)


def test_groups():
    """Groups know their rows, and labels without rows."""
    groups = Groups.of(np.array([2, 0, 2, 0, 0]))
    npt.assert_array_equal(groups.order, [1, 3, 4, 0, 2])
    npt.assert_array_equal(groups.counts, [3, 0, 2])
    values = np.array([1.0, 2, 3, 4, 5])
    npt.assert_array_equal(groups.total(values), [6, 0, 9])
    npt.assert_array_equal(groups.minimum(values), [1, np.inf, 4])
    npt.assert_array_equal(groups.spread(np.array([7.0, 8, 9])), [7, 7, 7, 9, 9])
