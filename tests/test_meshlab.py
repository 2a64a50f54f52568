"""What a real MeshLab 2020.09 makes of presets and annotated clouds, without a window.

Debian and Ubuntu have it: apt-get install meshlab xvfb.
"""

import os
import shutil
import subprocess

import numpy as np
import numpy.testing as npt
import plyfile
import pytest

from meshlab_filter import mlx
from meshlab_filter.annotation import annotate_file
from meshlab_filter.bridge.samples import sample_mesh
from meshlab_filter.bridge.script import apply_preset
from meshlab_filter.bridge.session import import_pymeshlab
from meshlab_filter.chain import run
from meshlab_filter.files import simplify_file
from meshlab_filter.mlx import FilterScript
from meshlab_filter.presets import PRESETS, find
from meshlab_filter.recording import of_report, of_summary, save
from meshlab_filter.scripted import run_preset
from meshlab_filter.steps import cut_of

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not (shutil.which("meshlabserver") and shutil.which("xvfb-run")),
        reason="needs meshlabserver and xvfb-run (apt-get install meshlab xvfb)",
    ),
]

# Five digits. MeshLab 2020.09 computes in single precision and pymeshlab in double, so that among
# tens of thousands of faces one may fall the other way where a ball all but touches a fourth point.
FIVE_DIGITS = 5e-5


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    """Write the bunny in single precision, as scanners do, which every MeshLab reads exactly."""
    meshset = loaded(sample_mesh("bunny.obj"))
    points = meshset.current_mesh().vertex_matrix().astype(np.float32)
    rows = np.zeros(len(points), [(axis, "f4") for axis in "xyz"])
    for column, axis in enumerate("xyz"):
        rows[axis] = points[:, column]
    path = tmp_path_factory.mktemp("meshlab") / "bunny.ply"
    plyfile.PlyData([plyfile.PlyElement.describe(rows, "vertex")]).write(str(path))
    return path


def serve(cloud, script, folder):
    """Run a script in meshlabserver; return points, faces, and the mean and maximum error."""
    surface, measured = folder / "surface.ply", folder / "measured.ply"
    done = subprocess.run(
        ["xvfb-run", "-a", "meshlabserver", "-i", cloud, "-o", surface, "-o", measured,
         "-l", "0", "-m", "vq", "-s", script],
        capture_output=True, text=True, timeout=600, cwd=folder,
        env={**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1", "XDG_RUNTIME_DIR": str(folder)},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    built = plyfile.PlyData.read(str(surface))
    # The Hausdorff filter leaves each vertex's distance as its quality.
    distances = plyfile.PlyData.read(str(measured))["vertex"]["quality"].astype(float)
    return len(built["vertex"]), len(built["face"]), distances.mean(), distances.max()


def check(found, expected):
    """Points are equal; faces, mean and maximum error agree to five digits."""
    assert found[0] == expected[0]
    npt.assert_allclose(found[1:], expected[1:], rtol=FIVE_DIGITS)


@pytest.mark.parametrize("name", PRESETS)
def test_three_ways_agree(name, scan, tmp_path):
    """Meshlabserver, pymeshlab and the command line's run come to the same."""
    cloud = tmp_path / "annotated.ply"
    annotated = annotate_file(scan, cloud, preset=name)
    script = find(name)

    served = serve(cloud, script, tmp_path)
    assert served[0] == annotated.left < annotated.points

    meshset = import_pymeshlab().MeshSet(verbose=False)
    meshset.load_new_mesh(str(cloud))
    meshset.load_filter_script(str(script))
    meshset.apply_filter_script()
    distances = meshset.mesh(0).vertex_scalar_array()
    built = meshset.current_mesh()
    check(served, (built.vertex_number(), built.face_number(), distances.mean(), distances.max()))

    report = run_preset(cloud, tmp_path / "out", name, floor=False)
    errors = report["script"]["hausdorff"]
    counts = report["points"]["simplified"], report["surface"]["faces"]
    check(served, (*counts, errors["mean"], errors["max"]))
    own = report["error"]["uncut"]
    npt.assert_allclose(own["mean"] * report["diagonal"], errors["mean"], rtol=1e-6)
    npt.assert_allclose(own["max"] * report["diagonal"], errors["max"], rtol=1e-6)

    figures = apply_preset(loaded(scan), name)
    check(served, tuple(figures[key] for key in ("vertices_after", "faces", "mean", "max")))


def loaded(path):
    """Return a MeshSet with one file."""
    meshset = import_pymeshlab().MeshSet(verbose=False)
    meshset.load_new_mesh(str(path))
    return meshset


@pytest.mark.parametrize("cut", [30, 200])
def test_another_number_is_another_level_of_detail(cut, scan, tmp_path):
    """Editing q < 60 needs nothing but the annotated cloud."""
    cloud = tmp_path / "annotated.ply"
    annotate_file(scan, cloud, preset="bunny")
    text = find("bunny").read_text().replace("q &lt; 60", f"q &lt; {cut}")
    script = tmp_path / "edited.mlx"
    script.write_text(text)
    assert cut_of(mlx.read(script)) == cut
    figures = apply_preset(loaded(scan), script)
    expected = tuple(figures[key] for key in ("vertices_after", "faces", "mean", "max"))
    check(serve(cloud, script, tmp_path), expected)


@pytest.mark.parametrize("name", ["bunny", "adaptive"])
def test_copy_fitted_to_the_cloud(name, scan, tmp_path):
    """The copy beside an annotated cloud runs as well, and closes the gaps."""
    cloud, script = tmp_path / "annotated.ply", tmp_path / "annotated.mlx"
    annotate_file(scan, cloud, preset=name, script=script)
    served = serve(cloud, script, tmp_path)
    figures = apply_preset(loaded(cloud), script)
    assert served[0] == figures["vertices_after"]
    npt.assert_allclose(served[1], figures["faces"], rtol=1e-3)
    assert served[1] > 1.9 * served[0]
    assert figures["max"] <= 0.01 * figures["diag_mesh_0"]


@pytest.mark.parametrize("surface", ["ball-pivoting", "ball-pivoting-auto", "none"])
def test_saved_presets_run_in_meshlab(surface, scan, tmp_path):
    """What `run` wrote down runs in MeshLab on an annotated cloud."""
    report = run(scan, tmp_path / "out", keep=0.2, surface=surface, floor=False)
    script, cloud = tmp_path / "my.mlx", tmp_path / "annotated.ply"
    save(of_report(report), script)
    annotate_file(scan, cloud, preset=script)
    served = serve(cloud, script, tmp_path)
    assert served[0] == report["points"]["simplified"]
    if surface == "ball-pivoting-auto":
        # `run` moves the cloud to the origin, where rounding is another.
        npt.assert_allclose(served[1], report["surface"]["faces"], rtol=1e-3)
    elif surface == "none":
        assert served[1] == 0
        npt.assert_allclose(
            served[2] / report["diagonal"], report["error"]["uncut"]["mean"], rtol=FIVE_DIGITS
        )


def test_saved_thinning_runs_in_meshlab(scan, tmp_path):
    """What `simplify` wrote down leaves the same points in MeshLab."""
    thin, script = tmp_path / "thin.ply", tmp_path / "my.mlx"
    summary = simplify_file(scan, thin, clusters=500, delete=50, seed=4)
    save(of_summary(summary), script)
    cloud = tmp_path / "annotated.ply"
    annotate_file(scan, cloud, preset=script)
    subprocess.run(
        ["xvfb-run", "-a", "meshlabserver", "-i", cloud, "-o", "left.ply", "-s", script],
        check=True, capture_output=True, cwd=tmp_path, timeout=600,
    )  # fmt: skip
    left = plyfile.PlyData.read(str(tmp_path / "left.ply"))["vertex"]
    kept = plyfile.PlyData.read(str(thin))["vertex"]
    for axis in "xyz":
        npt.assert_array_equal(left[axis], kept[axis].astype(np.float32))


def test_meshlab_skips_the_instruction(scan, tmp_path):
    """Instruction and comment change nothing for MeshLab."""
    cloud = tmp_path / "annotated.ply"
    annotate_file(scan, cloud, preset="genus")
    bare = tmp_path / "bare.mlx"
    mlx.write(FilterScript(mlx.read(find("genus")).filters), bare)
    assert serve(cloud, bare, tmp_path) == serve(cloud, find("genus"), tmp_path)
