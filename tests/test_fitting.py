"""Fitting a surface to the original points."""

import numpy as np
import numpy.testing as npt
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from meshlab_filter.fitting import fit_surface
from meshlab_filter.flips import flip_edges
from meshlab_filter.holes import close_holes


@given(seed=st.integers(0, 1000), unused=st.booleans())
@settings(max_examples=10, deadline=None)
def test_fitting_is_closing_then_flipping(seed, unused):
    """One search for the nearest corners serves both steps, and neither knows the difference."""
    rng = np.random.default_rng(seed)
    xy = rng.random((900, 2)) * 3
    points = np.column_stack([xy, np.sin(3 * xy[:, 0])])
    kept = 90
    faces = Delaunay(xy[: kept - 10 * unused]).simplices.astype(np.int64)
    faces = faces[rng.random(len(faces)) > 0.05]
    closed = close_holes(points[:kept], faces, points)
    npt.assert_array_equal(
        fit_surface(points[:kept], faces, points), flip_edges(points[:kept], closed, points)
    )


def test_nothing_to_fit():
    """A surface without faces stays one."""
    points = np.random.default_rng(0).random((9, 3))
    assert fit_surface(points, np.empty((0, 3)), points).shape == (0, 3)
