"""What the adaptive method keeps of shapes in which other samplers lose something, measured."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from meshlab_filter.methods.adaptive import rank


def random_choice(cloud, count):
    return np.random.default_rng(0).choice(len(cloud), count, replace=False)


def kept(cloud, count, **options):
    return rank(cloud, count=count, **options).indices


def plane_error(cloud, normals, indices, k=6):
    """Mean distance of all points, along their normals, to the mean of the nearest kept ones."""
    far, near = cKDTree(cloud[indices]).query(cloud, k)
    weight = np.exp(-((far / far[:, -1:]) ** 2))
    heights = np.einsum("nkj,nj->nk", cloud[indices][near] - cloud[:, None], normals)
    return np.abs((weight * heights).sum(axis=1) / weight.sum(axis=1)).mean()


def covering(cloud, indices):
    return cKDTree(cloud[indices]).query(cloud)[0].max()


def square(size, seed=0):
    p = np.zeros((size, 3))
    p[:, :2] = np.random.default_rng(seed).random((size, 2))
    return p


def cube(size, seed=0):
    """Points on the faces of the unit cube and, one in ten, on its edges."""
    generator = np.random.default_rng(seed)
    p = generator.random((size, 3))
    axis = generator.integers(3, size=size)
    row = np.arange(size)
    p[row, axis] = generator.integers(2, size=size)
    edge = row < size // 10
    other = (axis + 1 + generator.integers(2, size=size)) % 3
    p[row[edge], other[edge]] = generator.integers(2, size=edge.sum())
    return p, edge


def test_plane_is_thinned_evenly():
    """Where everything is flat the spacing varies a quarter less than a random choice's."""
    cloud = square(3000)
    spread = []
    for indices in (kept(cloud, 300), random_choice(cloud, 300)):
        near = cKDTree(cloud[indices]).query(cloud[indices], 2)[0][:, 1]
        spread.append(near.std() / near.mean())
    assert spread[0] < 0.75 * spread[1]
    assert covering(cloud, kept(cloud, 300)) < covering(cloud, random_choice(cloud, 300))


def test_border_of_an_open_surface_stays():
    """Border points are kept over twice as often as others, near all four corners too."""
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, 60), np.linspace(0, 1, 60)))
    cloud = np.column_stack([x, y, 0.1 * np.sin(3 * x)])
    indices = kept(cloud, 200)
    border = (x == 0) | (x == 1) | (y == 0) | (y == 1)
    assert border[indices].mean() > 2 * border.mean()
    for corner in ([0, 0], [0, 1], [1, 0], [1, 1]):
        away = np.abs(cloud[indices, :2] - corner).sum(axis=1).min()
        assert away < 0.05


def test_sharp_edges_of_a_cube_stay():
    """The points on the edges are a tenth of the cloud and over a fifth of what is kept."""
    cloud, edge = cube(8000)
    indices = kept(cloud, 800)
    assert edge[indices].mean() > 0.2
    # Few of the faces' points are needed, but no face is left without.
    assert covering(cloud, indices) < 0.25


def test_curved_gets_more_than_flat():
    """A capsule's caps keep a denser cloud than its straight middle."""
    generator = np.random.default_rng(0)
    t, z = generator.random(6000) * 2 * np.pi, generator.uniform(-3, 3, 6000)
    middle = np.column_stack([np.cos(t), np.sin(t), z])
    cap = generator.normal(size=(2000, 3))
    cap /= np.linalg.norm(cap, axis=1, keepdims=True)
    cap[:, 2] += np.sign(cap[:, 2]) * 3
    cloud = np.concatenate([middle, cap])
    indices = kept(cloud, 400)
    assert (indices >= 6000).mean() > 1.2 * 0.25


def test_error_is_well_below_a_random_choice():
    """On a bumpy surface of uneven density the tangent-plane error is less than two thirds."""
    generator = np.random.default_rng(0)
    x, y = generator.random(12000) ** 3, generator.random(12000)
    cloud = np.column_stack([x, y, 0.05 * np.sin(9 * x) * np.cos(9 * y)])
    slope = np.column_stack(
        [
            -0.45 * np.cos(9 * x) * np.cos(9 * y),
            0.45 * np.sin(9 * x) * np.sin(9 * y),
            np.ones(12000),
        ]
    )
    normals = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    ours = plane_error(cloud, normals, kept(cloud, 600))
    assert ours < 0.67 * plane_error(cloud, normals, random_choice(cloud, 600))


def test_uneven_density_is_evened_out():
    """A dense patch of a plane with over half the points keeps less than two fifths."""
    cloud = np.concatenate([square(3000), square(3000, seed=1) * [0.3, 0.3, 1]])
    inside = (cloud[:, :2] < 0.3).all(axis=1)
    share = inside[kept(cloud, 400)].mean()
    assert inside.mean() > 0.5
    assert 0.09 < share < 0.4


def test_every_part_keeps_points():
    """Of twelve separate spheres each keeps about its share."""
    generator = np.random.default_rng(0)
    p = generator.normal(size=(4800, 3))
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    part = np.arange(4800) % 12
    p[:, 0] += 5 * part
    counts = np.bincount(part[kept(p, 480)], minlength=12)
    assert counts.min() > 25
    assert counts.max() < 60


def test_both_sides_of_a_thin_sheet_stay():
    """Two sheets closer than the kept spacing both stay, each about evenly."""
    cloud = np.concatenate([square(3000), square(3000, seed=1) + np.array([0, 0, 0.03])])
    normals = np.tile([0.0, 0.0, 1.0], (6000, 1))
    indices = kept(cloud, 600, normals=normals)
    assert 0.4 < (indices < 3000).mean() < 0.6
    for side in (indices[indices < 3000], indices[indices >= 3000]):
        away = cKDTree(cloud[side][:, :2]).query(cloud[:, :2])[0]
        assert away.max() < 0.15


@pytest.mark.parametrize("size", [20, 40, 60])
def test_a_few_dozen_points(size):
    """Half of a tiny cloud still reaches all of it."""
    generator = np.random.default_rng(size)
    p = generator.normal(size=(size, 3))
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    indices = kept(p, size // 2)
    assert covering(p, indices) <= covering(p, random_choice(p, size // 2))


def test_noisy_switch_keeps_fewer_outliers():
    """Of a noisy plane, the points kept lie nearer to it with the switch."""
    cloud = square(4000)
    cloud[:, 2] = 0.3 / 64 * np.random.default_rng(3).normal(size=4000)
    normals = np.tile([0.0, 0.0, 1.0], (4000, 1))
    off = [
        np.abs(cloud[kept(cloud, 400, normals=normals, noisy=noisy), 2]).mean()
        for noisy in (False, True)
    ]
    assert off[1] < 0.8 * off[0]


def test_evenness_and_crease_safety_do_what_they_say():
    """More evenness: a smaller covering radius; more crease safety: more points on edges."""
    cloud, edge = cube(5000)
    reach = [covering(cloud, kept(cloud, 400, evenness=e)) for e in (0.0, 2.0)]
    assert reach[1] < reach[0]
    edges = [edge[kept(cloud, 400, crease_safety=c)].mean() for c in (0.0, 2.0)]
    assert edges[1] > edges[0]
