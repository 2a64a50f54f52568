"""Holes closed where the original points say that there is surface."""

import numpy as np
import numpy.testing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay
from shapes import hull

from meshlab_filter.fitting import fit_surface
from meshlab_filter.holes import close_holes
from meshlab_filter.loops import boundary_loops, facing_loops
from meshlab_filter.patches import triangulate
from meshlab_filter.quality import edge_defects


def ball(count, seed=0):
    """Return points on the unit sphere."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1)[:, None]


@given(seed=st.integers(0, 500), removed=st.integers(1, 6))
@settings(max_examples=15, deadline=None)
def test_holes_of_a_ball_are_closed(seed, removed):
    """Faces taken out of a closed surface come back, oriented alike, whatever they touch."""
    rng = np.random.default_rng(seed)
    vertices, points = ball(150, seed), ball(6000, seed + 1)
    whole = hull(vertices)
    middle = vertices[whole].mean(axis=1)
    gone = np.argsort(middle @ middle[rng.integers(len(whole))])[-removed:]
    closed = close_holes(vertices, np.delete(whole, gone, axis=0), points)
    assert edge_defects(closed)["boundary_edges"] == 0
    a, b, c = (vertices[closed[:, corner]] for corner in range(3))
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) > 0).all()


def test_the_border_of_an_open_scan_stays_open():
    """Half a ball without points on the other half keeps its border."""
    vertices, points = ball(300), ball(12000, 1)
    faces = hull(vertices)
    used, faces = np.unique(faces[(vertices[faces][:, :, 2] > 0).all(axis=1)], return_inverse=True)
    vertices, faces = vertices[used], faces.reshape(-1, 3)
    closed = close_holes(vertices, faces, points[points[:, 2] > -0.05], max_edges=1000)
    npt.assert_array_equal(closed, faces)


def sheet_with_a_hole(width):
    """Return a sheet of 9 × 9 unit squares without a square in the middle, and points on it."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(10.0), np.arange(10.0)))
    vertices = np.column_stack([x, y, 0 * x])
    cells = np.array([i for i in range(90) if i % 10 < 9])
    middle = np.abs(vertices[cells][:, :2] + 0.5 - 4.5).max(axis=1) < width / 2
    faces = [f for i in cells[~middle] for f in ([i, i + 1, i + 11], [i, i + 11, i + 10])]
    used, faces = np.unique(faces, return_inverse=True)
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0, 9, 91), np.linspace(0, 9, 91)))
    points = np.column_stack([u, v, 0 * u])
    on = np.abs(points[:, :2] - 4.5).max(axis=1) >= width / 2
    return vertices[used], faces.reshape(-1, 3), points[on]


def test_a_vertex_left_out_closes_its_hole():
    """Of a hole without points, one vertex that was kept says that there is surface."""
    vertices, faces, points = sheet_with_a_hole(3)
    npt.assert_array_equal(close_holes(vertices, faces, points), faces)
    stray = np.array([[4.4, 4.6, 0.1]])
    closed = close_holes(np.vstack([vertices, stray]), faces, np.vstack([points, stray]))
    assert edge_defects(closed)["holes"] == 1
    assert edge_defects(closed)["boundary_edges"] == 36


def test_points_over_more_than_half_of_a_hole_close_it():
    """A quarter of the density over more than half of it is enough; over a sixth it is not."""
    vertices, faces, points = sheet_with_a_hole(3)
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(3.1, 5.9, 14), np.linspace(3.1, 4.8, 9)))
    some = np.column_stack([u, v, 0 * u])
    assert edge_defects(close_holes(vertices, faces, np.vstack([points, some])))["holes"] == 1
    few = some[some[:, 1] < 3.6]
    npt.assert_array_equal(close_holes(vertices, faces, np.vstack([points, few])), faces)


def test_what_is_covered_is_closed_when_asked():
    """A sheet under a hole: its points are the lower sheet's, unless the hole is to go anyway."""
    vertices, faces, _ = sheet_with_a_hole(3)
    below, whole, _ = sheet_with_a_hole(0)
    both = np.vstack([vertices, below - [0, 0, 0.01]])
    mesh = np.vstack([faces, whole + len(vertices)])
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0, 9, 91), np.linspace(0, 9, 91)))
    cloud = np.column_stack([u, v, np.full(len(u), -0.01)])
    npt.assert_array_equal(close_holes(both, mesh, cloud), mesh)
    # The borders around the two sheets are holes like any other then, with points all over them.
    closed = close_holes(both, mesh, cloud, covered=True, max_edges=20)
    assert len(closed) == len(mesh) + 10


def test_long_holes_stay():
    """A hole of more edges than allowed is left as it is."""
    vertices, points = ball(150), ball(6000, 1)
    faces = hull(vertices)[1:]
    assert len(close_holes(vertices, faces, points, max_edges=3)) == len(faces) + 1
    npt.assert_array_equal(close_holes(vertices, faces, points, max_edges=2), faces)


def test_holes_that_touch_are_loops_of_their_own():
    """Two triangles missing around a vertex, not beside each other."""
    fan = np.array([[0, i, i % 6 + 1] for i in range(1, 7)])
    loops = boundary_loops(np.delete(fan, [0, 3], axis=0))
    assert sorted(map(len, loops)) in ([3, 3], [8], [4, 4])
    assert sum(map(len, loops)) == 8


def test_triangulation_of_least_area():
    """A bent square is closed along its shorter bend."""
    corners = np.array([[0.0, 0, 0], [1, 0, 1], [1, 1, 0], [0, 1, 0.9]])
    found = triangulate(corners, np.arange(4), np.array([], dtype=np.int64), np.zeros((4, 3)))
    areas = {}
    for faces in ([[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]):
        a, b, c = (corners[np.array(faces)[:, corner]] for corner in range(3))
        areas[str(sorted(map(sorted, faces)))] = np.linalg.norm(
            np.cross(b - a, c - a), axis=1
        ).sum()
    assert str(sorted(sorted(map(int, face)) for face in found)) == min(areas, key=areas.get)


def test_no_triangulation_repeats_an_edge():
    """Where both chords of a square are edges already there is none."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    both = np.array([0 * 4 + 2, 1 * 4 + 3])
    assert triangulate(corners, np.arange(4), both, np.zeros((4, 3))) is None
    assert len(triangulate(corners, np.arange(4), both[:1], np.zeros((4, 3)))) == 2


@pytest.mark.parametrize(
    ("beside", "expected"), [(1.0, [[0, 1, 2], [0, 2, 3]]), (-1.0, [[0, 1, 3], [1, 2, 3]])]
)
def test_triangulation_does_not_fold_onto_the_face_beside(beside, expected):
    """Of two triangulations with the same area, the one without a sharp edge at the rim."""
    corners = np.array([[0.0, 0, 0], [1, 0, 2], [1, 1, 0], [0, 1, 2]])
    around = np.zeros((4, 3))
    around[0, 1] = beside
    found = triangulate(corners, np.arange(4), np.array([], dtype=np.int64), around)
    assert sorted(sorted(face) for face in found.tolist()) == expected


def tube(rings, around=12, gap=()):
    """Return vertices on a tube, its faces without those of some rings, and which way is out."""
    angle = 2 * np.pi * np.arange(around) / around
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(around)])
    vertices = np.vstack([ring + np.array([0, 0, 0.5 * z]) for z in range(rings)])
    faces = []
    for z in set(range(rings - 1)) - set(gap):
        for i in range(around):
            a, b = z * around + i, z * around + (i + 1) % around
            faces += [[a, b, b + around], [a, b + around, a + around]]
    return vertices, np.array(faces)


def test_a_tube_cut_in_two_is_joined():
    """Two borders that face each other get a band between them, if points lie on it."""
    vertices, faces = tube(8, gap=(3,))
    rng = np.random.default_rng(0)
    angle, height = rng.uniform(0, 2 * np.pi, 4000), rng.uniform(0, 3.5, 4000)
    points = np.column_stack([np.cos(angle), np.sin(angle), height])
    assert len(facing_loops(vertices, boundary_loops(faces))) == 1
    npt.assert_array_equal(close_holes(vertices, faces, points), faces)
    joined = close_holes(vertices, faces, points, bands=True)
    assert len(joined) == len(faces) + 24
    assert edge_defects(joined) == {"boundary_edges": 24, "nonmanifold_edges": 0, "holes": 2}
    directed = np.column_stack([joined.ravel(), np.roll(joined, -1, axis=1).ravel()])
    assert len(np.unique(directed, axis=0)) == len(directed), "a side runs the same way twice"
    elsewhere = points[(height < 1.5) | (height > 2)]
    npt.assert_array_equal(close_holes(vertices, faces, elsewhere, bands=True), faces)


def test_borders_that_run_the_same_way_do_not_face_each_other():
    """One half of the tube inside out: no band can join them."""
    vertices, faces = tube(8, gap=(3,))
    upper = vertices[faces, 2].min(axis=1) > 1.6
    faces[upper] = faces[upper][:, ::-1]
    near = [loop for loop in boundary_loops(faces) if 1.4 < vertices[loop, 2].mean() < 2.1]
    assert len(near) == 2
    assert facing_loops(vertices, near) == []


@pytest.mark.parametrize("inner", [None, 0.7])
def test_an_open_sheet_gets_no_back(inner):
    """Neither a disc nor a ring is closed over itself, though points lie all over that."""
    rng = np.random.default_rng(3)
    angle, radius = rng.uniform(0, 2 * np.pi, 9000), np.sqrt(rng.uniform(0, 1, 9000))
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0.05 * radius**2])
    points = points[radius >= (inner or 0)]
    rims = [np.linspace(0, 2 * np.pi, 60)[:-1]] * (1 if inner is None else 2)
    rim = [
        np.column_stack([r * np.cos(a), r * np.sin(a), 0.05 * r * r + 0 * a])
        for a, r in zip(rims, (1.0, inner))
    ]
    vertices = np.vstack([*rim, points[:150]])
    faces = Delaunay(vertices[:, :2]).simplices
    if inner:
        faces = faces[np.linalg.norm(vertices[faces].mean(axis=1)[:, :2], axis=1) > inner]
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    down = np.cross(b - a, c - a)[:, 2] < 0
    faces[down] = faces[down][:, ::-1]
    closed = close_holes(vertices, faces, points, covered=True, bands=True, max_edges=160)
    npt.assert_array_equal(closed, faces)


@pytest.mark.parametrize("faces", [np.empty((0, 3), dtype=int), [[0, 1, 2]]])
def test_nothing_to_close(faces):
    """No face, or a single one, stays."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    points = np.array([[0.2, 0.2, 0.0]])
    npt.assert_array_equal(fit_surface(corners, faces, points), np.reshape(faces, (-1, 3)))
