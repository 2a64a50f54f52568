"""The neighbour lists that a decimation keeps up to date."""

import numpy as np
import numpy.testing as npt
from scipy.spatial import cKDTree

from meshlab_filter.neighbourhood import Neighbourhood


def test_lists_equal_a_fresh_search_after_any_removals():
    """After every round the lists are those of a tree of the points left."""
    generator = np.random.default_rng(0)
    cloud = generator.random((400, 3))
    hood = Neighbourhood(cloud, 6)
    while hood.alive.sum() > 20:
        before = hood.nearest.copy()
        left = np.flatnonzero(hood.alive)
        changed = hood.remove(generator.choice(left, len(left) // 8, replace=False))
        left = np.flatnonzero(hood.alive)
        fresh = left[cKDTree(cloud[left]).query(cloud[left], 7)[1][:, 1:]]
        npt.assert_array_equal(hood.nearest[left], fresh)
        npt.assert_array_equal(changed, left[(before[left] != fresh).any(axis=1)])


def test_duplicates_never_list_themselves():
    """Coincident points are each other's neighbours, never their own."""
    cloud = np.repeat(np.random.default_rng(1).random((10, 3)), 30, axis=0)
    hood = Neighbourhood(cloud, 6)
    hood.remove(np.arange(0, 300, 3))
    left = np.flatnonzero(hood.alive)
    assert (hood.nearest[left] != left[:, None]).all()
    assert hood.alive[hood.nearest[left]].all()
