"""Distances between clouds and surfaces, by MeshLab's Hausdorff filter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import InvalidCloudError
from ..validation import FloatArray
from .session import import_pymeshlab, stage

if TYPE_CHECKING:
    import pymeshlab

#: No distance is farther, so nothing is cut off.
FAR = 1e30


def distances(meshset: pymeshlab.MeshSet, sampled: int, target: int) -> FloatArray:
    """Return the distance of every vertex of one layer to the surface of another.

    MeshLab's Hausdorff filter measures it, sampling vertices only and cutting nothing off
    (Mahdaoui and Sbai 2020, eqs 8 and 10). If the target has no faces, its vertices are taken.

    Parameters
    ----------
    meshset : pymeshlab.MeshSet
    sampled, target : int
        Ids of the two layers.

    Returns
    -------
    numpy.ndarray, shape (N,), float64
        In the unit of the coordinates, in the order of the sampled layer's vertices.

    Raises
    ------
    InvalidCloudError
        If a layer is empty or MeshLab has not measured every vertex.
    """
    for layer in (sampled, target):
        if not meshset.mesh_id_exists(layer) or meshset.mesh(layer).vertex_number() == 0:
            raise InvalidCloudError(f"Distances need two layers with vertices. Given: {layer}.")
    current = meshset.current_mesh_id()
    count = meshset.mesh(sampled).vertex_number()
    before = {mesh.id() for mesh in meshset}
    meshset.set_current_mesh(sampled)
    with stage("measuring the distance"):
        meshset.get_hausdorff_distance(
            sampledmesh=sampled, targetmesh=target, savesample=True, samplevert=True,
            sampleedge=False, samplefauxedge=False, sampleface=False, samplenum=count,
            maxdist=import_pymeshlab().PureValue(FAR),
        )  # fmt: skip
    added = [mesh for mesh in meshset if mesh.id() not in before]
    # The filter adds two layers, the closest points and the samples themselves, pair by pair.
    pairs = {mesh.label(): mesh.vertex_matrix() for mesh in added}
    ids = [mesh.id() for mesh in added]
    for layer in ids:
        meshset.set_current_mesh(layer)
        meshset.delete_current_mesh()
    meshset.set_current_mesh(current)
    samples = pairs["Hausdorff Sample Point"]
    closest = pairs["Hausdorff Closest Points"]
    if len(samples) != count or not np.array_equal(samples, meshset.mesh(sampled).vertex_matrix()):
        raise InvalidCloudError(
            f"MeshLab measured {len(samples)} of {count} vertices; the layer may hold vertices "
            "twice or without use."
        )
    return np.asarray(np.linalg.norm(samples - closest, axis=1))


def hausdorff(
    meshset: pymeshlab.MeshSet, sampled: int, target: int, *, max_distance: float = FAR
) -> dict[str, float]:
    """Return what MeshLab's Hausdorff filter says, sampling every vertex of one layer.

    Parameters
    ----------
    meshset : pymeshlab.MeshSet
    sampled, target : int
        Ids of the two layers.
    max_distance : float
        In the unit of the coordinates. The filter leaves samples farther than this out of count,
        mean and maximum; the paper's maxima just under 1 % of the diagonal are such a cut.

    Returns
    -------
    dict
        "mean", "rms", "max" (in the unit of the coordinates) and "samples".
    """
    current = meshset.current_mesh_id()
    meshset.set_current_mesh(sampled)
    with stage("measuring the distance"):
        figures = meshset.get_hausdorff_distance(
            sampledmesh=sampled, targetmesh=target, savesample=False, samplevert=True,
            sampleedge=False, samplefauxedge=False, sampleface=False,
            samplenum=meshset.mesh(sampled).vertex_number(),
            maxdist=import_pymeshlab().PureValue(max_distance),
        )  # fmt: skip
    meshset.set_current_mesh(current)
    return {
        "mean": float(figures["mean"]),
        "rms": float(figures["RMS"]),
        "max": float(figures["max"]),
        "samples": int(figures["n_samples"]),
    }
