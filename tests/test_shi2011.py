"""Shi et al. 2011 against cases worked out by hand."""

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter.errors import InvalidParameterError
from meshlab_filter.methods.shi2011 import rank


def lattice(size):
    """Return a hexagonal lattice of spacing 1 in the plane z = 0."""
    row, column = np.mgrid[0:size, 0:size].reshape(2, -1)
    return np.stack([column + row % 2 / 2, row * np.sqrt(3) / 2, 0 * row], axis=1)


def test_bent_cluster_is_split_at_the_bend():
    """Three points looking up and two sideways, in one cluster, leave one point for each side."""
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [5, 0, 0], [6, 0, 0]], dtype=float)
    normals = np.array([[0, 0, 1]] * 3 + [[1, 0, 0]] * 2, dtype=float)
    # One seed; its border cluster is halved at its ends: {0, 1, 2} and {5, 6}. Nothing bends
    # inside either half, so the points nearest 1 and 5.5 stay, of equals the first.
    result = rank(points, normals=normals, space_interval=100.0)
    npt.assert_array_equal(result.indices, [1, 3])
    npt.assert_array_equal(result.labels[:3] == result.labels[0], True)


@pytest.mark.parametrize(("deviation", "kept"), [("half-cosine", 49), ("cosine", 50)])
def test_threshold_is_on_the_deviation_named(deviation, kept):
    """A normal at 60° deviates by 0.25 or 0.5: at a threshold of 0.4 only one of them splits."""
    points = lattice(7)
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    pair = np.flatnonzero((points[:, 0] == 3) & (abs(points[:, 1] - np.sqrt(3)) < 0.1))[0]
    points = np.vstack([points, points[pair] + [0.1, 0.0, 0.0]])
    normals = np.vstack([normals, [np.sin(np.pi / 3), 0.0, 0.5]])
    result = rank(
        points,
        normals=normals,
        space_interval=0.9,
        normal_threshold=0.4,
        deviation=deviation,
    )
    assert len(result.indices) == kept


def test_inner_clusters_are_not_halved():
    """Inside a flat lattice with one point a seed nothing is split, so that all points stay."""
    points = lattice(5)
    result = rank(points, normals=np.tile([0.0, 0, 1], (25, 1)), space_interval=0.9)
    npt.assert_array_equal(result.indices, np.arange(25))


def test_large_clusters_are_split_too():
    """Beyond the size up to which all pairs are compared, a lone bent normal is still found."""
    grid = np.mgrid[0:20, 0:20].reshape(2, -1).T
    points = np.column_stack([grid, np.zeros(400)])
    normals = np.tile([0.0, 0.0, 1.0], (400, 1))
    flat = rank(points, normals=normals, space_interval=1000.0)
    normals[210] = [1.0, 0.0, 0.0]
    bent = rank(points, normals=normals, space_interval=1000.0)
    assert len(flat.indices) == 2
    assert len(bent.indices) > 2
    assert 210 in bent.indices


def test_unknown_deviation_is_refused():
    """The deviation is one of two."""
    with pytest.raises(InvalidParameterError, match="Invalid deviation"):
        rank(np.zeros((3, 3)), normals=np.ones((3, 3)), deviation="sine")
