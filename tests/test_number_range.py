"""Very large, very small and mixed coordinates: no digit lost, the same choice of points."""

import numpy as np
import numpy.testing as npt
import pytest
from command import meshlab_filter

import meshlab_filter as mf
from meshlab_filter.cloud import read_cloud, write_cloud

MAP_ORIGIN = np.array([500_000.0, 4_100_000.0, 120.0])


def terrain(count=2000, seed=0):
    """Return points of a hilly square of 64 units, on a grid of 1/1024 that every shift keeps."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 64, (2, count))
    points = np.column_stack([x, y, 4 * np.sin(x / 9) * np.cos(y / 7)])
    return np.rint(points * 1024) / 1024


@pytest.mark.parametrize("suffix", [".ply", ".xyz", ".csv"])
def test_map_coordinates_lose_no_digit(tmp_path, suffix):
    """Millimetres at millions of metres survive reading, simplifying and writing."""
    points = np.round(terrain() + MAP_ORIGIN, 3)
    mark = "," if suffix == ".csv" else " "
    if suffix == ".ply":
        write_cloud(mf.Cloud(points=points), tmp_path / "scan.ply")
    else:
        np.savetxt(tmp_path / f"scan{suffix}", points, fmt="%.3f", delimiter=mark)
    cloud = read_cloud(tmp_path / f"scan{suffix}")
    npt.assert_array_equal(cloud.points, points)
    result = mf.simplify(cloud.points, count=200)
    write_cloud(cloud, tmp_path / f"thin{suffix}", indices=result.indices)
    npt.assert_array_equal(read_cloud(tmp_path / f"thin{suffix}").points, points[result.indices])


@pytest.mark.parametrize("scale", [2.0**-60, 2.0**-20, 2.0**20, 2.0**60], ids=str)
def test_scale_does_not_matter(scale):
    """Entropies are those of the cloud of ordinary size, and so is the choice of points."""
    points = terrain()
    plain = mf.simplify(points, clusters=80, delete=10)
    scaled = mf.simplify(points * scale, clusters=80, delete=10)
    npt.assert_array_equal(scaled.labels, plain.labels)
    npt.assert_allclose(scaled.entropy, plain.entropy, rtol=0, atol=1e-9)
    npt.assert_array_equal(scaled.indices, plain.indices)


def test_place_does_not_matter():
    """Entropies on the map are those at the origin."""
    points = terrain()
    plain = mf.simplify(points, clusters=80, delete=10)
    moved = mf.simplify(points + MAP_ORIGIN, clusters=80, delete=10)
    npt.assert_array_equal(moved.labels, plain.labels)
    npt.assert_allclose(moved.entropy, plain.entropy, rtol=0, atol=1e-6)
    npt.assert_array_equal(moved.indices, plain.indices)


EXTREMES = {
    "huge": terrain(300) * 1e298,
    "denormal": terrain(300) * 1e-312,
    "one far away": np.vstack([terrain(300), [[1e15, 0, 0]]]),
    "largest": np.vstack([terrain(300), [[np.finfo(float).max] * 3, [-np.finfo(float).max] * 3]]),
    "half at a point": np.vstack([terrain(300), np.full((300, 3), 7.25)]),
}


@pytest.mark.parametrize("options", [["--count", "50"], ["--clusters", "20", "--delete", "5"]],
                         ids=["adaptive", "entropy"])  # fmt: skip
@pytest.mark.parametrize("name", EXTREMES)
def test_extreme_coordinates_end_in_a_result_or_a_sentence(tmp_path, name, options):
    """Whatever float64 can hold; the survivors of a result are points of the cloud."""
    points = EXTREMES[name]
    np.savetxt(tmp_path / "scan.xyz", points, fmt="%.17g")
    done = meshlab_filter("simplify", "scan.xyz", "thin.xyz", *options, folder=tmp_path)
    assert "Traceback" not in done.stderr, done.stderr
    assert "Warning" not in done.stderr, done.stderr
    assert done.returncode in (0, 3), done.stderr
    if done.returncode == 0:
        lines = (tmp_path / "scan.xyz").read_bytes().splitlines()
        assert set((tmp_path / "thin.xyz").read_bytes().splitlines()) <= set(lines)
    else:
        assert len(done.stderr.splitlines()) == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", EXTREMES)
def test_extreme_coordinates_through_a_whole_run(tmp_path, name):
    """The surface and its errors, or a sentence."""
    np.savetxt(tmp_path / "scan.xyz", EXTREMES[name], fmt="%.17g")
    done = meshlab_filter("run", "scan.xyz", "--count", "150", folder=tmp_path)
    assert "Traceback" not in done.stderr, done.stderr
    assert done.returncode in (0, 3, 6), done.stderr


@pytest.mark.slow
def test_run_on_the_map_gives_the_errors_at_the_origin(tmp_path):
    """MeshLab computes partly in single precision, near the origin of what it is given."""
    errors = []
    for name, shift in (("here", 0), ("there", MAP_ORIGIN)):
        np.savetxt(tmp_path / f"{name}.xyz", terrain() + shift, fmt="%.17g")
        report = mf.run(tmp_path / f"{name}.xyz", tmp_path / name, count=400, floor=False)
        errors.append(report["error"]["uncut"])
    for figure in ("mean", "rms", "max"):
        npt.assert_allclose(errors[1][figure], errors[0][figure], rtol=1e-3)
