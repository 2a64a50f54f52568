"""The models of the benchmarks: clouds with the normals MeshLab gives them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from meshlab_filter.bridge.layer import add_layer
from meshlab_filter.bridge.session import import_pymeshlab, load
from meshlab_filter.bridge.surface import compute_normals


@dataclass(frozen=True)
class Model:
    """A file and what is known of the shape in it.

    Attributes
    ----------
    file : str
        Name below the models' directory or, with a leading "wheel:", below pymeshlab's samples.
    closed : bool
        Whether the scanned surface has no border, so that every boundary edge is a defect.
    subdivisions : int
        Midpoint subdivisions of the file's faces, for meshes with too few vertices to thin.
    quick : bool
        Whether it is small enough for a quick look.
    """

    file: str
    closed: bool
    subdivisions: int = 0
    quick: bool = False


MODELS = {
    "bunny": Model("wheel:bunny.obj", closed=True, quick=True),
    "face000": Model("wheel:rangemaps/face000.ply", closed=False, quick=True),
    "bunny16k": Model("bunny16k.pts", closed=True),
    "fandisk": Model("fandisk.obj", closed=True, subdivisions=2, quick=True),
    "genus3": Model("genus3.off", closed=True),
    "bimba": Model("bimba.ply", closed=True),
    "maxplanck": Model("maxplanck.obj", closed=False),
    "david": Model("david.ply", closed=True),
    "horse": Model("horse.ply", closed=True, quick=True),
    "lucy": Model("lucy.ply", closed=True),
    "building": Model("building.ply", closed=False),
}


def path_of(name: str, directory: Path) -> Path:
    """Return where the file of a model is, whether or not it exists."""
    file = MODELS[name].file
    if file.startswith("wheel:"):
        samples = Path(import_pymeshlab().__file__).parent / "tests" / "sample_meshes"
        return samples / file.removeprefix("wheel:")
    return directory / file


def load_model(name: str, directory: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return points and MeshLab's normals for point sets, both of shape (N, 3)."""
    pymeshlab = import_pymeshlab()
    source = pymeshlab.MeshSet(verbose=False)
    load(source, path_of(name, directory))
    if MODELS[name].subdivisions:
        source.meshing_surface_subdivision_midpoint(
            iterations=MODELS[name].subdivisions, threshold=pymeshlab.PureValue(0)
        )
    cloud = pymeshlab.MeshSet(verbose=False)
    add_layer(cloud, source.current_mesh().vertex_matrix())
    compute_normals(cloud)
    mesh = cloud.current_mesh()
    return mesh.vertex_matrix(), mesh.vertex_normal_matrix()
