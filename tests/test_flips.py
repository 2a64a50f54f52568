"""Edge flips that bring a surface nearer to the points it was made from."""

import numpy as np
import numpy.testing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from meshlab_filter.flips import flip_edges, nearest_faces
from meshlab_filter.quality import edge_defects
from meshlab_filter.triangles import squared_distances


def height(xy):
    """Return a curved sheet's height."""
    return np.sin(3 * xy[:, 0]) * np.cos(2 * xy[:, 1])


def sheet(seed, kept=60, total=800):
    """Return vertices, faces and original points of a triangulated curved sheet."""
    xy = np.random.default_rng(seed).random((total, 2)) * 3
    xy[:4] = [[0, 0], [3, 0], [0, 3], [3, 3]]
    points = np.column_stack([xy, height(xy)])
    return points[:kept], Delaunay(xy[:kept]).simplices, points


def sum_of_squares(vertices, faces, points):
    """Return the sum of squared distances to the nearest triangle, by trying all."""
    best = np.full(len(points), np.inf)
    for face in faces:
        corners = [np.broadcast_to(vertices[corner], points.shape) for corner in face]
        best = np.minimum(best, squared_distances(points, *corners))
    return best.sum()


@given(seed=st.integers(0, 1000))
@settings(max_examples=15, deadline=None)
def test_flips_lower_the_sum_of_squares_and_keep_the_mesh(seed):
    """Flips never raise the error, and keep vertices, borders and orientation."""
    vertices, faces, points = sheet(seed)
    flipped = flip_edges(vertices, faces, points)
    assert sum_of_squares(vertices, flipped, points) <= sum_of_squares(vertices, faces, points)
    assert edge_defects(flipped) == edge_defects(faces)
    npt.assert_array_equal(np.unique(flipped), np.unique(faces))
    directed = np.column_stack([flipped.ravel(), np.roll(flipped, -1, axis=1).ravel()])
    assert len(np.unique(directed, axis=0)) == len(directed), "a side runs the same way twice"


def test_flips_lower_the_error_of_a_curved_sheet():
    """On a curved sheet the sum of squares falls by a tenth at least."""
    vertices, faces, points = sheet(3)
    before = sum_of_squares(vertices, faces, points)
    assert sum_of_squares(vertices, flip_edges(vertices, faces, points), points) < 0.9 * before


def test_a_flat_sheet_stays_as_it_is():
    """Where every diagonal is as good, none is flipped."""
    vertices, faces, points = sheet(0)
    vertices[:, 2] = points[:, 2] = 0
    npt.assert_array_equal(flip_edges(vertices, faces, points), faces)


def test_the_result_does_not_depend_on_scale_or_place():
    """Scaling by a power of two and moving changes nothing."""
    vertices, faces, points = sheet(5)
    expected = flip_edges(vertices, faces, points)
    npt.assert_array_equal(flip_edges(vertices * 1024, faces, points * 1024), expected)


def test_nothing_to_flip():
    """No face, one face and two faces with opposite orientations stay."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1]])
    for faces in ([], [[0, 1, 2]], [[0, 1, 2], [1, 2, 3]]):
        out = flip_edges(corners, faces, corners + 0.1)
        npt.assert_array_equal(out, np.reshape(faces, (-1, 3)))


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((0.2, 0.2, 3.0), 9.0),
        ((-3.0, -4.0, 0.0), 25.0),
        ((1.0, 1.0, 0.0), 0.5),
        ((0.5, -2.0, 0.0), 4.0),
        ((-1.0, 0.5, 1.0), 2.0),
        ((2.0, 0.0, 0.0), 1.0),
        ((0.0, 3.0, 0.0), 4.0),
    ],
)
def test_squared_distance_by_hand(point, expected):
    """Each region of a triangle: its inside, its corners, its sides."""
    corners = [np.array([corner]) for corner in ([0.0, 0, 0], [1.0, 0, 0], [0.0, 1, 0])]
    npt.assert_allclose(squared_distances(np.array([point]), *corners), [expected], atol=1e-12)


def test_degenerate_triangles_are_segments_and_points():
    """A triangle without area is measured as what it is."""
    zero, one, two = (np.array([[x, 0.0, 0.0]]) for x in (0.0, 1.0, 2.0))
    point = np.array([[1.5, 1.0, 0.0]])
    npt.assert_allclose(squared_distances(point, zero, one, two), [1.0])
    npt.assert_allclose(squared_distances(point, zero, zero, zero), [3.25])


def test_nearest_faces_on_a_sheet():
    """Centres of triangles are at home in them, but for a few in long ones (a local search)."""
    vertices, faces, _ = sheet(1)
    home, gap = nearest_faces(vertices, faces, vertices[faces].mean(axis=1))
    right = home == np.arange(len(faces))
    assert right.mean() > 0.98
    npt.assert_allclose(gap[right], 0, atol=1e-13)
