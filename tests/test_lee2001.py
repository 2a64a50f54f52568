"""Lee et al. 2001 against cases worked out by hand."""

import numpy as np
import numpy.testing as npt

from meshlab_filter.methods.lee2001 import rank, split_cells

UP, SIDE = [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]


def test_flat_cells_leave_one_point_each():
    """Two cells of equal normals leave the points nearest their centroids."""
    points = np.array([[0, 0, 0], [0.2, 0, 0], [0.7, 0, 0], [1.1, 0, 0], [1.2, 0, 0], [1.4, 0, 0]])
    result = rank(points, normals=np.tile(UP, (6, 1)), space_interval=1.0)
    npt.assert_array_equal(result.indices, [1, 4])
    npt.assert_array_equal(result.labels, [0, 0, 0, 1, 1, 1])


def test_cell_is_split_where_normals_spread():
    """Two normals at a right angle have a standard deviation of √½ = 0.707 about their mean."""
    points = np.array([[0.1, 0, 0], [0.6, 0, 0], [0.9, 0.9, 0.9], [0.05, 0, 0]]) - [0.05, 0, 0]
    normals = np.array([UP, SIDE, SIDE, UP])
    assert split_cells(points, normals, 1.0, 0.708).max() == 0
    cells = split_cells(points, normals, 1.0, 0.706)
    assert cells[0] == cells[3]
    assert len({cells[0], cells[1], cells[2]}) == 3


def test_point_of_mean_normal_stays():
    """Of three normals fanned by 0, 20 and 40 degrees the middle one is nearest the mean."""
    angle = np.radians([40, 20, 0])
    normals = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    points = np.array([[0.0, 0, 0], [0.4, 0, 0], [0.1, 0, 0]])
    npt.assert_array_equal(rank(points, normals=normals, space_interval=1.0).indices, [1])


def test_coinciding_points_end_the_recursion():
    """Points at one place with opposite normals cannot be told apart and leave one."""
    points = np.array([[0.0, 0, 0], [0, 0, 0], [1, 1, 1]])
    normals = np.array([UP, [0.0, 0.0, -1.0], UP])
    assert len(rank(points, normals=normals, space_interval=5.0).indices) == 2
