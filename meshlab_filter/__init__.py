"""Thin a dense 3D scan, keep what matters in it, rebuild its surface and know the error.

Names are imported when they are first used, so that ``import meshlab_filter`` costs next to
nothing and never starts MeshLab by itself.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from ._version import __version__

if TYPE_CHECKING:
    from .bridge.filters import (
        meshing_decimation_adaptive,
        meshing_decimation_cluster_entropy,
    )
    from .bridge.script import apply_preset
    from .chain import compare, run
    from .cloud import Cloud, read_cloud, write_cloud
    from .clustering import Clustering, kmeans
    from .entropy import cluster_entropy, knn_density
    from .quality import compactness, covering_radius, median_spacing, summarise_errors
    from .scripted import run_preset
    from .simplification import Simplification, simplify

_HOMES = {
    "apply_preset": "bridge.script",
    "Cloud": "cloud",
    "Clustering": "clustering",
    "Simplification": "simplification",
    "cluster_entropy": "entropy",
    "compactness": "quality",
    "compare": "chain",
    "covering_radius": "quality",
    "kmeans": "clustering",
    "knn_density": "entropy",
    "median_spacing": "quality",
    "meshing_decimation_adaptive": "bridge.filters",
    "meshing_decimation_cluster_entropy": "bridge.filters",
    "read_cloud": "cloud",
    "run": "chain",
    "run_preset": "scripted",
    "simplify": "simplification",
    "summarise_errors": "quality",
    "write_cloud": "cloud",
}

__all__ = [
    "Cloud",
    "Clustering",
    "Simplification",
    "__version__",
    "apply_preset",
    "cluster_entropy",
    "compactness",
    "compare",
    "covering_radius",
    "kmeans",
    "knn_density",
    "median_spacing",
    "meshing_decimation_adaptive",
    "meshing_decimation_cluster_entropy",
    "read_cloud",
    "run",
    "run_preset",
    "simplify",
    "summarise_errors",
    "write_cloud",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f".{_HOMES[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
