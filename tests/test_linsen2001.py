"""Linsen 2001 against cases worked out by hand."""

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter.errors import InvalidParameterError
from meshlab_filter.methods.linsen2001 import _information, rank


def test_information_is_the_sum_of_its_terms():
    """Neighbours at (3, 0, 4) and (0, 2, 0): distances 5, 2, heights 4, 0, normals at 90°, 0°."""
    points = np.array([[0.0, 0, 0], [3, 0, 4], [0, 2, 0]])
    normals = np.array([[0.0, 0, 1], [1, 0, 0], [0, 0, 1]])
    near = np.array([[1, 2], [0, 2], [0, 1]])
    for weights, expected in (
        ([1, 0, 0], 3.5),
        ([0, 1, 0], 2.0),
        ([0, 0, 1], 0.5),
        ([2, 1, 4], 7.0 + 2.0 + 2.0),
    ):
        npt.assert_allclose(_information(points, normals, near, weights)[0], expected)


def test_crowded_points_go_first():
    """With the distance alone, one of the nearest pair goes first."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1.1, 0, 0], [3, 0, 0], [5, 0, 0]])
    result = rank(
        points,
        normals=np.tile([0, 0, 1.0], (5, 1)),
        neighbors=1,
        weight_plane=0,
        weight_normal=0,
        count=4,
    )
    assert set(range(5)) - set(result.indices) <= {1, 2}


def test_ridge_is_kept():
    """Of a roof, a larger share of the ridge than of the slopes stays."""
    x, y = np.mgrid[-10:11, 0:21].reshape(2, -1)
    points = np.column_stack([x, y, -abs(x)]).astype(float)
    normals = np.column_stack([np.sign(x), 0 * x, np.ones(len(x))])
    kept = rank(points, normals=normals, neighbors=8, count=110).indices
    assert (x[kept] == 0).mean() > 2 * (x == 0).mean()


def test_weights_must_not_all_vanish():
    """Three zeros leave nothing to compare and are refused."""
    with pytest.raises(InvalidParameterError, match="Invalid weights"):
        rank(np.eye(3), weight_distance=0, weight_plane=0, weight_normal=0)
