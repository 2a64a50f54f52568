"""Figures that say how good a simplified cloud and its surface are."""

import numpy as np
import numpy.testing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from meshlab_filter.errors import InvalidCloudError, InvalidParameterError
from meshlab_filter.quality import (
    acceptable_share,
    compactness,
    covering_radius,
    edge_defects,
    median_spacing,
    summarise_errors,
)

TETRAHEDRON = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]


def test_compactness_by_hand():
    """Eq. 11 for an equilateral, a right-angled and a degenerate triangle."""
    points = [[0, 0, 0], [1, 0, 0], [0.5, 0.75**0.5, 0], [0, 1, 0], [2, 0, 0]]
    expected = [1, 4 * 3**0.5 * 0.5 / (1 + 1 + 2), 0]
    npt.assert_allclose(compactness(points, [[0, 1, 2], [0, 1, 3], [0, 1, 4]]), expected)


def test_compactness_of_a_triangle_in_one_place_is_zero():
    """No side, no area: zero rather than a division by zero."""
    npt.assert_array_equal(compactness([[1, 1, 1]] * 3, [[0, 1, 2]]), [0.0])


@given(st.integers(0, 2**32 - 1), st.floats(1e-6, 1e6))
def test_compactness_is_a_shape(seed, scale):
    """In 0 … 1, and the same at any scale."""
    points = np.random.default_rng(seed).normal(size=(3, 3))
    found = compactness(points, [[0, 1, 2]])
    assert 0 <= found[0] <= 1 + 1e-12
    npt.assert_allclose(compactness(points * scale, [[0, 1, 2]]), found, rtol=1e-9)


def test_acceptable_share_counts_the_limit_in():
    """A compactness of 0.6 is acceptable; without triangles there is no share."""
    assert acceptable_share(np.array([0.59, 0.6])) == 0.5
    assert acceptable_share(np.array([])) is None


def test_errors_uncut_and_cut():
    """The cut drops far samples from every figure and says how many."""
    distances = np.array([0.0, 1.0, 2.0, 50.0])
    uncut = summarise_errors(distances, diagonal=100)
    assert uncut == {
        "mean": pytest.approx(0.1325), "rms": pytest.approx(np.sqrt(2505 / 4) / 100),
        "p95": pytest.approx(np.percentile(distances, 95) / 100),
        "p99": pytest.approx(np.percentile(distances, 99) / 100),
        "max": 0.5, "samples": 4, "dropped": 0,
    }  # fmt: skip
    cut = summarise_errors(distances, diagonal=100, cut=0.01)
    assert (cut["samples"], cut["dropped"], cut["max"]) == (2, 2, 0.01)


def test_errors_with_every_sample_dropped():
    """Figures are None then, not NaN."""
    found = summarise_errors([5.0], diagonal=1.0, cut=0.01)
    assert found["mean"] is None
    assert (found["samples"], found["dropped"]) == (0, 1)


@pytest.mark.parametrize("diagonal", [0, -1, np.nan])
def test_errors_need_a_diagonal(diagonal):
    """A cloud in one place has no scale."""
    with pytest.raises(InvalidParameterError, match=r"diagonal.*Given"):
        summarise_errors([1.0], diagonal=diagonal)


def test_a_closed_mesh_has_no_defects():
    """Every edge of a tetrahedron has two faces."""
    assert edge_defects(TETRAHEDRON) == {"boundary_edges": 0, "nonmanifold_edges": 0, "holes": 0}


def test_holes_are_counted_apart():
    """Two tetrahedra, a face missing from each, have a hole each."""
    faces = np.vstack([np.array(TETRAHEDRON)[1:], np.array(TETRAHEDRON)[1:] + 4])
    assert edge_defects(faces) == {"boundary_edges": 6, "nonmanifold_edges": 0, "holes": 2}


def test_an_edge_of_three_faces_is_not_manifold():
    """Three faces around one edge."""
    found = edge_defects([[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    assert (found["nonmanifold_edges"], found["boundary_edges"]) == (1, 6)


def test_no_faces_no_defects():
    """A cloud has none."""
    assert edge_defects(np.empty((0, 3))) == {
        "boundary_edges": 0, "nonmanifold_edges": 0, "holes": 0,
    }  # fmt: skip


def test_spacing_of_a_grid():
    """On a cubic grid the six nearest neighbours are one step away."""
    grid = np.stack(np.meshgrid(*[np.arange(9.0)] * 3), axis=-1).reshape(-1, 3)
    assert median_spacing(grid * 0.25) == pytest.approx(0.25, rel=0.1)


def test_spacing_of_few_points():
    """One point has none; two have their distance."""
    assert median_spacing([[1, 2, 3]]) == 0
    assert median_spacing([[0, 0, 0], [0, 3, 4]]) == 5


def test_covering_radius_needs_points():
    """Without kept points there is no radius."""
    with pytest.raises(InvalidCloudError, match="Given: 0"):
        covering_radius([[0, 0, 0]], np.empty((0, 3)))
