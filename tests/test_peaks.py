"""Vertices far above, or beyond an end of, the surface that a reconstruction left without them."""

import numpy as np
import numpy.testing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapes import ball, euler, hull

from meshlab_filter.insertion import insert_vertices
from meshlab_filter.peaks import restore_peaks
from meshlab_filter.quality import edge_defects


def horned(seed, height):
    """Return a ball with a horn: vertices, faces without the tip, and points all over both."""
    vertices, points = ball(300, seed), ball(8000, seed + 1)
    rng = np.random.default_rng(seed)
    away = rng.normal(size=3)
    away /= np.linalg.norm(away)
    tip = (1 + height) * away
    foot = vertices[np.argsort(vertices @ away)[-8:]]
    share = rng.random((400, 1))
    horn = share * tip + (1 - share) * foot[rng.integers(len(foot), size=400)]
    return np.vstack([vertices, tip]), hull(vertices), np.vstack([points, horn, tip])


@given(seed=st.integers(0, 200))
@settings(max_examples=15, deadline=None)
def test_the_tip_of_a_horn_comes_back(seed):
    """Too steep to be put in by its place alone, it is by the points on its sides."""
    vertices, faces, points = horned(seed, 0.22)
    npt.assert_array_equal(insert_vertices(vertices, faces), faces)
    found = restore_peaks(vertices, faces, points)
    assert (found == 300).any()
    assert edge_defects(found) == edge_defects(faces)
    assert euler(found) == 2
    npt.assert_array_equal(restore_peaks(vertices * 64, faces, points * 64), found)


@pytest.mark.parametrize("height", [0.22, 3.0])
def test_an_outlier_does_not(height):
    """The same tip without points on the way to it, and one farther off than the faces are wide."""
    vertices, faces, points = horned(0, height)
    on_ball = np.linalg.norm(points, axis=1) < 1.001
    npt.assert_array_equal(
        restore_peaks(vertices, faces, np.vstack([points[on_ball], vertices[300:]])), faces
    )
    if height > 1:
        npt.assert_array_equal(restore_peaks(vertices, faces, points), faces)


def test_an_end_is_reached():
    """A vertex beyond the border of a strip is joined to it."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(5.0), np.arange(2.0)))
    strip = np.column_stack([x, y, 0 * x])
    faces = [f for i in range(4) for f in ([i, i + 1, i + 6], [i, i + 6, i + 5])]
    end = np.array([[4.8, 0.5, 0.6]])
    some = np.linspace([4.0, 0.5, 0.0], end[0], 6)
    found = restore_peaks(np.vstack([strip, end]), faces, np.vstack([strip, some]))
    assert (found == 10).any()


def test_nothing_to_restore():
    """All vertices have a face, or there is none at all."""
    vertices = ball(50)
    faces = hull(vertices)
    npt.assert_array_equal(restore_peaks(vertices, faces, vertices), faces)
    assert restore_peaks(vertices, np.empty((0, 3)), vertices).shape == (0, 3)
