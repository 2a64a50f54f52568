"""Arrays in and out of MeshLab's layers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidCloudError
from ..validation import FloatArray, IntArray, check_points
from .session import import_pymeshlab, stage

if TYPE_CHECKING:
    import pymeshlab

#: The custom attribute in which the rank of each vertex is left.
RANK_ATTRIBUTE = "meshlab_filter_rank"


def current_points(meshset: pymeshlab.MeshSet) -> FloatArray:
    """Return the current layer's vertices, shape (N, 3), in the layer's own coordinates.

    Raises
    ------
    InvalidCloudError
        If there is no layer, it has no vertices, or a coordinate is not finite. MeshLab itself
        ends the process when a filter runs on an empty set.
    """
    if meshset.mesh_number() == 0:
        raise InvalidCloudError("The MeshSet has no layers; load a cloud first. Given: 0 layers.")
    return check_points(meshset.current_mesh().vertex_matrix(), name="vertices of the layer")


def current_normals(meshset: pymeshlab.MeshSet) -> FloatArray | None:
    """Return the current layer's vertex normals, shape (N, 3), or None if it has none.

    MeshLab has room for a normal at every vertex; a layer has none when all are zero.
    """
    normals: FloatArray = meshset.current_mesh().vertex_normal_matrix()
    if not np.isfinite(normals).all() or not normals.any(axis=1).all():
        return None
    return normals


def add_layer(
    meshset: pymeshlab.MeshSet,
    points: FloatArray,
    *,
    normals: FloatArray | None = None,
    quality: FloatArray | None = None,
    colors: FloatArray | None = None,
    faces: IntArray | None = None,
    name: str = "cloud",
) -> None:
    """Add a layer made from arrays; it becomes the current one.

    Parameters
    ----------
    meshset : pymeshlab.MeshSet
    points : numpy.ndarray, shape (N, 3)
    normals, colors : numpy.ndarray, shapes (N, 3) and (N, 4), optional
    quality : numpy.ndarray, shape (N,), optional
    faces : numpy.ndarray, shape (F, 3), optional
    name : str
        The layer's label.
    """
    arrays: dict[str, Any] = {"vertex_matrix": np.ascontiguousarray(points, dtype=np.float64)}
    if normals is not None:
        arrays["v_normals_matrix"] = np.ascontiguousarray(normals, dtype=np.float64)
    if quality is not None:
        arrays["v_scalar_array"] = np.ascontiguousarray(quality, dtype=np.float64)
    if colors is not None:
        arrays["v_color_matrix"] = np.ascontiguousarray(colors, dtype=np.float64)
    if faces is not None:
        arrays["face_matrix"] = np.ascontiguousarray(faces, dtype=np.int32)
    meshset.add_mesh(import_pymeshlab().Mesh(**arrays), name)


def add_attribute(meshset: pymeshlab.MeshSet, values: FloatArray | IntArray, name: str) -> str:
    """Give every vertex of the current layer a custom scalar attribute.

    Parameters
    ----------
    meshset : pymeshlab.MeshSet
    values : numpy.ndarray, shape (N,)
    name : str
        Wished for; pymeshlab can neither replace nor remove an attribute, so a number is put
        behind the name where the layer has it already.

    Returns
    -------
    str
        The name it got, ready for MeshLab's expressions.
    """
    mesh = meshset.current_mesh()
    free, number = name, 1
    while _has_attribute(mesh, free):
        number += 1
        free = f"{name}_{number}"
    with stage(f"adding the attribute {free}"):
        mesh.add_vertex_custom_scalar_attribute(
            np.ascontiguousarray(values, dtype=np.float64), free
        )
    return free


def set_quality(meshset: pymeshlab.MeshSet, values: FloatArray | IntArray) -> None:
    """Give every vertex of the current layer a quality, shape (N,), in place of the one it has."""
    # pymeshlab takes arrays for a quality only where a mesh is made; for a layer that exists the
    # way in is an attribute, which a filter copies.
    name = add_attribute(meshset, values, RANK_ATTRIBUTE)
    with stage("setting the quality of the vertices"):
        meshset.compute_scalar_by_function_per_vertex(q=name)


def delete_vertices(meshset: pymeshlab.MeshSet, rank: IntArray, threshold: int) -> None:
    """Delete the vertices of the current layer whose rank is below the threshold.

    MeshLab's own filters do it, so everything else that the vertices carry stays as it was, and
    faces go only where a corner goes. The rank remains as a custom attribute.

    Parameters
    ----------
    meshset : pymeshlab.MeshSet
    rank : numpy.ndarray, shape (N,), int64
    threshold : int
    """
    name = add_attribute(meshset, rank, RANK_ATTRIBUTE)
    with stage("deleting vertices"):
        meshset.compute_selection_by_condition_per_vertex(condselect=f"({name} < {threshold})")
        meshset.meshing_remove_selected_vertices()


def _has_attribute(mesh: pymeshlab.Mesh, name: str) -> bool:
    try:
        mesh.vertex_custom_scalar_attribute_array(name)
    except import_pymeshlab().PyMeshLabException:
        return False
    return True
