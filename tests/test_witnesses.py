"""Local error estimates, against shapes whose error is known."""

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter.witnesses import Witnesses, tangent_frames

HEXAGON = np.array([[np.cos(a), np.sin(a), 0.0] for a in np.arange(6) * np.pi / 3]).T
UP = np.array([[0.0], [0.0], [1.0]])


def errors(witness, around, normal=UP):
    witness = np.asarray(witness, dtype=float).reshape(3, 1)
    gap, crease = Witnesses(6).errors(witness, normal, around[:, :, None], np.ones(1))
    return gap[0], crease[0]


@pytest.mark.parametrize("height", [0.0, 0.1, -0.3])
def test_gap_is_the_height_over_a_plane(height):
    """Over a flat ring of neighbours the gap is the distance to its plane."""
    gap, crease = errors([0.05, 0.02, height], HEXAGON)
    npt.assert_allclose([gap, crease], abs(height))


def test_sign_of_the_normal_has_no_effect():
    """Tangent planes have no sign."""
    around = HEXAGON + np.random.default_rng(0).normal(scale=0.1, size=(3, 6))
    npt.assert_allclose(errors([0, 0, 0.1], around), errors([0, 0, 0.1], around, -UP))


def test_half_way_between_two_neighbours_is_inside():
    """A point on an edge of the triangulation has no gap, as in a subdivided mesh."""
    x, y = np.array([[1, 1], [-1, -1], [1, -1], [-1, 1], [3, 1], [1, 3]], dtype=float).T
    gap, _ = errors([0, 0, 0.0], np.array([x, y, 0 * x]))
    npt.assert_allclose(gap, 0, atol=1e-12)


def test_beyond_a_border_it_is_the_distance_to_the_nearest_segment():
    """A witness outside of all triangles is as far off as the border it stood on."""
    x, y = np.array([[-1, 0], [1, 0], [-1, 1], [1, 1], [-1, 2], [1, 2]], dtype=float).T
    gap, _ = errors([0, -0.2, 0.0], np.array([x, y, 0 * x]))
    npt.assert_allclose(gap, 0.2)


def test_neighbours_on_a_line_span_no_triangle():
    """Collinear neighbours, rounding noise apart, count as a segment and give finite errors."""
    generator = np.random.default_rng(0)
    direction = np.array([1.0, np.sqrt(2), 0]) / np.sqrt(3)
    for t in generator.normal(size=(200, 7)):
        line = direction[:, None] * t
        gap, crease = errors(line[:, 0], line[:, 1:])
        assert np.isfinite([gap, crease]).all()
        assert gap <= np.abs(t[1:] - t[0]).min() + 1e-12


def test_frames_are_orthonormal():
    """For any direction, the poles included."""
    n = np.random.default_rng(0).normal(size=(3, 50))
    n[:, :2] = [[0, 0], [0, 0], [1, -1]]
    n /= np.linalg.norm(n, axis=0)
    u, v = tangent_frames(n)
    npt.assert_allclose(np.cross(u, v, axis=0), n, atol=1e-12)
