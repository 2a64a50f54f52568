"""Holes closed where the original points say that there is surface."""

import numpy as np
import numpy.testing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from meshlab_filter.fitting import fit_surface
from meshlab_filter.holes import boundary_loops, close_holes, triangulate
from meshlab_filter.quality import edge_defects


def ball(count, seed=0):
    """Return points on the unit sphere."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


def outward(points):
    """Return the faces of the hull, turned outward."""
    faces = ConvexHull(points).simplices.astype(np.int64)
    a, b, c = (points[faces[:, corner]] for corner in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) < 0
    faces[inward] = faces[inward][:, ::-1]
    return faces


@given(seed=st.integers(0, 500), removed=st.integers(1, 6))
@settings(max_examples=15, deadline=None)
def test_holes_of_a_ball_are_closed(seed, removed):
    """Faces taken out of a closed surface come back, oriented alike, whatever they touch."""
    rng = np.random.default_rng(seed)
    vertices, points = ball(150, seed), ball(6000, seed + 1)
    whole = outward(vertices)
    middle = vertices[whole].mean(axis=1)
    gone = np.argsort(middle @ middle[rng.integers(len(whole))])[-removed:]
    closed = close_holes(vertices, np.delete(whole, gone, axis=0), points)
    assert edge_defects(closed)["boundary_edges"] == 0
    a, b, c = (vertices[closed[:, corner]] for corner in range(3))
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) > 0).all()


def test_the_border_of_an_open_scan_stays_open():
    """Half a ball without points on the other half keeps its border."""
    vertices, points = ball(300), ball(12000, 1)
    faces = outward(vertices)
    used, faces = np.unique(faces[(vertices[faces][:, :, 2] > 0).all(axis=1)], return_inverse=True)
    vertices, faces = vertices[used], faces.reshape(-1, 3)
    closed = close_holes(vertices, faces, points[points[:, 2] > -0.05], max_edges=1000)
    npt.assert_array_equal(closed, faces)


def test_long_holes_stay():
    """A hole of more edges than allowed is left as it is."""
    vertices, points = ball(150), ball(6000, 1)
    faces = outward(vertices)[1:]
    assert len(close_holes(vertices, faces, points, max_edges=3)) == len(faces) + 1
    npt.assert_array_equal(close_holes(vertices, faces, points, max_edges=2), faces)


def test_holes_that_touch_are_loops_of_their_own():
    """Two triangles missing around a vertex, not beside each other."""
    fan = np.array([[0, i, i % 6 + 1] for i in range(1, 7)])
    loops = boundary_loops(np.delete(fan, [0, 3], axis=0))
    assert sorted(map(len, loops)) in ([3, 3], [8], [4, 4])
    assert sum(map(len, loops)) == 8


def test_triangulation_of_least_area():
    """A bent square is closed along its shorter bend."""
    corners = np.array([[0.0, 0, 0], [1, 0, 1], [1, 1, 0], [0, 1, 0.9]])
    found = triangulate(corners, np.arange(4), np.array([], dtype=np.int64))
    areas = {}
    for faces in ([[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]):
        a, b, c = (corners[np.array(faces)[:, corner]] for corner in range(3))
        areas[str(sorted(map(sorted, faces)))] = np.linalg.norm(
            np.cross(b - a, c - a), axis=1
        ).sum()
    assert str(sorted(sorted(map(int, face)) for face in found)) == min(areas, key=areas.get)


def test_no_triangulation_repeats_an_edge():
    """Where both chords of a square are edges already there is none."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    both = np.array([0 * 4 + 2, 1 * 4 + 3])
    assert triangulate(corners, np.arange(4), both) is None
    assert len(triangulate(corners, np.arange(4), both[:1])) == 2


@pytest.mark.parametrize("faces", [np.empty((0, 3), dtype=int), [[0, 1, 2]]])
def test_nothing_to_close(faces):
    """No face, or a single one, stays."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    points = np.array([[0.2, 0.2, 0.0]])
    npt.assert_array_equal(fit_surface(corners, faces, points), np.reshape(faces, (-1, 3)))
