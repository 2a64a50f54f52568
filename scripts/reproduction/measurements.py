"""What is measured: the rows of Table 1 seed by seed, and all methods at the same count.

Both functions take plain arguments and return plain results, so that they run in any process and
their results can be kept.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pymeshlab

from meshlab_filter.bridge.distance import distances
from meshlab_filter.bridge.layer import add_layer
from meshlab_filter.bridge.surface import PASSES, reconstruct
from meshlab_filter.methods import cluster_entropy
from meshlab_filter.methods.registry import METHODS
from meshlab_filter.quality import (
    PAPER_CUT,
    acceptable_share,
    compactness,
    edge_defects,
    summarise_errors,
)

from .subjects import SUBJECTS, Cloud, load

#: One pass with MeshLab's automatic radius, as in the paper, and passes of growing radius.
SURFACES = {"paper": "ball-pivoting-auto", "passes": "ball-pivoting"}


def measure(cloud: Cloud, kept: np.ndarray, surface: str, *, scene: bool = False) -> dict[str, Any]:
    """Rebuild the surface through some points and measure all points against it.

    Parameters
    ----------
    cloud : Cloud
    kept : numpy.ndarray, shape (M,)
        Indices of the points that stay.
    surface : str
        A key of ``SURFACES``.
    scene : bool
        Whether to return the faces, distances and compactness too, for pictures.

    Returns
    -------
    dict
    """
    meshset = pymeshlab.MeshSet(verbose=False)
    add_layer(meshset, cloud.points)
    add_layer(meshset, cloud.points[kept], normals=cloud.normals[kept])
    # The same passes for every method, whatever its points look like.
    reconstruct(meshset, surface=SURFACES[surface], passes=PASSES)
    faces = meshset.current_mesh().face_matrix()
    found = distances(meshset, 0, 1)
    shape = compactness(cloud.points[kept], faces)
    result: dict[str, Any] = {
        "kept": len(kept),
        "uncut": summarise_errors(found, diagonal=cloud.diagonal),
        "cut": summarise_errors(found, diagonal=cloud.diagonal, cut=PAPER_CUT),
        "compact": acceptable_share(shape),
        "faces": len(faces),
        "boundary": edge_defects(faces)["boundary_edges"],
    }
    if scene:
        result["scene"] = {"kept": kept, "faces": faces, "distances": found, "compact": shape}
    return result


def floor(name: str, models: str | None) -> dict[str, Any]:
    """Measure the untouched cloud against its own surface."""
    cloud = load(name, models)
    every = np.arange(len(cloud.points))
    result: dict[str, Any] = {
        surface: measure(cloud, every, surface, scene=True) for surface in SURFACES
    }
    return {**result, "points": len(cloud.points), "diagonal": cloud.diagonal}


def paper_rule(name: str, models: str | None, seed: int) -> dict[str, Any]:
    """Run the paper's rule once, and random deletion at the same counts.

    Returns
    -------
    dict
        For each preset: the figures with each surface, and "random" with the paper's. The rows of
        a model share one clustering: they are levels of detail of the same ranking.
    """
    cloud = load(name, models)
    presets = SUBJECTS[name].rows()
    clusters = presets[0].recipe.parameters["clusters"]
    ranking = cluster_entropy.rank(
        cloud.points,
        clusters=clusters,
        delete=presets[0].recipe.parameters["delete"],
        init="random",
        seed=seed,
    )
    chance = np.random.default_rng(seed).permutation(len(cloud.points))
    result: dict[str, Any] = {}
    for preset in presets:
        kept = np.flatnonzero(ranking.rank >= preset.recipe.parameters["delete"])
        result[preset.name] = {
            surface: measure(cloud, kept, surface, scene=seed == 0) for surface in SURFACES
        }
        result[preset.name]["random"] = measure(cloud, np.sort(chance[: len(kept)]), "paper")
    if seed == 0:
        result["labels"], result["entropy"] = ranking.labels, ranking.entropy
    return result


def at_count(
    name: str, models: str | None, method: str, counts: tuple[int, ...], scene: bool = False
) -> list[dict[str, Any]]:
    """Run one method at several counts and measure each with the surface in passes.

    Returns
    -------
    list of dict
        In the order of the counts: the figures, "missed" and "seconds" of the ranking. A method
        that orders all points ranks them once, down to the smallest count.
    """
    cloud = load(name, models)
    entry = METHODS[method]
    rank = entry.load()
    results = []
    order, spent = None, 0.0
    if entry.total_order:
        begin = time.perf_counter()
        order = rank(cloud.points, normals=cloud.normals, count=min(counts)).rank
        spent = time.perf_counter() - begin
    for count in counts:
        if order is not None:
            kept = np.flatnonzero(order >= len(order) - count)
        else:
            begin = time.perf_counter()
            kept = rank(cloud.points, normals=cloud.normals, count=count).indices
            spent = time.perf_counter() - begin
        results.append(
            {
                **measure(cloud, kept, "passes", scene=scene),
                "missed": len(kept) - count,
                "seconds": spent,
            }
        )
    return results


def by_neighbours(name: str, models: str | None, k: int | None, seed: int) -> dict[str, Any]:
    """Count what the paper's rule removes when the density takes the k-th neighbour.

    Returns
    -------
    dict
        Points removed by preset, and "correlation": Spearman's, of a cluster's size and entropy.
    """
    from scipy.stats import spearmanr

    cloud = load(name, models)
    presets = SUBJECTS[name].rows()
    parameters = presets[0].recipe.parameters
    ranking = cluster_entropy.rank(
        cloud.points, clusters=parameters["clusters"], delete=parameters["delete"], k=k, seed=seed
    )
    result: dict[str, Any] = {
        preset.name: int((ranking.rank < preset.recipe.parameters["delete"]).sum())
        for preset in presets
    }
    known = np.isfinite(ranking.entropy)
    sizes = np.bincount(ranking.labels, minlength=len(ranking.entropy))
    result["correlation"] = float(spearmanr(sizes[known], ranking.entropy[known]).statistic)
    return result
