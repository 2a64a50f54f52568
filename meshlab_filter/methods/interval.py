"""Groups a space interval across, divided where normals bend: what two rivals have in common.

Shi et al. make the groups by k-means and Lee et al. by a grid. Both take the interval at which they
begin and a threshold on the normals of a group, and both leave one point in each.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from ..validation import FloatArray, IntArray, check_number, check_points
from .ranking import Ranking
from .selection import (
    check_count,
    check_normals,
    diagonal,
    ranking_from_subset,
    search_parameter,
)

#: Takes points, unit normals, interval and threshold; returns the group of each point, from 0.
Divide = Callable[[FloatArray, FloatArray, float, float], IntArray]
#: Takes points, unit normals and the group of each point; returns the points that stay, ascending.
Choose = Callable[[FloatArray, FloatArray, IntArray], IntArray]


def rank_by_interval(
    points: npt.ArrayLike,
    divide: Divide,
    choose: Choose,
    *,
    normals: npt.ArrayLike | None,
    count: int | None,
    space_interval: float | None,
    normal_threshold: float | None,
    usual: float,
    least: float = float(np.finfo(float).tiny),
    loosest: float,
) -> Ranking:
    """Divide a cloud into groups and keep the point that stands for each.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    divide, choose : callable
        The method: which points are a group, and which of them stays.
    normals : array_like, shape (N, 3), or None
        Estimated from 15 nearest neighbours where there are none.
    count : int or None
        Points to keep, met as nearly as can be by :func:`search_grid`.
    space_interval : float or None
        In the unit of the points; None for 1 % of the bounding box's diagonal.
    normal_threshold : float or None
        Dimensionless; None for ``usual``.
    usual, least, loosest : float
        The threshold's default, its smallest value, and one that no normals reach.

    Returns
    -------
    Ranking
        Rank 1 for the points that stay, 0 for the others; ``labels`` are the groups, and ``info``
        has the interval and the threshold.

    Raises
    ------
    InvalidCloudError
        If points or normals are not finite or do not fit together.
    InvalidParameterError
        If a parameter is out of range.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]])
    >>> result = rank_by_interval(
    ...     points,
    ...     lambda cloud, normals, interval, threshold: (cloud[:, 0] // interval).astype(int),
    ...     lambda cloud, normals, group: np.unique(group, return_index=True)[1],
    ...     normals=np.tile([0, 0, 1.0], (4, 1)), count=None,
    ...     space_interval=2.0, normal_threshold=None, usual=0.5, loosest=2.0,
    ... )
    >>> result.indices
    array([0, 2])
    """
    cloud = check_points(points)
    count = check_count(count, len(cloud))
    tiny = float(np.finfo(float).tiny)
    if space_interval is not None:
        check_number(space_interval, name="space_interval", minimum=tiny)
    if normal_threshold is not None:
        check_number(normal_threshold, name="normal_threshold", minimum=least)
    vectors = check_normals(cloud, normals)
    extent = diagonal(cloud) or 1.0
    interval = extent / 100 if space_interval is None else float(space_interval)
    threshold = usual if normal_threshold is None else float(normal_threshold)
    if count is not None:
        interval, threshold, _ = search_grid(
            lambda *at: choose(cloud, vectors, divide(cloud, vectors, *at)),
            count,
            interval=interval,
            threshold=threshold,
            loosest=loosest,
            extent=extent,
            free=(space_interval is None, normal_threshold is None),
        )
    labels = divide(cloud, vectors, interval, threshold)
    return ranking_from_subset(
        choose(cloud, vectors, labels),
        len(cloud),
        count=count,
        labels=labels,
        space_interval=interval,
        normal_threshold=threshold,
    )


def search_grid(
    evaluate: Callable[[float, float], IntArray],
    count: int,
    *,
    interval: float,
    threshold: float,
    loosest: float,
    extent: float,
    free: tuple[bool, bool],
) -> tuple[float, float, IntArray]:
    """Find the space interval and the normal threshold for which a method keeps ``count`` points.

    The interval is searched first. Where even a coarse one keeps too many, for clusters or cells
    are split until their normals agree, the interval becomes the one that gives three quarters of
    the points without any split, about their share on Fandisk with the published parameters, and
    the threshold is raised until the splits give the rest.

    Parameters
    ----------
    evaluate : callable
        Takes interval and threshold, returns the indices that stay.
    count : int
        Points asked for.
    interval, threshold : float
        The values to begin with.
    loosest : float
        A threshold that no normals reach.
    extent : float
        Diagonal of the bounding box.
    free : tuple of bool
        Whether interval and threshold may be changed.

    Returns
    -------
    interval, threshold : float
    kept : numpy.ndarray of int64
    """
    kept = evaluate(interval, threshold)

    def search_interval(threshold: float, count: int) -> tuple[float, IntArray]:
        return search_parameter(
            lambda value: evaluate(value, threshold),
            count,
            start=extent / math.sqrt(count),
            low=extent * 1e-6,
            high=extent * 2,
        )

    if len(kept) != count and free[0]:
        interval, kept = search_interval(threshold, count)
    if len(kept) == count or not free[1] or (free[0] and len(kept) < count):
        return interval, threshold, kept
    if free[0] and len(kept) > 1.01 * count:
        interval, _ = search_interval(loosest, max(1, round(0.75 * count)))
    threshold, kept = search_parameter(
        lambda value: evaluate(interval, value), count, start=threshold, low=1e-6, high=loosest
    )
    return interval, threshold, kept
