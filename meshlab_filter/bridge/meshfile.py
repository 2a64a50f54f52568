"""Files that only MeshLab reads or writes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..cloud import Cloud
from ..errors import FileFormatError
from ..validation import IntArray
from .layer import add_layer, current_normals
from .session import import_pymeshlab, load, stage


def read_mesh_file(path: Path) -> Cloud:
    """Read the vertices of a file through MeshLab, which leaves out those that are not finite.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Cloud

    Raises
    ------
    FileFormatError
        If MeshLab cannot read the file.
    """
    announced = _announced_vertices(path)
    meshset = import_pymeshlab().MeshSet(verbose=False)
    load(meshset, path)
    if meshset.mesh_number() != 1:
        raise FileFormatError(
            f"The file must hold one cloud or mesh. Given: {meshset.mesh_number()} in {path}."
        )
    mesh = meshset.current_mesh()
    points = np.ascontiguousarray(mesh.vertex_matrix())
    return Cloud(
        points=points,
        normals=current_normals(meshset) if mesh.face_number() == 0 else None,
        colors=mesh.vertex_color_matrix() if mesh.has_vertex_color() else None,
        faces=mesh.face_number(),
        dropped=max(0, announced - len(points)),
        path=path,
    )


def write_mesh_file(cloud: Cloud, path: Path, indices: IntArray) -> None:
    """Write coordinates, normals and colours in a format of MeshLab's, the one of the extension.

    Parameters
    ----------
    cloud : Cloud
    path : Path
    indices : numpy.ndarray, shape (M,), int64
    """
    meshset = import_pymeshlab().MeshSet(verbose=False)
    add_layer(
        meshset,
        cloud.points[indices],
        normals=None if cloud.normals is None else cloud.normals[indices],
        colors=None if cloud.colors is None else cloud.colors[indices],
    )
    with stage(f"writing a file of type {path.suffix}"):
        meshset.save_current_mesh(str(path))


def _announced_vertices(path: Path) -> int:
    """Count the vertices a text format announces: MeshLab drops the invalid ones unasked."""
    if path.suffix.lower() == ".obj":
        with open(path, "rb") as file:
            return sum(line.startswith((b"v ", b"v\t")) for line in file)
    if path.suffix.lower() == ".off":
        with open(path, "rb") as file:
            for line in file:
                words = line.split(b"#")[0].split()
                if words and words[0].isdigit():
                    return int(words[0])
    return 0
