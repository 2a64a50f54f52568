"""What is measured: the rows of Table 1 seed by seed, and all methods at the same count.

The functions take plain arguments and return plain results, so that they run in any process and
their results can be kept.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pymeshlab

from meshlab_filter.bridge.distance import distances
from meshlab_filter.bridge.layer import add_layer
from meshlab_filter.bridge.surface import PASSES, reconstruct
from meshlab_filter.entropy import cluster_entropy as entropy_of_clusters
from meshlab_filter.methods import cluster_entropy, lee2001, shi2011
from meshlab_filter.methods.registry import METHODS
from meshlab_filter.normals import estimate_normals
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
#: Which neighbour gives the density; None is the rounded root of a cluster's size.
NEIGHBOURS = (None, 1, 2, 4, 8)


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
        a model share one clustering: they are levels of detail of the same ranking. Beside them
        "neighbours": by k, what goes from each preset when the k-th neighbour gives the density;
        and "correlation": Spearman's, of a cluster's size and its entropy.
    """
    from scipy.stats import spearmanr

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
    sizes = np.bincount(ranking.labels, minlength=clusters)
    result["neighbours"] = {}
    for k in NEIGHBOURS:
        entropy = entropy_of_clusters(cloud.points, ranking.labels, k=k)
        gone = sizes[np.argsort(entropy, kind="stable")].cumsum()
        result["neighbours"][k] = {
            preset.name: int(gone[preset.recipe.parameters["delete"] - 1]) for preset in presets
        }
    known = np.isfinite(ranking.entropy)
    result["correlation"] = float(spearmanr(sizes[known], ranking.entropy[known]).statistic)
    if seed == 0:
        result["labels"], result["entropy"] = ranking.labels, ranking.entropy
    return result


def at_count(
    name: str,
    models: str | None,
    method: str,
    counts: tuple[int, ...],
    seeds: int = 1,
    scene: bool = False,
) -> list[list[dict[str, Any]]]:
    """Run one method at several counts and measure each with the surface in passes.

    Returns
    -------
    list of list of dict
        For each count one run a seed, the figures and "missed"; a single run where the points
        that stay do not depend on the seed. A method that orders all points ranks them once a
        seed, down to the smallest count. The first run of a count has the scene, if wanted.
    """
    cloud = load(name, models)
    entry = METHODS[method]
    rank = entry.load()
    runs: list[list[dict[str, Any]]] = [[] for _ in counts]
    first: list[np.ndarray] = []
    for seed in range(seeds):
        order = None
        if entry.total_order:
            order = rank(cloud.points, normals=cloud.normals, count=min(counts), seed=seed).rank
        news = False
        for column, count in enumerate(counts):
            if order is None:
                kept = rank(cloud.points, normals=cloud.normals, count=count, seed=seed).indices
            else:
                kept = np.flatnonzero(order >= len(order) - count)
            if seed == 0:
                first.append(kept)
            elif np.array_equal(kept, first[column]):
                continue
            news = True
            figures = measure(cloud, kept, "passes", scene=scene and seed == 0)
            runs[column].append({**figures, "missed": len(kept) - count})
        if not news:
            break
    return runs


def readings(name: str, models: str | None, seeds: int) -> list[dict[str, Any]]:
    """Count what shi2011 and lee2001 keep of Fandisk by each reading of the parameters of Fig. 8.

    Returns
    -------
    list of dict
        "method", "reading" and "kept": one count a seed, or one for the grid.
    """
    cloud = load(name, models)
    points, extent = cloud.points, float(np.ptp(cloud.points, axis=0).max())
    normals = estimate_normals(points, k=15)
    found: list[dict[str, Any]] = []
    # The points in such an order that the seeds are tried in the order of the file.
    turned = np.argsort(np.random.default_rng(0).permutation(len(points)))
    every = np.arange(len(points))
    for reading, order, bend, repeats in (
        ("deviation (1 − cos θ)/2, as here", every, 0.13, seeds),
        ("the same, seeds in the order of the file", turned, 0.13, 1),
        ("deviation 1 − cos θ", every, 0.13 / 2, seeds),
        ("θ as a share of π", every, (1 - np.cos(0.13 * np.pi)) / 2, seeds),
        ("standard deviation of the two normals, sin θ/2", every, 0.13**2, seeds),
        ("θ in radians", every, (1 - np.cos(0.13)) / 2, seeds),
    ):
        kept = []
        for seed in range(repeats):
            options = {"space_interval": 0.076, "normal_threshold": float(bend), "seed": seed}
            ranking = shi2011.rank(points[order], normals=normals[order], **options)
            kept.append(len(ranking.indices))
        found.append({"method": "shi2011", "reading": reading, "kept": kept})
    edge = 0.0696
    cube = extent / 2 ** np.floor(np.log2(extent / edge))
    for reading, size, spread in (
        ("edge of the first cells, as here", edge, 0.41),
        ("the same, no cell split", edge, 2.0),
        ("the same, variance of the normals", edge, np.sqrt(0.41)),
        ("edge √2 intervals", edge * np.sqrt(2), 0.41),
        ("edge two intervals", edge * 2, 0.41),
        ("share of the diagonal", edge * cloud.diagonal, 0.41),
        ("least edge of an octree's cells", cube, 0.41),
        ("the same, no cell split", cube, 2.0),
    ):
        cells = int(lee2001.split_cells(points, normals, size, spread).max()) + 1
        found.append({"method": "lee2001", "reading": reading, "kept": [cells]})
    return found
