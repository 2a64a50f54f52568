"""MeshLab's own point samplers as methods: ranks 1 for the samples, 0 for the other points.

None of MeshLab's samplers takes a seed. Clustered vertex sampling uses no randomness; Poisson disk
sampling draws from MeshLab's own generator, so that two runs keep about as many points, but not
the same ones.
"""

from __future__ import annotations

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
    cloud, count = _check(points, count, seed, "poisson-disk")
    distinct = _distinct(cloud)
    # MeshLab searches for the radius without end where so many points cannot be had.
    if count >= len(distinct):
        return ranking_from_subset(distinct[:count], len(cloud), count=count)
    meshset = import_pymeshlab().MeshSet(verbose=False)
    add_layer(meshset, cloud[distinct])
    with stage("sampling Poisson disks"):
        meshset.generate_sampling_poisson_disk(
            samplenum=count, subsample=True, exactnumflag=True, exactnumtolerance=0.005
        )
    kept = _match(meshset.current_mesh().vertex_matrix(), cloud)
    return ranking_from_subset(kept, len(cloud), count=count)


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
    cloud, count = _check(points, count, seed, "clustered-vertex")
    distinct = _distinct(cloud)
    if count >= len(distinct):
        return ranking_from_subset(distinct[:count], len(cloud), count=count)
    extent = diagonal(cloud)
    pymeshlab = import_pymeshlab()
    meshset = pymeshlab.MeshSet(verbose=False)
    add_layer(meshset, cloud)

    def kept_by(cell: float) -> IntArray:
        meshset.set_current_mesh(0)
        with stage("sampling clustered vertices"):
            meshset.generate_sampling_clustered_vertex(
                threshold=pymeshlab.PureValue(cell), sampling="Closest to center"
            )
        kept = _match(meshset.current_mesh().vertex_matrix(), cloud)
        meshset.delete_current_mesh()
        return kept

    cell, kept = search_parameter(
        kept_by, count, start=extent / np.sqrt(count), low=extent * 1e-4, high=extent
    )
    return ranking_from_subset(kept, len(cloud), count=count, cell=cell)


def _check(
    points: npt.ArrayLike, count: int | None, seed: int, method: str
) -> tuple[FloatArray, int]:
    cloud = check_points(points)
    checked = check_count(count, len(cloud))
    check_integer(seed, name="seed", minimum=0)
    if checked is None:
        raise InvalidParameterError(
            f"Invalid count. Must be given for the method {method}, which has no cut of its own. "
            "Given: None."
        )
    return cloud, checked


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
