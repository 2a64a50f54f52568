"""The paper's models, as near as public files come to them."""

from __future__ import annotations

import functools
import os
from dataclasses import dataclass

import numpy as np
import pymeshlab

from meshlab_filter.bridge.layer import add_layer
from meshlab_filter.bridge.surface import compute_normals
from meshlab_filter.models import fetch_model
from meshlab_filter.presets import PRESETS, Preset


@dataclass(frozen=True, kw_only=True)
class Subject:
    """A model of the paper.

    Attributes
    ----------
    name : str
        As in ``--model``.
    title : str
        As the paper calls it.
    model : str
        Name in the registry of public models.
    presets : tuple of str
        Its rows in Table 1 and Fig. 7.
    note : str
        How near our cloud comes to the paper's.
    same : bool
        Whether it is the paper's cloud, as far as its number of points tells.
    up : str
        The axis that points up in pictures.
    azimuth, elevation : float
        From where pictures show it, in degrees.
    """

    name: str
    title: str
    model: str
    presets: tuple[str, ...]
    note: str
    same: bool = True
    up: str = "y"
    azimuth: float = 0.0
    elevation: float = 10.0

    @property
    def label(self) -> str:
        """The title, marked where the cloud is another one than the paper's."""
        return self.title if self.same else f"{self.title} †"

    def rows(self) -> list[Preset]:
        """Return the presets of its rows, the one of Table 1 first."""
        return [PRESETS[name] for name in self.presets]


@dataclass(frozen=True)
class Cloud:
    """What is measured: points and the normals that MeshLab estimates for all of them."""

    points: np.ndarray
    normals: np.ndarray

    @property
    def diagonal(self) -> float:
        """Length of the bounding box's diagonal."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))


SUBJECTS: dict[str, Subject] = {
    subject.name: subject
    for subject in (
        Subject(
            name="david",
            title="David",
            model="david",
            presets=("david",),
            note="another mesh, six times coarser",
            same=False,
            up="z",
            elevation=5,
        ),
        Subject(
            name="fandisk",
            title="Fandisk",
            model="fandisk",
            presets=("fandisk",),
            note="the same shape, subdivided twice",
            azimuth=145,
            elevation=25,
        ),
        Subject(
            name="bimba",
            title="Bimba",
            model="bimba",
            presets=("bimba",),
            note="another sampling, 7 % more points",
            same=False,
        ),
        Subject(
            name="max_planck",
            title="Max Planck",
            model="max_planck",
            presets=("max_planck",),
            note="another mesh, 8 % fewer points",
            same=False,
        ),
        Subject(
            name="bunny",
            title="Bunny",
            model="bunny",
            presets=("bunny", "bunny_40", "bunny_30"),
            note="the same number of points",
        ),
        Subject(
            name="genus",
            title="Genus",
            model="genus3",
            presets=("genus",),
            note="the same number of points after decimation",
            elevation=60,
        ),
    )
}


@functools.lru_cache(maxsize=2)
def load(name: str, models: str | None) -> Cloud:
    """Read a subject's points, made from the file by MeshLab's filters where the paper's were.

    Parameters
    ----------
    name : str
        Of the subject.
    models : str or None
        Folder of models at hand; downloaded without.
    """
    path = fetch_model(SUBJECTS[name].model, directory=models)
    meshset = pymeshlab.MeshSet(verbose=False)
    meshset.load_new_mesh(os.fspath(path))
    if name == "fandisk":
        meshset.meshing_surface_subdivision_midpoint(
            iterations=2, threshold=pymeshlab.PercentageValue(0)
        )
    elif name == "genus":
        meshset.meshing_decimation_quadric_edge_collapse(targetfacenum=5000)
    points = meshset.current_mesh().vertex_matrix()
    points = points - (points.min(axis=0) + points.max(axis=0)) / 2
    meshset = pymeshlab.MeshSet(verbose=False)
    add_layer(meshset, points)
    compute_normals(meshset)
    return Cloud(points, meshset.current_mesh().vertex_normal_matrix())
