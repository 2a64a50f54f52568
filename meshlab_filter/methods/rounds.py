"""Taking away the least informative point again and again, many at a time where they do not touch.

The iterative methods of the literature keep a priority queue and update the neighbours after every
single removal. Here each round removes every point that is least among its nearest neighbours, and
so not a neighbour of another one removed: the queue would have removed it before any of them.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from ..normals import nearest_neighbours
from ..validation import FloatArray, IntArray, check_integer, check_points
from .ranking import Ranking
from .selection import check_count, ranking_from_order

_APART = 6  # nearest neighbours, both ways, of which only one goes in a round
_CANDIDATES = 5  # only the lowest fifth may go in a round,
_LARGEST_ROUND = 10  # and no more than a tenth of what is left

#: Takes indices of the points left, shape (n,), and the neighbours of each among them, as places
#: in that array, shape (n, k); returns the information of each, shape (n,).
Information = Callable[[IntArray, IntArray], FloatArray]


def rank_in_rounds(
    points: npt.ArrayLike,
    prepare: Callable[[FloatArray], Information],
    *,
    neighbors: int,
    fewest: int = 1,
    count: int | None,
    seed: int,
) -> Ranking:
    """Check what the methods of this kind have in common, and rank points by when they go.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    prepare : callable
        Takes the checked points, returns what tells how informative each is.
    neighbors : int
        Nearest neighbours a point is judged by, at least ``fewest``.
    fewest : int
        Neighbours that the information needs.
    count : int or None
        Points to keep, met exactly; without it every point is ranked and none is cut.
    seed : int
        Of the random order among points that tell exactly as much.

    Returns
    -------
    Ranking
        A total order: ``rank >= N - M`` keeps M points for every M.

    Raises
    ------
    InvalidCloudError
        If the points are not finite coordinates of shape (N, 3).
    InvalidParameterError
        If a parameter is out of range.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [1.1, 0, 0], [3, 0, 0]])
    >>> def from_the_left(cloud):
    ...     return lambda left, near: cloud[left, 0]
    >>> rank_in_rounds(points, from_the_left, neighbors=1, count=3, seed=0).indices
    array([1, 2, 3])
    """
    cloud = check_points(points)
    count = check_count(count, len(cloud))
    seed = check_integer(seed, name="seed", minimum=0)
    neighbors = check_integer(neighbors, name="neighbors", minimum=fewest)
    information = prepare(cloud)
    order = remove_in_rounds(cloud, information, neighbors=neighbors, count=count, seed=seed)
    return ranking_from_order(order, count=count)


def remove_in_rounds(
    points: FloatArray, information: Information, *, neighbors: int, count: int | None, seed: int
) -> IntArray:
    """Return all points in the order in which they go, the least informative first.

    Parameters
    ----------
    points : numpy.ndarray, shape (N, 3)
        Coordinates in any unit of length.
    information : callable
        What a point tells that its neighbours do not; evaluated anew in each round.
    neighbors : int
        Nearest neighbours handed to ``information``, fewer where fewer are left.
    count : int or None
        Points left when the removal stops; they follow in the order of what they tell then. A
        deeper run begins with the same removals.
    seed : int
        Of the random order among points that tell exactly as much.

    Returns
    -------
    numpy.ndarray, shape (N,), int64

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [1.1, 0, 0], [3, 0, 0]])
    >>> def gap(left, near):
    ...     return np.linalg.norm(points[left] - points[left[near[:, 0]]], axis=1)
    >>> remove_in_rounds(points, gap, neighbors=1, count=3, seed=0)[0] in (1, 2)
    True
    """
    lottery = np.random.default_rng(seed).permutation(len(points))
    left = np.arange(len(points))
    gone: list[IntArray] = []
    stop = 1 if count is None else count
    while True:
        near = nearest_neighbours(points[left], neighbors)
        if near.shape[1] == 0:
            break
        turn = np.empty(len(left), dtype=np.int64)
        turn[np.lexsort((lottery[left], information(left, near)))] = np.arange(len(left))
        if len(left) <= stop:
            left = left[np.argsort(turn)]
            break
        least = turn < max(1, len(left) // _CANDIDATES)
        closest = near[:, :_APART]
        least &= turn < turn[closest].min(axis=1)
        bound = np.full(len(left), len(left))
        np.minimum.at(bound, closest.ravel(), np.repeat(turn, closest.shape[1]))
        least &= turn < bound
        most = min(max(1, len(left) // _LARGEST_ROUND), len(left) - stop)
        chosen = np.flatnonzero(least)
        chosen = chosen[np.argsort(turn[chosen])][:most]
        gone.append(left[chosen])
        left = np.delete(left, chosen)
    return np.concatenate([*gone, left])
