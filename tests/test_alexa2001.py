"""Alexa et al. 2001 against cases worked out by hand."""

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter.methods.alexa2001 import rank, surface_distance

GRID = np.mgrid[-2:3, -2:3, 0:1].reshape(3, -1).T.astype(float)
OTHERS = GRID[np.abs(GRID).sum(axis=1) > 0]


@pytest.mark.parametrize("height", [0.0, 0.1, 0.7])
def test_distance_to_a_plane(height):
    """A point over a plane of others is as far from it as it is high."""
    npt.assert_allclose(surface_distance((OTHERS - [0, 0, height])[None]), height, atol=1e-6)


def test_point_on_a_paraboloid_has_no_distance():
    """The quadratic reproduces a paraboloid, so that its own point tells nothing."""
    bowl = OTHERS.copy()
    bowl[:, 2] = 0.1 * (bowl[:, 0] ** 2 + bowl[:, 1] ** 2)
    npt.assert_allclose(surface_distance(bowl[None]), 0.0, atol=1e-6)


def test_distance_turns_and_scales_with_the_points():
    """The distance is a length: it follows the scale and ignores the direction."""
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    offset = (OTHERS - [0.2, 0.1, 0.3])[None]
    npt.assert_allclose(surface_distance(offset @ turn * 50), 50 * surface_distance(offset))


def test_bumps_stay():
    """Of a plane with three bumps the bumps are kept."""
    points = np.mgrid[0:12, 0:12, 0:1].reshape(3, -1).T.astype(float)
    bumps = [30, 70, 110]
    points[bumps, 2] = 0.9
    assert set(bumps) <= set(rank(points, count=40).indices)
