"""Pieces of a surface that face the same way."""

import numpy as np
import numpy.testing as npt
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from meshlab_filter.orientation import orient_coherently, pieces_of


def cut_sheet(seed, cuts=3):
    """Return a bent sheet in strips with gaps between, each facing up, and its spacing."""
    rng = np.random.default_rng(seed)
    vertices, faces = [], []
    for strip in range(cuts + 1):
        xy = rng.random((80, 2)) * [1, 3] + [strip * 1.15, 0]
        faces.append(Delaunay(xy).simplices + 80 * strip)
        vertices.append(np.column_stack([xy, 0.3 * np.sin(2 * xy[:, 0])]))
    return np.vstack(vertices), np.vstack(faces).astype(np.int64)


def upward(vertices, faces):
    """Tell which faces face up."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)[:, 2] > 0


@given(seed=st.integers(0, 500), turned=st.lists(st.booleans(), min_size=4, max_size=4))
@settings(max_examples=20, deadline=None)
def test_strips_face_the_same_way(seed, turned):
    """Whichever strips are turned, all agree in the end, and no face changes but for its side."""
    vertices, faces = cut_sheet(seed)
    flip = np.array(turned)[pieces_of(faces)[0]]
    faces[flip] = faces[flip][:, ::-1]
    found = orient_coherently(vertices, faces, 0.8)
    up = upward(vertices, found)
    assert up.all() or not up.any()
    npt.assert_array_equal(np.sort(found, axis=1), np.sort(faces, axis=1))
    scaled = orient_coherently(vertices * 64, faces, 0.8 * 64)
    npt.assert_array_equal(scaled, found)


def test_the_larger_part_stays():
    """One turned strip of four is the one that turns back."""
    vertices, faces = cut_sheet(0)
    flip = pieces_of(faces)[0] == 2
    turned = faces.copy()
    turned[flip] = turned[flip][:, ::-1]
    npt.assert_array_equal(orient_coherently(vertices, turned, 0.8), faces)


def test_pieces_far_apart_stay():
    """Nothing is compared further than the reach."""
    vertices, faces = cut_sheet(1)
    flip = pieces_of(faces)[0] == 1
    faces[flip] = faces[flip][:, ::-1]
    npt.assert_array_equal(orient_coherently(vertices, faces, 1e-3), faces)


def test_nothing_to_orient():
    """No face, or one piece."""
    assert orient_coherently(np.eye(3), np.empty((0, 3)), 1.0).shape == (0, 3)
    npt.assert_array_equal(orient_coherently(np.eye(3), [[0, 2, 1]], 1.0), [[0, 2, 1]])
