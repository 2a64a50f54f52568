"""Flaps, seams and vertices left out: what is mended in a rebuilt surface before edges flip."""

import numpy as np
import numpy.testing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay
from shapes import ball, euler, hull

from meshlab_filter.fitting import fit_surface
from meshlab_filter.flaps import border_sides, remove_flaps
from meshlab_filter.insertion import insert_vertices
from meshlab_filter.quality import edge_defects
from meshlab_filter.seams import relay_seams
from meshlab_filter.triangles import barycentric, squared_distances


def same(one, other):
    """Compare faces whatever their order and whichever corner comes first."""
    return {frozenset(face) for face in one.tolist()} == {frozenset(f) for f in other.tolist()}


@given(seed=st.integers(0, 500))
@settings(max_examples=10, deadline=None)
def test_a_flap_on_a_ball_goes_and_nothing_else(seed):
    """A second sheet over part of a closed surface is taken away whole."""
    vertices, points = ball(150, seed), ball(4000, seed + 1)
    faces = hull(vertices)
    middle = vertices[faces].mean(axis=1)
    flap = faces[np.argsort(middle @ middle[0])[-8:]]
    used, place = np.unique(flap, return_inverse=True)
    lifted = vertices[used] * 1.01 + np.random.default_rng(seed).normal(0, 0.01, (len(used), 3))
    found = remove_flaps(
        np.vstack([vertices, lifted]),
        np.vstack([faces, len(vertices) + place.reshape(-1, 3)]),
        points,
    )
    assert same(found, faces)


def sheet(side, height=0.0, seed=0):
    """Return points over a square in the plane, and faces between them."""
    xy = np.random.default_rng(seed).random((side * side, 2)) * side
    xy[:4] = [[0, 0], [side, 0], [0, side], [side, side]]
    return np.column_stack([xy, np.full(len(xy), height)]), Delaunay(xy).simplices.astype(np.int64)


def test_an_open_sheet_keeps_its_border():
    """Nothing lies under a border: no face goes, and nothing is laid anew."""
    vertices, faces = sheet(12)
    points = sheet(40, seed=1)[0] * 12 / 40
    npt.assert_array_equal(remove_flaps(vertices, faces, points), faces)
    assert same(relay_seams(vertices, faces, points), faces)


def test_a_second_wall_is_no_flap():
    """Two sheets, a third of an edge from each other, both stay."""
    one, faces = sheet(12)
    two, others = sheet(12, height=1 / 3, seed=1)
    dense = [sheet(40, height=h * 40 / 12, seed=s)[0] * 12 / 40 for h, s in ((0, 2), (1 / 3, 3))]
    both = np.vstack([faces, others + len(one)])
    vertices, points = np.vstack([one, two]), np.vstack(dense)
    assert len(remove_flaps(vertices, both, points)) >= len(both) - 2


def test_a_slit_is_sewn_up():
    """Borders that run along each other, with vertices of their own, become one closed surface."""
    vertices, points = ball(400), ball(12000, 1)
    faces = hull(vertices)
    middle = vertices[faces].mean(axis=1)
    up = middle[:, 2] > 0
    # Of the equator, a third: elsewhere both halves share their vertices.
    twice = np.intersect1d(faces[up], faces[~up])
    twice = twice[vertices[twice][:, 0] > 0.5]
    copy = np.arange(len(vertices))
    copy[twice] = len(vertices) + np.arange(len(twice))
    halves = np.vstack([faces[up], copy[faces[~up]]])
    slit = np.vstack([vertices, vertices[twice] + 1e-3])
    assert edge_defects(halves)["boundary_edges"] > 10
    sewn = relay_seams(slit, halves, points)
    assert edge_defects(sewn)["boundary_edges"] == 0
    assert edge_defects(sewn)["nonmanifold_edges"] == 0
    assert euler(sewn) == 2


@given(seed=st.integers(0, 500))
@settings(max_examples=15, deadline=None)
def test_vertices_left_out_are_put_in(seed):
    """All of them get a face; the surface stays closed and what it was."""
    vertices = ball(200, seed)
    faces = hull(vertices[:120])
    found = insert_vertices(vertices, faces, max_rounds=20)
    npt.assert_array_equal(np.unique(found), np.arange(len(vertices)))
    assert edge_defects(found) == edge_defects(faces)
    assert euler(found) == 2
    directed = np.column_stack([found.ravel(), np.roll(found, -1, axis=1).ravel()])
    assert len(np.unique(directed, axis=0)) == len(directed), "a side runs the same way twice"


def test_vertices_on_sides_split_both_faces():
    """A point half-way on an inner side and one on the border of two triangles."""
    corners = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [1, 1, 0], [1, 0, 0]])
    found = insert_vertices(corners, [[0, 1, 2], [0, 2, 3]])
    assert same(found, np.array([[0, 5, 4], [5, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]))
    a, b, c = (corners[found[:, i]] for i in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


@pytest.mark.parametrize(
    "place", [(0.5, 0.5, 5.0), (-3.0, -3.0, 0.0)], ids=["far above", "off a corner"]
)
def test_outliers_stay_out(place):
    """A vertex far from the surface is not made part of it."""
    corners = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], place])
    npt.assert_array_equal(insert_vertices(corners, [[0, 1, 2]]), [[0, 1, 2]])


def test_a_triangle_on_its_own_back_is_not_split_along_a_side():
    """Both would get the same new edge, four faces at it."""
    corners = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [1, 0, 0]])
    faces = np.array([[0, 1, 2], [1, 0, 2]])
    assert edge_defects(insert_vertices(corners, faces))["nonmanifold_edges"] == 0


def damaged(seed):
    """Return a ball with a hole, a flap, a seam and vertices left out, and its points."""
    rng = np.random.default_rng(seed)
    vertices, points = ball(500, seed), ball(12000, seed + 1)
    inside = vertices[:420]
    faces = hull(inside)
    middle = inside[faces].mean(axis=1)
    hole = np.argsort(middle @ middle[rng.integers(len(faces))])[-6:]
    flap = faces[np.argsort(middle @ middle[rng.integers(len(faces))])[-8:]]
    used, place = np.unique(flap, return_inverse=True)
    lifted = inside[used] * 1.004
    broken = np.vstack([np.delete(faces, hole, axis=0), len(vertices) + place.reshape(-1, 3)])
    return np.vstack([vertices, lifted]), broken, points


@pytest.mark.parametrize("seed", range(4))
def test_a_damaged_ball_is_mended(seed):
    """All together: closed, of one piece, and nearer to the points than it was."""
    vertices, faces, points = damaged(seed)
    fitted = fit_surface(vertices, faces, points)
    assert edge_defects(fitted)["boundary_edges"] == 0
    assert edge_defects(fitted)["nonmanifold_edges"] == 0
    assert euler(fitted) == 2
    assert np.isin(np.arange(500), fitted).mean() > 0.99
    corners = [vertices[fitted[:, i]] for i in range(3)]
    nearest = np.min(
        [squared_distances(points[:300], *(np.broadcast_to(c[f], (300, 3)) for c in corners))
         for f in range(len(fitted))], axis=0
    )  # fmt: skip
    assert np.sqrt(nearest.mean()) < 0.015


@given(seed=st.integers(0, 100_000))
@settings(max_examples=60, deadline=None)
def test_any_disorder_is_fitted(seed):
    """Faces that cross, repeat, turn either way or have no area: some faces come out of it."""
    rng = np.random.default_rng(seed)
    size = int(rng.integers(3, 30))
    vertices = rng.normal(size=(size, 3)) * [1, rng.choice([0, 1]), rng.choice([0, 0.1, 1])]
    if rng.random() < 0.3:
        vertices[rng.integers(size)] = vertices[0]
    faces = np.array([rng.permutation(size)[:3] for _ in range(rng.integers(1, 40))])
    points = np.vstack([vertices, rng.normal(size=(rng.integers(1, 100), 3))])
    fitted = fit_surface(vertices, faces, points, normals=rng.normal(size=(size, 3)))
    assert len(fitted) > 0
    assert 0 <= fitted.min() <= fitted.max() < size


def test_fitting_does_not_depend_on_scale():
    """Scaling by a power of two changes nothing."""
    vertices, faces, points = damaged(1)
    npt.assert_array_equal(
        fit_surface(vertices * 1024, faces, points * 1024), fit_surface(vertices, faces, points)
    )


def test_border_sides_and_barycentric_coordinates_of_nothing_and_of_lines():
    """No faces have no sides; a triangle without area has no coordinates."""
    assert border_sides(np.empty((0, 3), dtype=np.int64)).shape == (0, 3)
    line = [np.array([[x, 0.0, 0.0]]) for x in (0.0, 1.0, 2.0)]
    npt.assert_array_equal(barycentric(np.array([[1.0, 1, 0]]), *line), [[0, 0, 0]])


def test_nothing_to_fit():
    """A surface without faces stays one."""
    points = np.random.default_rng(0).random((9, 3))
    assert fit_surface(points, np.empty((0, 3)), points).shape == (0, 3)
