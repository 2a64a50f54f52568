"""How far a cloud is from a surface, and which of its points need not be asked."""

import numpy as np
import numpy.testing as npt
import pytest
from scipy.spatial import ConvexHull

from meshlab_filter.measure import distances_to, worst_near


@pytest.fixture(scope="module")
def ball():
    """Return points in and on a ball, which of them are vertices, and faces through most of those.

    One vertex lies off every face.
    """
    rng = np.random.default_rng(0)
    points = rng.normal(size=(600, 3))
    points[:300] /= np.linalg.norm(points[:300], axis=1)[:, None]
    kept = np.r_[rng.permutation(200), 450]
    points[450] = [0.1, 0.2, 0.3]
    return points, kept, ConvexHull(points[kept[:-1]]).simplices.astype(np.int64)


def test_corners_need_no_search(ball):
    """Leaving out the corners of the surface changes no distance; a vertex off it keeps its own."""
    points, kept, faces = ball
    every = distances_to(points[kept], faces, points)
    found = distances_to(points[kept], faces, points, kept=kept)
    npt.assert_allclose(found, every, rtol=0, atol=1e-15)
    npt.assert_array_equal(found[kept[:-1]], 0.0)
    assert found[450] > 0.5


def test_without_faces_the_vertices_are_the_surface(ball):
    """Every vertex is then at distance 0, and nothing else is."""
    points, kept, _ = ball
    none = np.empty((0, 3), dtype=np.int64)
    found = distances_to(points[kept], none, points, kept=kept)
    npt.assert_allclose(found, distances_to(points[kept], none, points), rtol=0, atol=1e-15)
    npt.assert_array_equal(np.flatnonzero(found == 0), np.sort(kept))
    npt.assert_array_equal(distances_to(points, none, points, kept=np.arange(600)), 0.0)


def test_worst_near_nothing():
    """Where every distance is 0, so is the worst."""
    cloud = np.random.default_rng(1).random((20, 3))
    npt.assert_array_equal(worst_near(cloud[:5], cloud, np.zeros(20)), 0.0)
