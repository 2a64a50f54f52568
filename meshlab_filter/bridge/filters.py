"""Filters that act on pymeshlab's current layer, named and called like its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..simplification import CLUSTER_METHOD, COUNT_METHOD, simplify
from .layer import current_normals, current_points, delete_vertices

if TYPE_CHECKING:
    import pymeshlab


def meshing_decimation_cluster_entropy(
    meshset: pymeshlab.MeshSet,
    *,
    clusters: int | None = None,
    delete: int | float | None = None,
    keep: float | None = None,
    count: int | None = None,
    k: int | None = None,
    init: str = "random",
    keep_representative: bool = False,
    seed: int = 0,
) -> dict[str, Any]:
    """Delete the clusters of lowest entropy from the current layer (Algorithm 1 of the paper).

    Normals, colours, quality, texture coordinates and custom attributes of the vertices that
    stay are untouched; faces stay where all their corners do. The rank of each vertex is left in
    the custom attribute ``meshlab_filter_rank``.

    Parameters
    ----------
    meshset : pymeshlab.MeshSet
    clusters : int, optional
        Number of k-means clusters; 5 % of the vertices by default.
    delete : int or float, optional
        How many clusters go, or which share of them (0 … 1); 7.4 % by default.
    keep, count : float, int, optional
        Instead: the share or number of vertices to keep, reached as nearly as whole clusters
        allow.
    k : int, optional
        Neighbours of the density estimate; the rounded root of a cluster's size by default.
    init : str
        Start of k-means: "random", "k-means++" or "spread".
    keep_representative : bool
        Leave the vertex nearest the centre of each deleted cluster.
    seed : int

    Returns
    -------
    dict
        "vertices_before", "vertices_after", "clusters", "clusters_deleted" and "missed", the
        vertices kept beyond the number asked for.

    Raises
    ------
    InvalidCloudError
        If there is no layer, or its vertices cannot be worked on.
    InvalidParameterError
        If a parameter is out of range.

    References
    ----------
    A. Mahdaoui, E. H. Sbai, Advances in Multimedia 2020, 8825205, Algorithm 1.

    Examples
    --------
    >>> import pymeshlab
    >>> ms = pymeshlab.MeshSet(verbose=False)
    >>> ms.create_sphere(subdiv=4)
    >>> figures = meshing_decimation_cluster_entropy(ms, clusters=100, delete=10)
    >>> figures["vertices_before"], ms.current_mesh().vertex_number() < 2562
    (2562, True)
    """
    return _decimate(
        meshset,
        method=CLUSTER_METHOD,
        clusters=clusters,
        delete=delete,
        keep=keep,
        count=count,
        k=k,
        init=init,
        keep_representative=keep_representative,
        seed=seed,
    )


def meshing_decimation_adaptive(
    meshset: pymeshlab.MeshSet,
    *,
    count: int | None = None,
    keep: float | None = None,
    evenness: float = 0.4,
    crease_safety: float = 0.4,
    noisy: bool = False,
    seed: int = 0,
) -> dict[str, Any]:
    """Thin the current layer to exactly as many vertices as asked, denser where the shape bends.

    What the vertices that stay carry is untouched; faces stay where all their corners do. The
    rank of each vertex is left in the custom attribute ``meshlab_filter_rank``.

    Parameters
    ----------
    meshset : pymeshlab.MeshSet
    count, keep : int, float, optional
        The number or the share (0 … 1) of vertices to keep; 10 % by default.
    evenness, crease_safety : float
        See :func:`meshlab_filter.methods.adaptive.rank`.
    noisy : bool
        Judge points by positions smoothed to the tangent plane.
    seed : int

    Returns
    -------
    dict
        "vertices_before" and "vertices_after".

    Raises
    ------
    InvalidCloudError
        If there is no layer, or its vertices cannot be worked on.
    InvalidParameterError
        If a parameter is out of range.

    Examples
    --------
    >>> import pymeshlab
    >>> ms = pymeshlab.MeshSet(verbose=False)
    >>> ms.create_sphere(subdiv=4)
    >>> meshing_decimation_adaptive(ms, count=300)["vertices_after"]
    300
    """
    if count is None and keep is None:
        keep = 0.1
    return _decimate(
        meshset,
        method=COUNT_METHOD,
        count=count,
        keep=keep,
        evenness=evenness,
        crease_safety=crease_safety,
        noisy=noisy,
        seed=seed,
    )


def _decimate(meshset: pymeshlab.MeshSet, **options: Any) -> dict[str, Any]:
    points = current_points(meshset)
    result = simplify(points, normals=current_normals(meshset), **options)
    delete_vertices(meshset, result.rank, result.threshold)
    figures: dict[str, Any] = {
        "vertices_before": len(points),
        "vertices_after": meshset.current_mesh().vertex_number(),
    }
    if result.entropy is not None:
        figures |= {
            "clusters": len(result.entropy),
            "clusters_deleted": result.threshold,
            "missed": result.missed,
        }
    return figures
