"""Parts of a surface that are inside out and hang together with the rest."""

import numpy as np
import numpy.testing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapes import ball, euler, hull

from meshlab_filter.fitting import fit_surface
from meshlab_filter.inversions import turn_inverted
from meshlab_filter.quality import edge_defects

UP = [0.0, 0.0, 1.0]


def slit_sheet(width, slit, bridge):
    """Return a sheet without a column of cells except for a bridge, the right of it turned."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(width + 1.0), np.arange(width + 1.0)))
    vertices = np.column_stack([x, y, 0.1 * np.sin(x + y)])
    left, right = [], []
    for row in range(width):
        for column in range(width):
            i = row * (width + 1) + column
            if column == slit and row >= bridge:
                continue
            cell = [[i, i + 1, i + width + 2], [i, i + width + 2, i + width + 1]]
            if column > slit:
                right += [face[::-1] for face in cell]
            else:
                left += cell
    return vertices, np.array(left), np.array(right)


def upward(vertices, faces):
    """Tell which faces face up."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)[:, 2] > 0


@given(
    width=st.integers(8, 12),
    slit=st.integers(2, 5),
    bridge=st.integers(1, 2),
    scale=st.sampled_from([1.0, 2.0**-30, 2.0**40]),
    sign=st.sampled_from([1, -1]),
)
@settings(max_examples=20, deadline=None)
def test_the_smaller_side_of_a_slit_is_turned(width, slit, bridge, scale, sign):
    """All face the same way in the end, whichever way the normals are; only the bridge is cut."""
    vertices, left, right = slit_sheet(width, slit, bridge)
    faces = np.vstack([left, right])
    normals = np.tile(UP, (len(vertices), 1)) * sign
    found = turn_inverted(vertices * scale, faces, normals)
    up = upward(vertices, found)
    assert up.all() or not up.any()
    assert up[0] == (len(left) >= len(right))
    assert len(faces) - len(found) == 2 * bridge


def test_nothing_is_turned_without_a_seam():
    """Normals alone turn nothing: a region where they are wrong has no border beside it."""
    vertices, left, right = slit_sheet(10, 4, 10)
    faces = np.vstack([left, right[:, ::-1]])
    normals = np.tile(UP, (len(vertices), 1))
    normals[np.linalg.norm(vertices[:, :2] - [8, 5], axis=1) < 2.5] *= -1
    npt.assert_array_equal(turn_inverted(vertices, faces, normals), faces)
    npt.assert_array_equal(turn_inverted(vertices, faces[:0], normals), faces[:0])


@given(seed=st.integers(0, 10_000))
@settings(max_examples=150, deadline=None)
def test_something_always_stays(seed):
    """A few faces in any disorder: where every one is at the cut, none goes, and a fit ends."""
    rng = np.random.default_rng(seed)
    size = rng.integers(4, 8)
    vertices, normals = rng.normal(size=(2, size, 3))
    faces = np.array([rng.permutation(size)[:3] for _ in range(rng.integers(2, 5))])
    assert 0 < len(turn_inverted(vertices, faces, normals)) <= len(faces)
    fit_surface(vertices, faces, rng.normal(size=(40, 3)), normals=normals)


def test_a_long_joint_is_not_cut():
    """Where more would be cut than is gained, both sides stay."""
    vertices, left, right = slit_sheet(10, 4, 7)
    faces = np.vstack([left, right])
    npt.assert_array_equal(turn_inverted(vertices, faces, np.tile(UP, (len(vertices), 1))), faces)


@pytest.mark.parametrize("seed", range(3))
def test_a_ball_with_its_cap_inside_out_is_closed(seed):
    """The seam around the cap is sewn up once the cap is turned, and only then."""
    vertices, points = ball(600, seed), ball(12000, seed + 1)
    faces = hull(vertices)
    middle = vertices[faces].mean(axis=1)
    cap = middle[:, 2] > 0.5
    seam = (np.abs(middle[:, 2] - 0.5) < 0.06) & (middle[:, 0] < 0.8)
    faces[cap] = faces[cap][:, ::-1]
    faces = faces[~seam]
    assert edge_defects(faces)["boundary_edges"] > 20
    fitted = fit_surface(vertices, faces, points, normals=vertices)
    assert edge_defects(fitted)["boundary_edges"] == 0
    assert euler(fitted) == 2
    a, b, c = (vertices[fitted[:, corner]] for corner in range(3))
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) > 0).all()
    assert edge_defects(fit_surface(vertices, faces, points))["boundary_edges"] > 0
