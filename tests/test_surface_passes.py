"""Which radii ball pivoting takes."""

import numpy as np
import pytest

from meshlab_filter.bridge.surface import IRREGULAR_PASSES, PASSES, pass_factors
from meshlab_filter.quality import regularity


def sphere(size, *, even):
    """Return points on the unit sphere: a spiral of even steps, or thrown at random."""
    if not even:
        points = np.random.default_rng(0).normal(size=(size, 3))
        return points / np.linalg.norm(points, axis=1)[:, None]
    z = 1 - (2 * np.arange(size) + 1) / size
    turn = np.pi * (3 - np.sqrt(5)) * np.arange(size)
    ring = np.sqrt(1 - z * z)
    return np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])


@pytest.mark.parametrize(
    ("size", "even", "passes"),
    [(20_001, False, IRREGULAR_PASSES), (20_000, False, PASSES), (20_001, True, PASSES)],
)
def test_small_radius_is_for_even_or_small_clouds(size, even, passes):
    """Only large clouds of points thrown at random begin with a larger radius."""
    assert pass_factors(sphere(size, even=even)) == passes


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_regularity(scale):
    """An even cloud is near 1, a random one near a half, in any unit."""
    assert regularity(scale * sphere(5000, even=True)) > 0.75
    assert regularity(scale * sphere(5000, even=False)) == pytest.approx(0.49, abs=0.03)


def test_regularity_of_points_in_one_place():
    """Coinciding points are not even; nothing is divided by nothing."""
    assert regularity(np.zeros((30, 3))) == 0.0
