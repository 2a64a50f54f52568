"""What vertices of a MeshLab layer carry survives the filters that act on it."""

import numpy as np
import numpy.testing as npt
import pytest

import meshlab_filter as mf
from meshlab_filter.errors import InvalidCloudError

pymeshlab = pytest.importorskip("pymeshlab")

FILTERS = {
    "entropy": (mf.meshing_decimation_cluster_entropy, {"clusters": 60, "delete": 9}),
    "representative": (
        mf.meshing_decimation_cluster_entropy,
        {"clusters": 60, "delete": 9, "keep_representative": True},
    ),
    "adaptive": (mf.meshing_decimation_adaptive, {"keep": 0.4}),
}


def rich_layer(count=900, seed=0):
    """Return a MeshSet with a cloud that carries everything MeshLab knows, and the arrays."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    arrays = {
        "vertex_matrix": normals + rng.normal(scale=0.01, size=(count, 3)),
        "v_normals_matrix": normals,
        "v_scalar_array": rng.normal(size=count),
        "v_color_matrix": rng.integers(0, 256, (count, 4)) / 255,
        "v_tex_coords_matrix": rng.random((count, 2)),
    }
    meshset = pymeshlab.MeshSet(verbose=False)
    meshset.add_mesh(pymeshlab.Mesh(**arrays), "rich")
    mine, vectors = rng.normal(size=count), rng.normal(size=(count, 3))
    meshset.current_mesh().add_vertex_custom_scalar_attribute(mine, "reflectance")
    meshset.current_mesh().add_vertex_custom_point_attribute(vectors, "flow")
    return meshset, carried(meshset)


def carried(meshset):
    """Return every per-vertex array of the current layer."""
    mesh = meshset.current_mesh()
    return {
        "points": mesh.vertex_matrix(),
        "normals": mesh.vertex_normal_matrix(),
        "quality": mesh.vertex_scalar_array(),
        "colors": mesh.vertex_color_array(),
        "texture": mesh.vertex_tex_coord_matrix(),
        "reflectance": mesh.vertex_custom_scalar_attribute_array("reflectance"),
        "flow": mesh.vertex_custom_point_attribute_matrix("flow"),
    }


@pytest.mark.parametrize("name", FILTERS)
def test_everything_the_vertices_carry_survives(name):
    """The vertices that stay are those of the numpy layer, with all they had, twice in a row."""
    function, options = FILTERS[name]
    meshset, before = rich_layer()
    for _ in range(2):
        figures = function(meshset, **options)
        after = carried(meshset)
        assert figures["vertices_before"] == len(before["points"])
        assert figures["vertices_after"] == len(after["points"]) < len(before["points"])
        row = {point.tobytes(): index for index, point in enumerate(before["points"])}
        kept = [row[point.tobytes()] for point in after["points"]]
        assert kept == sorted(kept)
        for what, values in after.items():
            npt.assert_array_equal(values, before[what][kept], err_msg=what)
        before = after
    rank = meshset.current_mesh().vertex_custom_scalar_attribute_array("meshlab_filter_rank")
    assert len(rank) == len(before["points"])
    assert meshset.mesh_number() == 1


@pytest.mark.parametrize("name", FILTERS)
def test_faces_stay_where_all_their_corners_do(name):
    """As when MeshLab deletes vertices by itself."""
    function, options = FILTERS[name]
    meshset = pymeshlab.MeshSet(verbose=False)
    meshset.create_sphere(subdiv=4)
    mesh = meshset.current_mesh()
    points, faces = mesh.vertex_matrix(), mesh.face_matrix()
    function(meshset, **options)
    mesh = meshset.current_mesh()
    left = {point.tobytes() for point in mesh.vertex_matrix()}
    stays = [all(points[corner].tobytes() in left for corner in face) for face in faces]
    assert mesh.face_number() == sum(stays)


@pytest.mark.parametrize("name", FILTERS)
def test_layers_that_cannot_be_worked_on(name):
    """An empty set, which would end the process inside MeshLab, and an empty layer."""
    function, options = FILTERS[name]
    meshset = pymeshlab.MeshSet(verbose=False)
    with pytest.raises(InvalidCloudError, match="no layers"):
        function(meshset, **options)
    meshset.create_cube()
    meshset.compute_selection_by_condition_per_vertex(condselect="(1 > 0)")
    meshset.meshing_remove_selected_vertices()
    with pytest.raises(InvalidCloudError, match="at least"):
        function(meshset, **options)


def test_a_refused_parameter_changes_nothing():
    """The layer is as it was, without so much as a rank."""
    meshset, before = rich_layer()
    with pytest.raises(ValueError, match="clusters"):
        mf.meshing_decimation_cluster_entropy(meshset, clusters=-1)
    for what, values in carried(meshset).items():
        npt.assert_array_equal(values, before[what])
    with pytest.raises(pymeshlab.PyMeshLabException):
        meshset.current_mesh().vertex_custom_scalar_attribute_array("meshlab_filter_rank")
