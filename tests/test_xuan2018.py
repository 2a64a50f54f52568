"""Xuan et al. 2018 against cases worked out by hand."""

import numpy as np
import numpy.testing as npt

from meshlab_filter.methods.xuan2018 import angle_entropy, rank


def fan(*degrees):
    """Return unit normals in a plane at these angles."""
    angle = np.radians(degrees)
    return np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)


def test_entropy_of_unequal_angles():
    """Angles of 10° and 30° have the shares 1/4 and 3/4."""
    found = angle_entropy(fan(0, 10, -30), np.array([[1, 2], [0, 2], [0, 1]]))
    npt.assert_allclose(found[0], -(0.25 * np.log(0.25) + 0.75 * np.log(0.75)))


def test_entropy_of_wide_angles():
    """Angles of 60° and 180° have the shares 1/4 and 3/4, too."""
    found = angle_entropy(fan(0, 60, 180), np.array([[1, 2], [0, 2], [0, 1]]))
    npt.assert_allclose(found[0], -(0.25 * np.log(0.25) + 0.75 * np.log(0.75)))


def test_parallel_normals_have_none():
    """On a plane there is no angle and no entropy, rounding or not."""
    normals = fan(0, 0, 1e-9)
    npt.assert_array_equal(angle_entropy(normals, np.array([[1, 2], [0, 2], [0, 1]])), 0.0)


def test_flat_parts_go_before_the_bend():
    """A strip, flat at one end and curved at the other, loses the flat end first."""
    angle = np.r_[np.zeros(20), np.arange(20) * 3.0]
    points = np.column_stack([np.arange(40.0), np.zeros(40), np.zeros(40)])
    kept = rank(points, normals=fan(*angle), neighbors=4, count=22).indices
    assert set(range(20, 40)) <= set(kept)
