"""MeshLab's own samplers behind the interface of the methods."""

import numpy as np
import numpy.testing as npt
import pytest
from scipy.spatial import cKDTree

from meshlab_filter.bridge.samplers import rank_clustered_vertex, rank_poisson_disk
from meshlab_filter.errors import InvalidCloudError, InvalidParameterError
from meshlab_filter.methods.registry import METHODS
from meshlab_filter.simplification import simplify

POINTS = np.random.default_rng(1).random((2000, 3)) * [1.0, 2.0, 0.5] + 100.0
SAMPLERS = (rank_poisson_disk, rank_clustered_vertex)


@pytest.mark.parametrize("rank", SAMPLERS)
@pytest.mark.parametrize("count", [20, 400, 1000])
def test_count_is_nearly_met(rank, count):
    """The samples are points of the cloud, nearly as many as asked for."""
    result = rank(POINTS, count=count)
    assert result.info["missed"] == len(result.indices) - count
    assert abs(result.info["missed"]) <= max(2, 0.02 * count)


@pytest.mark.parametrize("rank", SAMPLERS)
def test_all_points_stay_when_all_are_asked_for(rank):
    """Asking for every point gives every point."""
    assert len(rank(POINTS, count=len(POINTS)).indices) == len(POINTS)


def test_poisson_samples_keep_their_distance():
    """The nearest two samples are farther apart than in a random choice of as many points."""
    kept = POINTS[rank_poisson_disk(POINTS, count=200).indices]
    chance = POINTS[np.random.default_rng(0).permutation(len(POINTS))[: len(kept)]]
    nearest = [cKDTree(cloud).query(cloud, k=2)[0][:, 1].min() for cloud in (kept, chance)]
    assert nearest[0] > 2 * nearest[1]


def test_clustered_vertex_repeats_itself():
    """The grid uses no randomness, so that two runs keep the same points."""
    first, second = (rank_clustered_vertex(POINTS, count=150) for _ in range(2))
    npt.assert_array_equal(first.rank, second.rank)


@pytest.mark.parametrize("rank", SAMPLERS)
@pytest.mark.parametrize("count", [None, 0, 2001, 1.5])
def test_bad_counts_are_refused(rank, count):
    """A count must be given and lie between 1 and N."""
    with pytest.raises(InvalidParameterError, match="Invalid count"):
        rank(POINTS, count=count)


@pytest.mark.parametrize("rank", SAMPLERS)
def test_bad_points_are_refused(rank):
    """Coordinates that are not finite never reach MeshLab."""
    with pytest.raises(InvalidCloudError, match="finite"):
        rank([[0.0, 0.0, np.nan]], count=1)


@pytest.mark.parametrize("rank", SAMPLERS)
def test_coinciding_points_are_no_trap(rank):
    """Points in one place leave one, where MeshLab alone would search without end."""
    assert len(rank(np.ones((50, 3)), count=5).indices) == 1
    assert len(rank(np.repeat(POINTS[:40], 3, axis=0), count=100).indices) == 40


@pytest.mark.parametrize(("name", "seeded"), [("poisson-disk", False), ("clustered-vertex", True)])
def test_registry_finds_the_samplers(name, seeded):
    """The registry imports them from the bridge and says which of them repeats itself."""
    assert METHODS[name].load() in SAMPLERS
    assert METHODS[name].seeded is seeded


@pytest.mark.parametrize("name", METHODS)
def test_every_method_runs_from_the_front_door(name):
    """``simplify`` runs each method by its name and says by how much it missed the count."""
    result = simplify(POINTS, method=name, count=500)
    assert result.method == name
    assert result.missed == len(result.indices) - 500
    assert abs(result.missed) <= 25
