"""MeshLab's own point samplers as methods: ranks 1 for the samples, 0 for the other points.

None of MeshLab's samplers takes a seed. Clustered vertex sampling uses no randomness; Poisson disk
sampling draws from MeshLab's own generator, so that two runs keep about as many points, but not
the same ones.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from ..errors import InvalidParameterError, MeshLabError
from ..methods.ranking import Ranking
from ..methods.selection import check_count, diagonal, ranking_from_subset, search_parameter
from ..validation import FloatArray, IntArray, check_integer, check_points
from .layer import add_layer
from .session import import_pymeshlab, stage


def rank_poisson_disk(
    points: npt.ArrayLike,
    *,
    normals: npt.ArrayLike | None = None,
    count: int | None = None,
    seed: int = 0,
) -> Ranking:
    """Keep points at least a radius apart, by MeshLab's ``generate_sampling_poisson_disk``.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    normals : array_like, optional
        Taken for the sake of the common interface; not used.
    count : int
        Points to keep. MeshLab comes within about half a percent; ``info["missed"]`` says by how
        many points it was missed.
    seed : int
        Taken for the sake of the common interface: MeshLab's filter has no seed.

    Returns
    -------
    Ranking

    Raises
    ------
    InvalidCloudError
        If the points are not finite coordinates of shape (N, 3).
    InvalidParameterError
        If the count is missing or out of range.
    MeshLabError
        If MeshLab fails or returns other points than the cloud's.

    Notes
    -----
    Source: M. Corsini, P. Cignoni and R. Scopigno, "Efficient and flexible sampling with blue noise
    properties of triangular meshes", IEEE TVCG 18(6):914-924, 2012, doi:10.1109/TVCG.2012.34.

    Examples
    --------
    >>> points = np.random.default_rng(0).random((1000, 3))
    >>> abs(rank_poisson_disk(points, count=100).info["missed"]) < 10
    True
    """

    def choose(sample: _Sample, count: int, extent: float) -> tuple[IntArray, dict[str, Any]]:
        name = "generate_sampling_poisson_disk"
        options = {"subsample": True, "exactnumflag": True, "exactnumtolerance": 0.005}
        return sample(name, samplenum=count, **options), {}

    return _rank(points, choose, count=count, seed=seed, method="poisson-disk")


def rank_clustered_vertex(
    points: npt.ArrayLike,
    *,
    normals: npt.ArrayLike | None = None,
    count: int | None = None,
    seed: int = 0,
) -> Ranking:
    """Keep one point in each cell of a grid, by MeshLab's ``generate_sampling_clustered_vertex``.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    normals : array_like, optional
        Taken for the sake of the common interface; not used.
    count : int
        Points to keep, met as nearly as can be by searching the size of the cells;
        ``info["missed"]`` says by how many points it was missed.
    seed : int
        Taken for the sake of the common interface: the filter uses no randomness.

    Returns
    -------
    Ranking
        ``info["cell"]`` is the size of the cells, in the unit of the points.

    Raises
    ------
    InvalidCloudError
        If the points are not finite coordinates of shape (N, 3).
    InvalidParameterError
        If the count is missing or out of range.
    MeshLabError
        If MeshLab fails or returns other points than the cloud's.

    Examples
    --------
    >>> points = np.random.default_rng(0).random((1000, 3))
    >>> abs(rank_clustered_vertex(points, count=100).info["missed"]) < 10
    True
    """

    def choose(sample: _Sample, count: int, extent: float) -> tuple[IntArray, dict[str, Any]]:
        name = "generate_sampling_clustered_vertex"
        size = import_pymeshlab().PureValue

        def kept_by(cell: float) -> IntArray:
            return sample(name, threshold=size(cell), sampling="Closest to center")

        bounds = {"start": extent / np.sqrt(count), "low": extent * 1e-4, "high": extent}
        cell, kept = search_parameter(kept_by, count, **bounds)
        return kept, {"cell": cell}

    return _rank(points, choose, count=count, seed=seed, method="clustered-vertex")


class _Sample(Protocol):
    """Run a sampler by the name of MeshLab's filter and return the indices of its samples."""

    def __call__(self, name: str, **options: Any) -> IntArray: ...


def _rank(
    points: npt.ArrayLike,
    choose: Callable[[_Sample, int, float], tuple[IntArray, dict[str, Any]]],
    *,
    count: int | None,
    seed: int,
    method: str,
) -> Ranking:
    """Check the input, open it in MeshLab and rank the points that ``choose`` has sampled.

    ``choose`` takes the sampler, the count and the bounding box's diagonal; it returns the points
    that stay, ascending, and figures about the run.
    """
    cloud = check_points(points)
    count = check_count(count, len(cloud))
    check_integer(seed, name="seed", minimum=0)
    if count is None:
        raise InvalidParameterError(
            f"Invalid count. Must be given for the method {method}, which has no cut of its own. "
            "Given: None."
        )
    distinct = _distinct(cloud)
    # Points in one place leave one, and MeshLab would search without end for more than there are.
    if count >= len(distinct):
        return ranking_from_subset(distinct[:count], len(cloud), count=count)
    meshset = import_pymeshlab().MeshSet(verbose=False)
    add_layer(meshset, cloud[distinct])

    def sample(name: str, **options: Any) -> IntArray:
        meshset.set_current_mesh(0)
        with stage(f"running {name}"):
            getattr(meshset, name)(**options)
        kept = distinct[_match(meshset.current_mesh().vertex_matrix(), cloud[distinct])]
        meshset.delete_current_mesh()
        return kept

    kept, figures = choose(sample, count, diagonal(cloud))
    return ranking_from_subset(kept, len(cloud), count=count, **figures)


def _distinct(points: FloatArray) -> IntArray:
    """Return the first of the points in each place, ascending."""
    return np.sort(np.unique(points, axis=0, return_index=True)[1]).astype(np.int64)


def _match(samples: FloatArray, points: FloatArray) -> IntArray:
    """Return the indices of the points that the samples are, ascending."""
    from scipy.spatial import cKDTree

    away, index = cKDTree(points).query(samples, workers=-1)
    if len(samples) == 0 or away.max() > 0:
        raise MeshLabError(
            "MeshLab's sampler must return some of the cloud's own points. "
            f"Given: {len(samples)} samples, {int((away > 0).sum())} of them elsewhere."
        )
    return np.unique(index).astype(np.int64)
