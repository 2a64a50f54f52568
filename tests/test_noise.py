"""The noise level, against noise that was put in, and what is suggested from it."""

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter.methods.adaptive import rank
from meshlab_filter.noise import advice, noise_level, suggest_noisy


def bumpy_sphere(size, noise=0.0):
    """Points of a smooth closed surface, with noise in units of the mean spacing."""
    generator = np.random.default_rng(0)
    p = generator.normal(size=(size, 3))
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    p *= 1 + 0.1 * np.sin(4 * p[:, :1]) * np.cos(3 * p[:, 1:2])
    spacing = np.sqrt(4 * np.pi / size)
    return p + noise * spacing * generator.normal(size=p.shape)


@pytest.mark.parametrize("noise", [0.1, 0.2, 0.3])
def test_level_is_the_noise_put_in(noise):
    """The figure recovers the standard deviation over the spacing to a fifth."""
    npt.assert_allclose(noise_level(bumpy_sphere(8000, noise)), noise, rtol=0.2)


@pytest.mark.parametrize(("noise", "expected"), [(0.0, False), (0.05, False), (0.25, True)])
def test_suggestion(noise, expected):
    """Clean scans are not smoothed, noisy ones are."""
    noisy, level = suggest_noisy(bumpy_sphere(8000, noise))
    assert noisy is expected
    assert (level > 0.15) is expected


def test_independent_of_unit_place_and_sign():
    """Neither scale, nor a far origin, nor the signs of normals change the level."""
    cloud = bumpy_sphere(2000, 0.2)
    level = noise_level(cloud, cloud)
    npt.assert_allclose(noise_level(cloud * 1e4 + [5e5, 4e6, 0], -cloud), level, rtol=1e-4)


@pytest.mark.parametrize("cloud", [np.zeros((40, 3)), np.arange(24.0)[:, None] * [1, 2, 3]])
def test_clouds_that_cannot_tell_have_none(cloud):
    """Points in one place, or too few of them."""
    assert noise_level(cloud) == 0.0


def test_adaptive_gives_advice_where_it_pays():
    """A noisy cloud is said to be one, once: not with the switch on, nor where it is clean."""
    cloud = bumpy_sphere(3000, 0.3)
    said = advice(rank(cloud, count=2900).info)
    assert said is not None
    assert "scatter by 0." in said
    assert "--set noisy=true" in said
    assert advice(rank(cloud, count=2900, noisy=True).info) is None
    assert advice(rank(bumpy_sphere(3000, 0.0), count=2900).info) is None
