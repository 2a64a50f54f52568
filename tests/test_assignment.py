"""Bounds and lists of neighbours: always the labels that all distances give."""

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter.assignment import Assignment
from meshlab_filter.threads import run_all, slices


def by_all_distances(points, centroids):
    """Labels and distances from all pairs."""
    squared = ((points[:, None] - centroids[None]) ** 2).sum(axis=2)
    return squared.argmin(axis=1), np.sqrt(squared.min(axis=1))


@pytest.mark.parametrize("n_clusters", [1, 2, 5, 13, 14, 60])
@pytest.mark.parametrize("step", [0.0, 1e-3, 0.05, 0.5, 5.0])
@pytest.mark.parametrize("guess", ["none", "good", "bad"])
def test_exact_after_every_move(n_clusters, step, guess):
    """Small, large and uneven movements of the centroids leave no label behind."""
    rng = np.random.default_rng(n_clusters)
    points = rng.normal(size=(800, 3)) * [1, 1, 0.1]
    centroids = rng.normal(size=(n_clusters, 3)) * [1, 1, 0.1]
    right = by_all_distances(points, centroids)[0]
    start = {"none": None, "good": right, "bad": np.zeros(800, dtype=np.int64)}[guess]
    assignment = Assignment(points, centroids, guess=start)
    npt.assert_array_equal(assignment.labels, right)
    for _ in range(12):
        before = assignment.labels.copy()
        # A few centroids jump, most shift a little: one large movement must not hide another.
        scale = np.where(rng.random(n_clusters) < 0.1, 10 * step, step)[:, None]
        centroids = centroids + rng.normal(size=centroids.shape) * scale
        changed = assignment.move(centroids)
        labels, distances = by_all_distances(points, centroids)
        npt.assert_array_equal(assignment.labels, labels)
        npt.assert_allclose(assignment.distances(), distances)
        assert changed == (labels != before).sum()


def test_coinciding_centroids():
    """More equal centroids than a list holds still give the least distances."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(300, 3))
    centroids = np.concatenate([np.zeros((20, 3)), rng.normal(size=(5, 3))])
    assignment = Assignment(points, centroids)
    for _ in range(3):
        npt.assert_allclose(assignment.distances(), by_all_distances(points, centroids)[1])
        centroids = centroids + 0.01
        assignment.move(centroids)


def test_more_points_than_a_chunk():
    """Pieces fit together, whatever the number of points."""
    rng = np.random.default_rng(0)
    points, centroids = rng.normal(size=(20_000, 3)), rng.normal(size=(30, 3))
    assignment = Assignment(points, centroids + 0.2)
    assignment.move(centroids)
    npt.assert_array_equal(assignment.labels, by_all_distances(points, centroids)[0])


@pytest.mark.parametrize("cores", [1, 2, 7, None])
def test_results_in_the_order_of_the_tasks(cores, monkeypatch):
    """The number of threads does not show."""
    monkeypatch.setattr("os.cpu_count", lambda: cores)
    assert run_all(lambda part: part.start, slices(10, 3)) == [0, 3, 6, 9]
