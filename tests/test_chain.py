"""The whole chain from Python: run and compare."""

import json

import numpy as np
import numpy.testing as npt
import plyfile
import pytest

import meshlab_filter as mf
from meshlab_filter.bridge.distance import distances, hausdorff
from meshlab_filter.bridge.layer import add_layer
from meshlab_filter.bridge.samples import sample_mesh
from meshlab_filter.bridge.session import import_pymeshlab
from meshlab_filter.chain import FILES


def sphere(count: int = 1500) -> np.ndarray:
    """Return points spread evenly over the unit sphere (a Fibonacci lattice)."""
    index = np.arange(count) + 0.5
    height = 1 - 2 * index / count
    angle = np.pi * (1 + 5**0.5) * index
    radius = np.sqrt(1 - height**2)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    """Write the sphere as a PLY file with a custom property."""
    path = tmp_path_factory.mktemp("scan") / "scan.ply"
    points = sphere()
    rows = np.empty(len(points), dtype=[("x", "f4"), ("y", "f4"), ("z", "f4"), ("id", "i4")])
    rows["x"], rows["y"], rows["z"] = points.T
    rows["id"] = np.arange(len(points))
    plyfile.PlyData([plyfile.PlyElement.describe(rows, "vertex")], byte_order="<").write(str(path))
    return path


@pytest.fixture(scope="module")
def outcome(scan, tmp_path_factory):
    """Run the chain once and return its folder and report."""
    out = tmp_path_factory.mktemp("out")
    return out, mf.run(scan, out, count=300)


def test_run_writes_every_file(outcome):
    """The folder holds what the documentation says, and nothing half-written."""
    out, _ = outcome
    assert set(FILES) <= {file.name for file in out.iterdir()}
    assert not [file for file in out.iterdir() if "partial" in file.name]


def test_report_has_the_promised_keys(outcome):
    """report.json is what run returns and has the documented keys."""
    out, report = outcome
    assert json.loads((out / "report.json").read_text()) == report
    assert report["points"]["original"] == 1500
    assert report["points"]["simplified"] == 300
    assert {"total", "deleted"} <= report["clusters"].keys()
    assert {"faces", "holes", "compactness"} <= report["surface"].keys()
    for kind in ("uncut", "cut", "floor"):
        assert {"mean", "rms", "p95", "p99", "max", "samples", "dropped"} <= (
            report["error"][kind].keys()
        )
    assert report["times"].keys() >= {"read", "simplify", "surface and error", "floor"}


def test_surface_of_a_sphere_is_whole(outcome):
    """300 points of a sphere give 2n - 4 faces, up to 1 %, and an error of the chords' size."""
    _, report = outcome
    assert 0.99 * (2 * 300 - 4) <= report["surface"]["faces"] <= 2 * 300 - 4
    assert report["surface"]["nonmanifold_edges"] == 0
    # Sagitta of a cap around a triangle of 1/596 of the sphere, over the diagonal of the box.
    assert 1e-4 < report["error"]["uncut"]["mean"] < 2 * 4 / 596 / (2 * 3**0.5)


def test_survivors_keep_their_records(outcome, scan):
    """simplified.ply holds records of the input, unchanged and in order."""
    out, _ = outcome
    before = plyfile.PlyData.read(str(scan))["vertex"].data
    after = plyfile.PlyData.read(str(out / "simplified.ply"))["vertex"].data
    assert (np.diff(after["id"]) > 0).all()
    npt.assert_array_equal(after, before[after["id"]])


def test_project_opens_all_layers(outcome):
    """MeshLab opens the project with its three layers."""
    out, report = outcome
    meshset = import_pymeshlab().MeshSet(verbose=False)
    meshset.load_project(str(out / "project.mlp"))
    counts = [(mesh.label(), mesh.vertex_number(), mesh.face_number()) for mesh in meshset]
    assert counts == [
        ("original", 1500, 0), ("simplified", 300, 0), ("surface", 300, report["surface"]["faces"])
    ]  # fmt: skip


def test_qualities_are_the_distances(outcome):
    """The quality of original.ply averages to the reported mean error."""
    out, report = outcome
    quality = plyfile.PlyData.read(str(out / "original.ply"))["vertex"]["quality"]
    npt.assert_allclose(quality.mean() / report["diagonal"], report["error"]["uncut"]["mean"])
    surface = plyfile.PlyData.read(str(out / "surface.ply"))["vertex"]["quality"]
    npt.assert_allclose(surface.max(), quality.max())


def test_run_is_repeatable(scan, outcome, tmp_path):
    """The same call writes the same bytes, times aside."""
    out, report = outcome
    again = mf.run(scan, tmp_path, count=300)
    for name in FILES:
        if name != "report.json":
            assert (out / name).read_bytes() == (tmp_path / name).read_bytes(), name
    assert {**again, "times": None} == {**report, "times": None}


@pytest.mark.parametrize("surface", ["ball-pivoting-auto", "screened-poisson", "none"])
def test_other_surfaces(scan, tmp_path, surface):
    """Every kind of surface ends with an error that makes sense for it."""
    report = mf.run(scan, tmp_path, count=300, surface=surface, floor=False)
    assert (report["surface"]["faces"] == 0) == (surface == "none")
    assert 0 < report["error"]["uncut"]["mean"] < 0.05
    assert report["error"]["floor"] is None


def test_coordinates_far_from_the_origin(scan, tmp_path):
    """A cloud in a national grid gives the same figures as the cloud at the origin."""
    near, far = tmp_path / "near.xyz", tmp_path / "far.xyz"
    points = np.round(sphere(), 3)
    np.savetxt(near, points, fmt="%.3f")
    np.savetxt(far, points + np.array([500_000, 4_100_000, 100]), fmt="%.3f")
    first = mf.run(near, tmp_path / "a", clusters=75, delete=10, floor=False)
    second = mf.run(far, tmp_path / "b", clusters=75, delete=10, floor=False)
    assert first["points"] == pytest.approx(second["points"])
    assert first["surface"]["faces"] == second["surface"]["faces"]
    assert first["error"]["uncut"]["mean"] == pytest.approx(
        second["error"]["uncut"]["mean"], rel=1e-5
    )


def brute_force_distance(points, vertices, faces):
    """Return each point's distance to the nearest triangle, by trying every triangle."""
    best = np.full(len(points), np.inf)
    for a, b, c in vertices[faces]:
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        height = (points - a) @ normal
        foot = points - height[:, None] * normal
        inside = np.ones(len(points), dtype=bool)
        nearest = np.full(len(points), np.inf)
        for start, end in ((a, b), (b, c), (c, a)):
            edge = end - start
            inside &= np.cross(edge, foot - start) @ normal >= 0
            along = np.clip((points - start) @ edge / (edge @ edge), 0, 1)
            gap = points - start - along[:, None] * edge
            nearest = np.minimum(nearest, np.linalg.norm(gap, axis=1))
        best = np.minimum(best, np.where(inside, np.abs(height), nearest))
    return best


def test_distances_agree_with_an_independent_computation(outcome):
    """MeshLab's figures equal the distance to every triangle, computed one by one."""
    out, _ = outcome
    data = plyfile.PlyData.read(str(out / "surface.ply"))
    vertices = np.column_stack([data["vertex"][axis] for axis in "xyz"])
    faces = np.vstack(data["face"]["vertex_indices"])
    original = np.column_stack(
        [plyfile.PlyData.read(str(out / "original.ply"))["vertex"][axis] for axis in "xyz"]
    ).astype(float)
    expected = brute_force_distance(original, vertices, faces)
    meshset = import_pymeshlab().MeshSet(verbose=False)
    add_layer(meshset, original)
    add_layer(meshset, vertices, faces=faces)
    npt.assert_allclose(distances(meshset, 0, 1), expected, atol=1e-7)
    figures = hausdorff(meshset, 0, 1)
    assert figures["mean"] == pytest.approx(expected.mean(), rel=1e-5)
    assert figures["max"] == pytest.approx(expected.max(), rel=1e-5)
    cut = hausdorff(meshset, 0, 1, max_distance=0.01)
    assert cut["samples"] == int((expected <= 0.01).sum())
    assert meshset.mesh_number() == 2


def test_compare_measures_both_ways(scan, tmp_path):
    """A thinned cloud lies on its original; the original does not lie on the thinned cloud."""
    thin = tmp_path / "thin.ply"
    from meshlab_filter.files import simplify_file

    simplify_file(scan, thin, count=100)
    figures = mf.compare(scan, thin)
    assert figures["other"]["points"] == 100
    assert figures["backward"]["uncut"]["max"] == 0
    assert figures["error"]["uncut"]["max"] == pytest.approx(
        mf.covering_radius(mf.read_cloud(scan).points, mf.read_cloud(thin).points)
        / figures["diagonal"],
        rel=1e-6,
    )


def test_mesh_compared_with_itself_has_no_error(tmp_path):
    """A mesh lies on itself."""
    cube = sample_mesh("cube.obj")
    figures = mf.compare(cube, cube)
    assert figures["error"]["uncut"]["max"] == 0
    assert figures["original"]["faces"] == 12
