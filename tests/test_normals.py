"""Normals: direction, consistent signs, repair of given ones, smoothing."""

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter.errors import InvalidCloudError, InvalidParameterError
from meshlab_filter.normals import (
    estimate_normals,
    nearest_neighbours,
    orient_normals,
    repair_signs,
    smooth_to_tangent_planes,
    unit_normals,
)


def sphere(size, seed=0):
    p = np.random.default_rng(seed).normal(size=(size, 3))
    return p / np.linalg.norm(p, axis=1, keepdims=True)


def test_estimated_normals_of_a_sphere_point_outward():
    """Directions are within a few degrees of the truth, all signs outward."""
    cloud = sphere(3000)
    dot = (estimate_normals(cloud) * cloud).sum(axis=1)
    assert dot.min() > np.cos(np.radians(10))


def test_each_part_is_oriented():
    """Two spheres far apart both end up with outward normals."""
    truth = sphere(800)
    cloud = np.concatenate([truth, truth + 10])
    dot = (estimate_normals(cloud) * np.concatenate([truth, truth])).sum(axis=1)
    assert (dot > 0).all()


def test_orientation_does_not_depend_on_the_signs_given():
    """Random signs come out as consistent as good ones."""
    cloud = sphere(800)
    signs = np.random.default_rng(1).choice([-1.0, 1.0], size=(800, 1))
    npt.assert_array_equal(orient_normals(cloud, cloud * signs), orient_normals(cloud, cloud))


@pytest.mark.parametrize("share", [0.01, 0.05, 0.1])
def test_repair_finds_the_wrong_signs_and_no_others(share):
    """Scattered wrong signs are flipped back, the right ones stay."""
    cloud = sphere(2000)
    wrong = np.random.default_rng(2).random(2000) < share
    repaired, flipped = repair_signs(cloud, np.where(wrong[:, None], -cloud, cloud))
    npt.assert_array_equal(flipped, wrong)
    npt.assert_allclose(repaired, cloud)


def test_repair_turns_an_island_round():
    """A patch of a few dozen wrong signs is found although its inner points agree."""
    cloud = sphere(2000)
    wrong = cloud[:, 2] > 0.97
    assert wrong.sum() > 20
    _, flipped = repair_signs(cloud, np.where(wrong[:, None], -cloud, cloud))
    npt.assert_array_equal(flipped, wrong)


def test_smoothing_takes_noise_away():
    """Heights over a noisy plane shrink to about a third with 12 neighbours."""
    generator = np.random.default_rng(0)
    plane = np.column_stack([generator.random((2000, 2)), 0.005 * generator.normal(size=2000)])
    up = np.tile([0.0, 0.0, 1.0], (2000, 1))
    smooth = smooth_to_tangent_planes(plane, up)
    assert smooth[:, 2].std() < 0.4 * plane[:, 2].std()
    npt.assert_array_equal(smooth[:, :2], plane[:, :2])


def test_unit_normals_replaces_zero_length():
    """A normal without length is estimated, the others are only scaled."""
    cloud = sphere(200)
    given = 5e-200 * cloud
    given[3] = 0
    unit = unit_normals(given, cloud)
    npt.assert_allclose(np.linalg.norm(unit, axis=1), 1)
    assert abs(unit[3] @ cloud[3]) > 0.9


@pytest.mark.parametrize(
    "cloud", [np.zeros((20, 3)), np.arange(5.0)[:, None] * [1, 2, 3], [[1, 2, 3]]]
)
def test_degenerate_clouds_have_unit_normals(cloud):
    """Points on a line, in one place or alone still get unit vectors."""
    npt.assert_allclose(np.linalg.norm(estimate_normals(cloud), axis=1), 1)


def test_nearest_neighbours_never_name_the_point_itself():
    """Duplicates included."""
    cloud = np.repeat(sphere(10), 4, axis=0)
    found = nearest_neighbours(cloud, 5)
    assert found.shape == (40, 5)
    assert (found != np.arange(40)[:, None]).all()


def test_refuses():
    """Wrong shapes and numbers are named."""
    with pytest.raises(InvalidParameterError, match=r"Invalid k\. Must be at least 2\. Given: 1"):
        estimate_normals(sphere(5), k=1)
    with pytest.raises(InvalidCloudError, match=r"one for each of the 5 points\. Given: 4"):
        orient_normals(sphere(5), sphere(4))
