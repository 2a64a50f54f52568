"""Filter scripts on pymeshlab's layers: checks, and what running them comes to."""

import re
from dataclasses import replace

import numpy as np
import numpy.testing as npt
import pytest

import meshlab_filter as mf
from meshlab_filter import mlx
from meshlab_filter.bridge.catalogue import available, catalogue, nearest, python_name
from meshlab_filter.bridge.check import check_script
from meshlab_filter.bridge.layer import add_layer
from meshlab_filter.bridge.script import apply_preset, run_script
from meshlab_filter.bridge.session import import_pymeshlab
from meshlab_filter.errors import InvalidCloudError, PresetError
from meshlab_filter.mlx import Filter, FilterScript, Param
from meshlab_filter.presets import PRESETS
from meshlab_filter.recipe import Recipe
from meshlab_filter.steps import ball_pivoting, hausdorff, point_normals, record, thinning


def blob(count: int = 600, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1)[:, None] * [3, 2, 1]


@pytest.fixture
def meshset():
    found = import_pymeshlab().MeshSet(verbose=False)
    add_layer(found, blob(), quality=np.arange(600.0))
    return found


def condition(text: str) -> Filter:
    param = Param(name="condSelect", type="RichString", value=text, line=7)
    return Filter("Conditional Vertex Selection", (param,), line=6)


def test_catalogue_knows_every_filter_of_pymeshlab():
    """Nothing that the MeshLab at hand has is missing in the catalogue."""
    known = {entry.python for entry in catalogue().values()}
    assert set(import_pymeshlab().filter_list()) <= known
    assert len(available()) == len(import_pymeshlab().filter_list())


def test_catalogue_spells_parameters_as_pymeshlab_has_them(meshset):
    """Each parameter of a filter of the presets is one of pymeshlab's."""
    for filter_ in PRESETS["bunny"].script():
        entry = catalogue()[filter_.name]
        has = set(meshset.filter_parameter_values(entry.python))
        assert {python_name(name) for name in entry.parameters} == has


def test_nearest_names():
    """A name that is almost right leads to the right one."""
    names = list(catalogue())
    assert nearest("Hausdorff distance", names)[0] == "Hausdorff Distance"
    assert nearest("qqqqqqqqqqqqqqqq", names) == []


@pytest.mark.parametrize("name", PRESETS)
def test_presets_pass_the_check(name, meshset):
    """Every preset holds against the MeshLab at hand."""
    check_script(meshset, PRESETS[name].script())


K = Param(name="K", type="RichInt", value=10, line=9)


@pytest.mark.parametrize(
    ("filters", "message"),
    [
        ([], "has no filters"),
        ([Filter("Duplicate layer", line=3)],
         "line 3, filter 'Duplicate layer'. Must name a filter that MeshLab .* has such as "
         "'Duplicate Current layer'"),
        ([Filter("Zzzzzzzzzzzzzzz")], "Must name a filter that MeshLab .* has. Given"),
        ([Filter("Compute normals for point sets", (replace(K, name="k"),), 8)],
         "line 9, filter 'Compute normals for point sets'. Must name a parameter of the filter "
         "such as 'K'. Given: 'k'"),
        ([Filter("Compute normals for point sets", (replace(K, name="zzzzzz"),), 8)],
         "of the filter, 'K', 'smoothIter', 'flipFlag', 'viewPos'"),
        ([Filter("Delete Selected Vertices", (K,))], "no parameters, for it has none"),
        ([Filter("Compute normals for point sets", (replace(K, type="RichFloat"),))],
         r"give 'K' as a whole number \(RichInt\). Given: RichFloat 10"),
        ([Filter("Vertex Color Brightness Contrast Gamma", (
            Param(name="contrast", type="RichDynamicFloat", value=900.0, minimum=0,
                  maximum=1000),))], "in its range, which ends at 255. Given: 900"),
        ([Filter("Compute curvature principal directions", (
            Param(name="Method", type="RichEnum", value=40, choices=("a",) * 50),))],
         "give 'Method' a value that MeshLab takes"),
        ([hausdorff()], r"name in 'TargetMesh' a layer that exists then \(0\). Given: 1"),
        ([Filter("Duplicate Current layer"), hausdorff(target=2)], r"exists then \(0, 1\)"),
        ([Filter("Delete Current Mesh"), hausdorff()], r"a layer that exists"),
        ([Filter("Conditional Vertex Selection")], "give 'condSelect'"),
        ([condition("q <")], "line 7, filter .* that MeshLab understands.*Unexpected end"),
        ([condition("(q < 60")], "Missing parenthesis"),
        ([condition("quality < 60")], "Unexpected token"),
        ([condition("")], "Expression is empty"),
        ([condition("q = 60")], "a single = assigns. Given: 'q = 60'"),
        ([condition("(q < 3) and (x > 2)")], "Unexpected token \"and\""),
    ],
)  # fmt: skip
def test_checks_say_what_is_wrong(filters, message, meshset):
    """Each fault is found before anything runs, and says file, line and filter."""
    before = meshset.current_mesh().vertex_matrix()
    script = FilterScript(tuple(filters), source="my.mlx")
    with pytest.raises(PresetError, match=message) as caught:
        apply_preset(meshset, script)
    assert "my.mlx" in str(caught.value)
    assert meshset.mesh_number() == 1
    npt.assert_array_equal(meshset.current_mesh().vertex_matrix(), before)


def test_expression_on_a_custom_attribute(meshset):
    """A condition may name an attribute that the layer has."""
    meshset.current_mesh().add_vertex_custom_scalar_attribute(np.arange(600.0), "height")
    filters = (condition("(height < 100)"), Filter("Delete Selected Vertices"))
    assert apply_preset(meshset, FilterScript(filters))["vertices_after"] == 500


def test_quality_that_is_not_there(tmp_path):
    """Without instruction and quality, q would be 0 everywhere and all points would go."""
    path = tmp_path / "plain.ply"
    mf.write_cloud(mf.Cloud(points=blob(50)), path)
    meshset = import_pymeshlab().MeshSet(verbose=False)
    meshset.load_new_mesh(str(path))
    with pytest.raises(PresetError, match=r"asks for the quality q. Given: a cloud without"):
        apply_preset(meshset, FilterScript((condition("(q < 60)"),)))


def test_no_layers():
    """An empty MeshSet is a sentence where MeshLab crashes."""
    meshset = import_pymeshlab().MeshSet(verbose=False)
    with pytest.raises(InvalidCloudError, match="no layers"):
        apply_preset(meshset, "bunny")
    with pytest.raises(InvalidCloudError, match="no layers"):
        apply_preset(meshset, FilterScript((Filter("Duplicate Current layer"),)))


def test_script_that_makes_its_first_layer():
    """A script that begins by creating a mesh needs no layer; one that leaves none is no crash."""
    meshset = import_pymeshlab().MeshSet(verbose=False)
    figures = apply_preset(meshset, FilterScript((Filter("Tetrahedron"),)))
    assert figures == {"vertices_before": 0, "vertices_after": 4, "faces": 4}
    figures = apply_preset(meshset, FilterScript((Filter("Delete Current Mesh"),)))
    assert figures == {"vertices_before": 4, "vertices_after": 0, "faces": 0}


def test_cut_that_leaves_nothing(meshset):
    """A cut above the highest rank is refused before anything is deleted."""
    with pytest.raises(PresetError, match=r"goes up to 29.*deletes all 600 vertices"):
        apply_preset(meshset, record(Recipe(), threshold=10_000))


def test_filter_that_finds_no_vertices(meshset):
    """Filters that would run on an empty layer are stopped between two filters."""
    script = FilterScript((*thinning(1000), point_normals(), ball_pivoting()))
    with pytest.raises(PresetError, match="find vertices in the current layer"):
        apply_preset(meshset, script)


def test_layer_that_vanishes(meshset):
    """Layers that cannot be told beforehand are looked at when they are needed."""
    merge = Filter("Flatten Visible Layers")
    with pytest.raises(PresetError, match="'SampledMesh' a layer with vertices"):
        apply_preset(meshset, FilterScript((Filter("Duplicate Current layer"), merge, hausdorff())))


def test_apply_preset_is_the_chain_step_by_step(meshset):
    """The figures are those of the same filters, called one by one."""
    figures = apply_preset(meshset, "default", seed=3)
    other = import_pymeshlab().MeshSet(verbose=False)
    add_layer(other, blob())
    result = mf.simplify(blob(), delete=round(0.074 * 30), seed=3)
    add_layer(other, blob()[result.indices])
    other.compute_normal_for_point_clouds(k=12)
    other.generate_surface_reconstruction_ball_pivoting(clustering=5)
    errors = other.get_hausdorff_distance(
        sampledmesh=0, targetmesh=1, samplevert=True, sampleface=False, sampleedge=False,
        samplefauxedge=False, samplenum=600, maxdist=import_pymeshlab().PureValue(1e30),
    )  # fmt: skip
    assert figures["vertices_after"] == len(result.indices)
    assert figures["faces"] == other.current_mesh().face_number()
    npt.assert_allclose(figures["mean"], errors["mean"], rtol=1e-6)
    npt.assert_allclose(figures["max"], errors["max"], rtol=1e-6)


def test_apply_preset_leaves_the_users_layer(meshset):
    """The layer it was called on keeps its vertices and its quality."""
    apply_preset(meshset, "default")
    npt.assert_array_equal(meshset.mesh(0).vertex_scalar_array(), np.arange(600.0))
    npt.assert_array_equal(meshset.mesh(0).vertex_matrix(), blob())


def test_apply_preset_among_other_layers(meshset):
    """A ranked script counts its layers from the current one, whatever else is there."""
    alone = apply_preset(meshset, "default")
    meshset.create_cube()
    meshset.delete_current_mesh()
    meshset.create_cube()
    meshset.set_current_mesh(0)
    assert apply_preset(meshset, "default") == alone


def test_attribute_added_before_the_mesh():
    """An attribute that crashes MeshLab's expressions does not crash a preset."""
    pymeshlab = import_pymeshlab()
    mesh = pymeshlab.Mesh(blob())
    mesh.add_vertex_custom_scalar_attribute(np.zeros(600), "mine")
    meshset = pymeshlab.MeshSet(verbose=False)
    meshset.add_mesh(mesh)
    assert apply_preset(meshset, "default")["vertices_after"] < 600


def test_file_counts(meshset, tmp_path):
    """What the user edits or adds in the file is what happens."""
    text = PRESETS["default"].script().to_xml()
    edited = text.replace("q &lt; 7.4", "q &lt; 50")
    edited = edited.replace("</FilterScript>", '<filter name="Invert Faces Orientation"/>'
                            "</FilterScript>")  # fmt: skip
    path = tmp_path / "my.mlx"
    path.write_text(edited)
    few = apply_preset(meshset, path)
    meshset.set_current_mesh(0)
    assert few["vertices_after"] < 0.75 * apply_preset(meshset, "default")["vertices_after"]
    path.write_text(re.sub("Invert Faces Orientation", "Invert Face Orientation", edited))
    with pytest.raises(PresetError, match="such as 'Invert Faces Orientation'"):
        apply_preset(meshset, path)


def test_which_vertices_are_left(meshset):
    """Indices follow copies and deletions, and end where vertices move."""
    thin = FilterScript(thinning(100))
    assert run_script(meshset, thin).indices.tolist() == list(range(100, 600))
    meshset.set_current_mesh(0)
    poisson = record(Recipe(), threshold=100, surface="screened-poisson")
    run = run_script(meshset, FilterScript((*poisson.filters[:3], point_normals(),
                                            *poisson.filters[3:])))  # fmt: skip
    assert run.own_vertices
    assert len(run.indices) == 500
    meshset.set_current_mesh(0)
    moved = FilterScript((Filter("Transform: Scale, Normalize", (
        Param(name="axisX", type="RichFloat", value=2.0),)),))  # fmt: skip
    assert run_script(meshset, moved).indices is None


def test_plain_scripts_of_meshlab():
    """MeshLab's own sample script runs, and returns what pymeshlab returns for it."""
    from meshlab_filter.bridge.samples import sample_mesh

    meshset = import_pymeshlab().MeshSet(verbose=False)
    add_layer(meshset, blob())
    figures = apply_preset(meshset, sample_mesh("sample_filter_script.mlx"))
    other = import_pymeshlab().MeshSet(verbose=False)
    other.load_filter_script(str(sample_mesh("sample_filter_script.mlx")))
    other.apply_filter_script()
    assert figures["vertices_after"] == other.current_mesh().vertex_number()
    assert figures["faces"] == other.current_mesh().face_number()


def test_seed_in_the_instruction(meshset):
    """The instruction's seed is used, and can be overruled."""
    script = PRESETS["default"].script()
    options = {**script.instruction.options, "seed": "5"}
    other = replace(script, instruction=mlx.Instruction(options))
    first = apply_preset(meshset, other)
    meshset.set_current_mesh(0)
    assert apply_preset(meshset, script, seed=5) == first
    meshset.set_current_mesh(0)
    assert apply_preset(meshset, script, seed=6) != first
