"""Files that only MeshLab reads or writes."""

from __future__ import annotations

from pathlib import Path

from ..cloud import Cloud
from ..validation import IntArray
from .layer import add_layer
from .meshreader import MeshReader
from .session import import_pymeshlab, stage


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
    with MeshReader() as reader:
        arrays = reader.read(path)
    return Cloud(
        points=arrays["points"],
        normals=arrays.get("normals"),
        colors=arrays.get("colors"),
        faces=len(arrays["faces"]),
        dropped=int(arrays["dropped"]),
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
