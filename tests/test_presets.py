"""The presets: table and files, recipes, annotated clouds, saved runs."""

import sys
from pathlib import Path

import numpy as np
import numpy.testing as npt
import plyfile
import pytest

import meshlab_filter as mf
from meshlab_filter import mlx, presets
from meshlab_filter.annotation import annotate_file
from meshlab_filter.bridge import surface
from meshlab_filter.bridge.session import import_pymeshlab
from meshlab_filter.bridge.surface import IRREGULAR_PASSES, PASSES
from meshlab_filter.errors import InvalidParameterError, OutputError, PresetError
from meshlab_filter.explain import explain
from meshlab_filter.files import simplify_file
from meshlab_filter.mlx import FilterScript, Instruction
from meshlab_filter.presets import PRESETS
from meshlab_filter.recipe import Recipe
from meshlab_filter.recording import of_report, of_summary, save
from meshlab_filter.scripted import run_preset, simplify_preset
from meshlab_filter.steps import cut_of, record, thinning

ROOT = Path(__file__).parents[1]


@pytest.fixture
def scan(tmp_path):
    """Write an ellipsoid of 700 coloured points."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(700, 3))
    points = points / np.linalg.norm(points, axis=1)[:, None] * [3, 2, 1]
    path = tmp_path / "scan.ply"
    mf.write_cloud(mf.Cloud(points=points), path)
    return path


def vertices(path):
    return plyfile.PlyData.read(str(path))["vertex"].data


def test_files_are_what_the_table_says(tmp_path):
    """Every preset's file is what scripts/write_presets.py writes, and no other is there."""
    sys.path.insert(0, str(ROOT / "scripts"))
    try:
        import write_presets
    finally:
        sys.path.pop(0)
    write_presets.main(tmp_path)
    written = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    shipped = {path.name: path.read_bytes() for path in (ROOT / "mlx_presets").glob("*.mlx")}
    assert written == shipped
    assert set(written) == {f"{name}.mlx" for name in PRESETS}


@pytest.mark.parametrize(
    ("name", "clusters", "delete"),
    [("david", 458, 20), ("fandisk", 2590, 310), ("bimba", 3739, 100), ("max_planck", 2455, 50),
     ("bunny", 807, 60), ("bunny_40", 807, 40), ("bunny_30", 807, 30), ("genus", 832, 30)],
)  # fmt: skip
def test_numbers_of_table_1(name, clusters, delete):
    """The files hold the paper's c and n."""
    script = presets.open_script(name)
    recipe = Recipe.of(script.instruction)
    assert recipe.parameters["clusters"] == clusters
    assert recipe.parameters["delete"] == delete == cut_of(script)
    assert recipe.quality == "rank"
    assert name in script.comment
    assert PRESETS[name].published.place in script.comment


def test_parameters_have_types_that_old_versions_read():
    """No type is newer than MeshLab 2020.09, and bounds stand where they are needed."""
    old = {"RichBool", "RichInt", "RichFloat", "RichString", "RichAbsPerc", "RichMesh",
           "RichPoint3f"}  # fmt: skip
    for preset in PRESETS.values():
        for filter_ in preset.script():
            assert {param.type for param in filter_.params} <= old


def test_lookup_in_wheel_and_source_tree(tmp_path, monkeypatch):
    """Presets are found inside the package first, then beside it."""
    package = tmp_path / "meshlab_filter"
    (package / "mlx_presets").mkdir(parents=True)
    monkeypatch.setattr(presets, "__file__", str(package / "presets.py"))
    assert presets.folder() == package / "mlx_presets"
    (package / "mlx_presets").rmdir()
    (tmp_path / "mlx_presets").mkdir()
    assert presets.folder() == tmp_path / "mlx_presets"
    (tmp_path / "mlx_presets").rmdir()
    with pytest.raises(PresetError, match="folder of presets is missing"):
        presets.folder()


def test_find(tmp_path, monkeypatch):
    """A name, a name with extension, a path; anything else is a sentence."""
    monkeypatch.chdir(tmp_path)
    assert presets.find("bunny") == presets.find("bunny.mlx") == presets.folder() / "bunny.mlx"
    Path("bunny.mlx").write_text("mine")
    assert presets.find("bunny.mlx") == Path("bunny.mlx")
    assert presets.open_script("genus").source == "genus.mlx"
    with pytest.raises(PresetError, match=r"such as bunny.* Given: 'buny'"):
        presets.find("buny")
    with pytest.raises(PresetError, match=r"No such filter script.* Given: none.mlx"):
        presets.find("none.mlx")


def test_copy(tmp_path):
    """Copies are the files byte for byte, and replace nothing unasked."""
    copies = presets.copy(["bunny"], tmp_path / "new")
    assert copies[0].read_bytes() == presets.find("bunny").read_bytes()
    assert len(presets.copy([], tmp_path / "all")) == len(PRESETS)
    with pytest.raises(OutputError, match="pass --overwrite"):
        presets.copy(["bunny"], tmp_path / "new")
    presets.copy(["bunny"], tmp_path / "new", overwrite=True)


@pytest.mark.parametrize("name", PRESETS)
def test_recipes_read_back(name):
    """An instruction gives the recipe it was written from."""
    recipe = PRESETS[name].recipe
    assert Recipe.of(recipe.instruction()) == recipe
    assert explain(PRESETS[name].script())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "clusterentropy"}, "line 4. Invalid method"),
        ({"clusters": "many"}, "Invalid clusters"),
        ({"delete": "7,4%"}, "Invalid delete"),
        ({"seed": "-1"}, "Invalid seed"),
        ({"seed": "one"}, "Invalid seed"),
        ({"quality": "share"}, "Invalid quality. Must be one of rank, percent"),
        ({"center": "yes"}, "Invalid center"),
        ({"radius": "1"}, "Invalid parameter of method cluster-entropy"),
        ({"k": "1.5"}, "Invalid k"),
    ],
)
def test_wrong_instructions(options, message):
    """Each fault of an instruction names file and line."""
    with pytest.raises(PresetError, match=message) as caught:
        Recipe.of(Instruction(options, line=4), source="my.mlx")
    assert "my.mlx" in str(caught.value)


def test_shares_read_back_to_the_last_digit():
    """A share survives the instruction, as a percentage where one stands for it."""
    for share in (0.074, 7.4 / 100, 0.05, 1 / 3, 0.1):
        recipe = Recipe(parameters={"delete": share})
        assert Recipe.of(recipe.instruction()).parameters["delete"] == share
    assert Recipe(parameters={"delete": 0.05}).instruction().options["delete"] == "5%"


def test_percent_quality_cuts_the_share_asked_for():
    """On every number of ranks, q < 7.4 deletes 7.4 % of them, rounded."""
    for total in (10, 27, 100, 807, 5000):
        ranking = mf.methods.ranking.Ranking(rank=np.arange(total), threshold=0)
        quality = Recipe(quality="percent").values(ranking)
        assert (quality < 7.4).sum() == round(0.074 * total)
        assert (quality.astype(np.float32) < 7.4).sum() == round(0.074 * total)


def test_annotate(scan, tmp_path):
    """Rank as quality, normals, a colour, provenance; coordinates are untouched."""
    target = tmp_path / "annotated.ply"
    done = annotate_file(scan, target, preset="default")
    found = vertices(target)
    result = mf.simplify(mf.read_cloud(scan).points, delete=1, seed=0)
    total = len(result.entropy)
    npt.assert_allclose(found["quality"], 100 * (result.rank + 0.5) / total)
    assert done.left == (found["quality"] >= 7.4).sum()
    assert done.colored == "entropy"
    for axis in "xyz":
        npt.assert_array_equal(found[axis], vertices(scan)[axis])
    npt.assert_allclose(found["nx"] ** 2 + found["ny"] ** 2 + found["nz"] ** 2, 1, rtol=1e-6)
    brightness = found["red"].astype(int) + found["green"]
    low, high = result.entropy[result.labels] < 2.0, result.entropy[result.labels] > 2.5
    assert brightness[low].mean() < brightness[high].mean()
    comments = " ".join(plyfile.PlyData.read(str(target)).comments)
    assert "preset=default.mlx" in comments
    assert "sha256" in comments


def test_annotate_keeps_colours_and_normals(tmp_path):
    """A cloud's own colours and normals stay unless the user asks."""
    rng = np.random.default_rng(1)
    rows = np.zeros(300, [*((n, "f4") for n in ("x", "y", "z", "nx", "ny", "nz")),
                          *((n, "u1") for n in ("red", "green", "blue"))])  # fmt: skip
    for name in "xyz":
        rows[name] = rng.random(300)
    rows["nz"], rows["red"] = 2.0, rng.integers(0, 255, 300)
    path = tmp_path / "own.ply"
    plyfile.PlyData([plyfile.PlyElement.describe(rows, "vertex")]).write(str(path))
    assert annotate_file(path, tmp_path / "a.ply").colored == ""
    for name in rows.dtype.names:
        npt.assert_array_equal(vertices(tmp_path / "a.ply")[name], rows[name])
    assert annotate_file(path, tmp_path / "b.ply", color=True).colored == "entropy"
    assert (vertices(tmp_path / "b.ply")["red"] != rows["red"]).any()


def test_annotated_clouds_are_binary(tmp_path):
    """MeshLab reads every coordinate as this package does, whatever the scan is written in."""
    points = np.random.default_rng(2).random((300, 3)).astype("f4")
    head = "ply\nformat ascii 1.0\nelement vertex 300\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header"
    np.savetxt(tmp_path / "scan.ply", points, fmt="%.6g", header=head, comments="")
    annotate_file(tmp_path / "scan.ply", tmp_path / "annotated.ply")
    meshset = import_pymeshlab().MeshSet(verbose=False)
    meshset.load_new_mesh(str(tmp_path / "annotated.ply"))
    expected = mf.read_cloud(tmp_path / "scan.ply").points
    npt.assert_array_equal(meshset.current_mesh().vertex_matrix(), expected)


def test_annotate_twice_is_the_same(scan, tmp_path):
    """Same input, same bytes."""
    for name in ("a", "b"):
        annotate_file(scan, tmp_path / f"{name}.ply", preset="adaptive",
                      script=tmp_path / f"{name}.mlx")  # fmt: skip
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()
    assert (tmp_path / "a.mlx").read_bytes() == (tmp_path / "b.mlx").read_bytes()


@pytest.mark.parametrize(("many", "factors"), [(700, PASSES), (600, IRREGULAR_PASSES)])
def test_annotate_fits_the_radii_of_a_run(scan, tmp_path, monkeypatch, many, factors):
    """The preset's copy has the radii that a run takes for the points that stay."""
    monkeypatch.setattr(surface, "_MANY", many)
    done = annotate_file(scan, tmp_path / "a.ply", script=tmp_path / "a.mlx")
    quality = vertices(tmp_path / "a.ply")["quality"]
    fitted = mlx.read(tmp_path / "a.mlx")
    left = mf.read_cloud(scan).points[quality >= cut_of(fitted)]
    assert len(left) == done.left > 600
    radii = [f["BallRadius"].value for f in fitted if "BallRadius" in f.values()]
    npt.assert_allclose(radii, np.multiply(factors, mf.median_spacing(left)))


def test_annotate_refuses(scan, tmp_path):
    """What cannot be written or ranked is a sentence, and nothing is left behind."""
    before = sorted(tmp_path.iterdir())
    plain = tmp_path.parent / "plain.mlx"
    mlx.write(FilterScript(thinning(3)), plain)
    with pytest.raises(PresetError, match="no instruction"):
        annotate_file(scan, tmp_path / "a.ply", preset=plain)
    with pytest.raises(OutputError, match=r"must be a \.ply"):
        annotate_file(scan, tmp_path / "a.xyz")
    with pytest.raises(OutputError, match="output is the input"):
        annotate_file(scan, scan)
    with pytest.raises(PresetError, match="too few points"):
        annotate_file(scan, tmp_path / "a.ply", script=tmp_path / "a.mlx",
                      preset=record(Recipe(), threshold=9000))  # fmt: skip
    with pytest.raises(InvalidParameterError, match="Invalid delete"):
        annotate_file(scan, tmp_path / "a.ply", preset=record(
            Recipe(parameters={"clusters": 3, "delete": 60}), threshold=60))  # fmt: skip
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    "options",
    [
        {"delete": 0.1, "seed": 3},
        {"clusters": 40, "delete": 7, "keep_representative": True},
        {"keep": 0.3},
        {"count": 200, "method": "random", "seed": 1},
    ],
)
def test_saved_simplify_gives_the_same_points(options, scan, tmp_path):
    """Running what simplify wrote down leaves the same records."""
    summary = simplify_file(scan, tmp_path / "a.ply", **options)
    save(of_summary(summary), tmp_path / "my.mlx")
    simplify_preset(scan, tmp_path / "b.ply", tmp_path / "my.mlx")
    npt.assert_array_equal(vertices(tmp_path / "a.ply"), vertices(tmp_path / "b.ply"))
    report = run_preset(scan, tmp_path / "out", tmp_path / "my.mlx", floor=False)
    assert report["points"]["simplified"] == len(summary.result.indices)
    npt.assert_array_equal(vertices(tmp_path / "out/simplified.ply"), vertices(tmp_path / "b.ply"))


@pytest.mark.parametrize("surface", ["ball-pivoting", "ball-pivoting-auto", "screened-poisson",
                                     "none"])  # fmt: skip
def test_saved_run_gives_the_same_output(surface, scan, tmp_path):
    """Running what run wrote down gives the same points, faces and errors."""
    first = mf.run(scan, tmp_path / "a", keep=0.5, surface=surface, floor=False)
    save(of_report(first), tmp_path / "my.mlx")
    second = run_preset(scan, tmp_path / "b", tmp_path / "my.mlx", floor=False)
    assert first["points"] == second["points"]
    assert first["surface"]["faces"] == second["surface"]["faces"]
    assert first["error"]["uncut"] == second["error"]["uncut"]
    for name in ("simplified.ply", "surface.ply", "original.ply"):
        one, two = (plyfile.PlyData.read(str(tmp_path / x / name)) for x in "ab")
        npt.assert_array_equal(one["vertex"].data, two["vertex"].data)
        if name == "surface.ply":
            faces = [np.vstack(ply["face"]["vertex_indices"]) if len(ply["face"]) else 0
                     for ply in (one, two)]  # fmt: skip
            npt.assert_array_equal(faces[0], faces[1])


def test_run_preset_reports_like_run(scan, tmp_path):
    """The report has the keys of every report, and what the filters returned."""
    plain = mf.run(scan, tmp_path / "a", delete=0.074, surface="ball-pivoting-auto")
    report = run_preset(scan, tmp_path / "b", "default")
    assert plain.keys() <= report.keys() | {"order"}
    assert report["error"]["floor"]["samples"] == 700
    assert report["script"]["filters"][-1] == "Hausdorff Distance"
    diagonal = report["script"]["hausdorff"]["diag_mesh_0"]
    mean = report["script"]["hausdorff"]["mean"] / diagonal
    npt.assert_allclose(report["error"]["uncut"]["mean"], mean, rtol=1e-5)
    assert report["points"]["simplified"] == plain["points"]["simplified"]
    with pytest.raises(OutputError, match="would replace the input"):
        run_preset(tmp_path / "b/original.ply", tmp_path / "b", "default")


def test_scripts_that_make_points_of_their_own(scan, tmp_path):
    """Their points are the result of a run; a thinned cloud they cannot be."""
    script = FilterScript((mlx.Filter("Point Cloud Simplification"),))
    report = run_preset(scan, tmp_path / "out", script)
    assert report["parameters"]["method"] == "script"
    assert len(vertices(tmp_path / "out/simplified.ply")) == report["points"]["simplified"]
    assert report["error"]["floor"] is None
    with pytest.raises(PresetError, match="points of its own"):
        simplify_preset(scan, tmp_path / "thin.ply", script)


def test_plain_script_on_an_annotated_cloud(scan, tmp_path):
    """Without the instruction, the quality in the file is what the condition asks."""
    annotate_file(scan, tmp_path / "annotated.ply")
    bare = FilterScript(PRESETS["default"].script().filters)
    one = run_preset(tmp_path / "annotated.ply", tmp_path / "a", bare)
    two = run_preset(scan, tmp_path / "b", "default")
    assert one["points"]["simplified"] == two["points"]["simplified"]
    assert one["surface"]["faces"] == two["surface"]["faces"]
