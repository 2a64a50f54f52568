"""Simplifying a cloud: from points to the indices of those that stay."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .amounts import points_to_keep
from .errors import InvalidCloudError, InvalidParameterError
from .methods.ranking import Ranking
from .methods.registry import get_method
from .validation import FloatArray, IntArray, check_points

#: What keeps an asked number of points, and what deletes an asked number of clusters.
COUNT_METHOD, CLUSTER_METHOD = "adaptive", "cluster-entropy"
#: Clusters the paper's rule deletes where nothing is asked: Bunny's share in its Table 1.
DEFAULT_DELETE = 0.074
#: Bounds of coordinates and of the extent of a cloud: their cubes are still numbers.
LARGEST, SMALLEST = 1e100, 1e-100


@dataclass(frozen=True, kw_only=True)
class Simplification:
    """A simplified cloud, as indices into the original one.

    Attributes
    ----------
    indices : numpy.ndarray, shape (M,), int64
        The points that stay, ascending: the original order.
    rank : numpy.ndarray, shape (N,), int64
        The rank of every point; the cloud is ``rank >= threshold``.
    threshold : int
    labels : numpy.ndarray, shape (N,), int64, or None
        The cluster of each point, for methods that make clusters.
    entropy : numpy.ndarray, shape (C,), float64, or None
        The entropy of each cluster (nats), for methods that compute it.
    method : str
    parameters : dict
        Everything the method was called with, seed included.
    asked : int or None
        The number of points asked for, where one was.
    info : dict
        Further figures of the method.
    """

    indices: IntArray
    rank: IntArray
    threshold: int
    labels: IntArray | None
    entropy: FloatArray | None
    method: str
    parameters: dict[str, Any]
    asked: int | None = None
    info: dict[str, Any] = field(default_factory=dict)

    @property
    def missed(self) -> int:
        """Points kept beyond the number asked for (negative: too few); 0 if none was asked."""
        return 0 if self.asked is None else len(self.indices) - self.asked


def simplify(
    points: npt.ArrayLike,
    *,
    method: str | None = None,
    normals: npt.ArrayLike | None = None,
    count: int | None = None,
    keep: float | None = None,
    seed: int = 0,
    progress: Callable[[float], object] | None = None,
    **parameters: Any,
) -> Simplification:
    """Choose which points of a cloud stay.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        At least three points, not all in one place; any unit of length.
    method : str, optional
        A name that :data:`meshlab_filter.methods.registry.METHODS` knows. By default "adaptive"
        when a count or a share is asked for, else the paper's "cluster-entropy".
    normals : array_like, shape (N, 3), optional
        Used by methods that need them; estimated where they are not given.
    count : int, optional
        How many points to keep. "adaptive" keeps exactly as many.
    keep : float, optional
        The share of the points to keep, 0 … 1, instead of ``count``.
    seed : int
        Same points, parameters and seed: same result.
    progress : callable, optional
        Called with the share done, 0 … 1.
    **parameters
        The method's own, such as ``clusters``, ``delete`` and ``keep_representative`` of
        "cluster-entropy" or ``evenness`` of "adaptive".

    Returns
    -------
    Simplification

    Raises
    ------
    InvalidCloudError
        If the points cannot be worked on.
    InvalidParameterError
        If a parameter is unknown, out of range or contradicts another.

    References
    ----------
    A. Mahdaoui, E. H. Sbai, "3D Point Cloud Simplification Based on k-Nearest Neighbor and
    Clustering", Advances in Multimedia 2020, 8825205, Algorithm 1.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> result = simplify(rng.random((400, 3)), clusters=20, delete=5, seed=0)
    >>> result.method, len(np.unique(result.labels))
    ('cluster-entropy', 20)
    >>> len(simplify(rng.random((400, 3)), count=50).indices)
    50
    """
    array = check_cloud(points)
    asked = points_to_keep(len(array), count=count, keep=keep)
    if method is None:
        clusters_asked = {"clusters", "delete", "keep_representative"} & parameters.keys()
        method = COUNT_METHOD if asked is not None and not clusters_asked else CLUSTER_METHOD
    chosen = get_method(method)
    parameters = {name: value for name, value in parameters.items() if value is not None}
    chosen.check_parameters(parameters)
    if method == CLUSTER_METHOD and asked is None:
        parameters.setdefault("delete", DEFAULT_DELETE)
    if normals is not None:
        normals = np.ascontiguousarray(normals, dtype=np.float64)
        if normals.shape != array.shape or not np.isfinite(normals).all():
            raise InvalidCloudError(
                f"Invalid normals. Must be finite and have the shape of the points, "
                f"{array.shape}. Given: shape {normals.shape}."
            )
    arguments: dict[str, Any] = {**parameters}
    rank = chosen.load()
    if progress is not None and "progress" in inspect.signature(rank).parameters:
        arguments["progress"] = progress
    ranking: Ranking = rank(array, normals=normals, count=asked, seed=seed, **arguments)
    indices = ranking.indices
    if not len(indices):
        raise InvalidParameterError(
            f"Nothing would be left of the cloud. Given: method {method} with {parameters}."
        )
    defaults = {parameter.name: parameter.default for parameter in chosen.parameters}
    return Simplification(
        indices=indices,
        rank=ranking.rank,
        threshold=int(ranking.threshold),
        labels=ranking.labels,
        entropy=ranking.entropy,
        method=method,
        parameters={**defaults, **parameters, "seed": seed},
        asked=asked,
        info=ranking.info,
    )


def check_cloud(points: npt.ArrayLike) -> FloatArray:
    """Return points that can be simplified: at least three, not all in one place.

    Raises
    ------
    InvalidCloudError
        If there are fewer, they are all the same, or so large or so near each other that the
        squares and cubes of their distances cannot be computed.

    Examples
    --------
    >>> check_cloud([[1, 1, 1]] * 3)
    Traceback (most recent call last):
        ...
    meshlab_filter.errors.InvalidCloudError: All points are in one place. Given: 3 equal points.
    """
    array = check_points(points, minimum=3)
    if (array == array[0]).all():
        raise InvalidCloudError(f"All points are in one place. Given: {len(array)} equal points.")
    largest = float(np.abs(array).max())
    if largest > LARGEST:
        raise InvalidCloudError(
            f"Invalid points. Coordinates must be at most {LARGEST:g}, or the squares and cubes of "
            f"distances are beyond the numbers of the machine. Given: {largest:g}."
        )
    edge = float(np.ptp(array, axis=0).max())
    if edge < SMALLEST:
        raise InvalidCloudError(
            f"Invalid points. The largest edge of their bounding box must be at least "
            f"{SMALLEST:g}, or the squares and cubes of distances are nothing. Given: {edge:g}."
        )
    return array
