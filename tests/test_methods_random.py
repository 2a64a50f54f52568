"""The random baseline."""

import numpy as np
import numpy.testing as npt

from meshlab_filter.methods.random import rank


def test_order_is_that_of_the_generator():
    """The order is numpy's permutation for the seed, so that anyone can repeat it."""
    order = np.random.default_rng(7).permutation(50)
    npt.assert_array_equal(rank(np.zeros((50, 3)), seed=7).rank[order], np.arange(50))


def test_every_point_has_the_same_chance():
    """Over many seeds each of ten points is kept about as often as the others."""
    kept = np.concatenate(
        [rank(np.zeros((10, 3)), count=3, seed=seed).indices for seed in range(2000)]
    )
    npt.assert_allclose(np.bincount(kept, minlength=10) / 2000, 0.3, atol=0.05)
