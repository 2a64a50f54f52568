"""The baseline: points in a uniformly random order."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..validation import check_integer, check_points
from .ranking import Ranking
from .selection import check_count, ranking_from_order


def rank(
    points: npt.ArrayLike,
    *,
    normals: npt.ArrayLike | None = None,
    count: int | None = None,
    seed: int = 0,
) -> Ranking:
    """Rank the points by a uniformly random permutation.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    normals : array_like, shape (N, 3), optional
        Taken for the sake of the common interface; not used.
    count : int, optional
        Points to keep, met exactly; without it every point is ranked and none is cut.
    seed : int
        Seed of the permutation.

    Returns
    -------
    Ranking
        A total order: ``rank >= N - M`` keeps M points for every M.

    Raises
    ------
    InvalidCloudError
        If the points are not finite coordinates of shape (N, 3).
    InvalidParameterError
        If the count or the seed is out of range.

    Examples
    --------
    >>> points = [[x, 0, 0] for x in range(6)]
    >>> len(rank(points, count=2, seed=1).indices)
    2
    """
    cloud = check_points(points)
    count = check_count(count, len(cloud))
    seed = check_integer(seed, name="seed", minimum=0)
    order = np.random.default_rng(seed).permutation(len(cloud))
    return ranking_from_order(order, count=count)
