"""What the methods share: counts, normals, rankings from orders and subsets, and a search."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ..validation import FloatArray, IntArray, check_integer
from .ranking import Ranking


def check_count(count: int | None, size: int) -> int | None:
    """Return the number of points to keep, between 1 and ``size``, or None where none is asked.

    Raises
    ------
    InvalidParameterError
        If the count is not a whole number between 1 and ``size``.
    """
    if count is None:
        return None
    return check_integer(count, name="count", minimum=1, maximum=size)


def check_normals(points: FloatArray, normals: npt.ArrayLike | None, *, k: int = 15) -> FloatArray:
    """Return unit normals: those given, or estimated from k nearest neighbours and made consistent.

    Parameters
    ----------
    points : numpy.ndarray, shape (N, 3)
        Coordinates in any unit of length.
    normals : array_like, shape (N, 3), or None
        Need not be of unit length.
    k : int
        Neighbours of the estimate, where there are no normals.

    Returns
    -------
    numpy.ndarray, shape (N, 3), float64

    Raises
    ------
    InvalidCloudError
        If the normals are not finite or not as many as the points.
    """
    from ..normals import estimate_normals, unit_normals

    if normals is None:
        return estimate_normals(points, k=k)
    return unit_normals(normals, points)


def ranking_from_order(order: IntArray, *, count: int | None, **info: Any) -> Ranking:
    """Return the ranking of points removed in the order given, cut where ``count`` are left.

    Parameters
    ----------
    order : numpy.ndarray, shape (N,), int64
        Indices, the point that goes first in front.
    count : int or None
        Points to keep; None keeps all.
    **info
        Figures about the run.

    Examples
    --------
    >>> ranking_from_order(np.array([2, 0, 1]), count=2).indices
    array([0, 1])
    """
    size = len(order)
    rank = np.empty(size, dtype=np.int64)
    rank[order] = np.arange(size)
    return Ranking(rank=rank, threshold=size - (size if count is None else count), info=info)


def ranking_from_subset(
    kept: IntArray,
    size: int,
    *,
    count: int | None = None,
    labels: IntArray | None = None,
    **info: Any,
) -> Ranking:
    """Return the ranking that keeps a subset: rank 1 for its points, 0 for the others.

    Parameters
    ----------
    kept : numpy.ndarray of int64
        Indices of the points that stay.
    size : int
        Number of points, N.
    count : int, optional
        What was asked for; ``info["missed"]`` then says by how many points it was missed,
        positive where too many stay.
    labels : numpy.ndarray, shape (N,), optional
        The cluster of each point.
    **info
        Figures about the run.

    Examples
    --------
    >>> ranking_from_subset(np.array([0, 3]), 4, count=3).info
    {'missed': -1}
    """
    rank = np.zeros(size, dtype=np.int64)
    rank[kept] = 1
    if count is not None:
        info["missed"] = len(kept) - count
    return Ranking(rank=rank, threshold=1, labels=labels, info=info)


def nearest_in_group(labels: IntArray, distance: FloatArray) -> IntArray:
    """Return, for each group, the index of its member of least distance, the first of equals.

    Parameters
    ----------
    labels : numpy.ndarray, shape (N,), int64
        Group of each point.
    distance : numpy.ndarray, shape (N,)
        What to compare within a group.

    Returns
    -------
    numpy.ndarray of int64, ascending by group

    Examples
    --------
    >>> nearest_in_group(np.array([0, 1, 0]), np.array([2.0, 5.0, 1.0]))
    array([2, 1])
    """
    order = np.lexsort((np.arange(len(labels)), distance, labels))
    first = np.ones(len(labels), dtype=bool)
    first[1:] = labels[order][1:] != labels[order][:-1]
    return order[first]


def diagonal(points: FloatArray) -> float:
    """Return the length of the bounding box's diagonal, in the unit of the points."""
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def search_parameter(
    evaluate: Callable[[float], IntArray],
    count: int,
    *,
    start: float,
    low: float,
    high: float,
    steps: int = 16,
) -> tuple[float, IntArray]:
    """Find the value of a parameter for which a method keeps nearly ``count`` points.

    The search is on logarithms: outward from ``start`` as if the count fell with the square of
    the value, as it does on a surface, until the count lies between two values; then by false
    position within that bracket. It assumes that a larger value keeps fewer points; where a
    method is not quite monotone, the nearest of all values tried counts, of equals the first.

    Parameters
    ----------
    evaluate : callable
        Takes the value, returns the indices that stay.
    count : int
        Points asked for.
    start, low, high : float
        Where to begin and the bounds, positive.
    steps : int
        Most evaluations.

    Returns
    -------
    value : float
    kept : numpy.ndarray of int64

    Examples
    --------
    >>> value, kept = search_parameter(
    ...     lambda x: np.arange(int(100 / x)), 20, start=1.0, low=0.1, high=100.0
    ... )
    >>> len(kept)
    20
    """
    best: tuple[int, float, IntArray] | None = None
    below, above = math.log(low), math.log(high)
    excess_below = excess_above = math.nan  # of log counts over the one asked for
    at = min(max(math.log(start), below), above)
    for step in range(steps):
        value = math.exp(at)
        kept = evaluate(value)
        missed = len(kept) - count
        if best is None or abs(missed) < best[0]:
            best = (abs(missed), value, kept)
        excess = math.log(max(len(kept), 0.5) / count)
        if missed > 0:
            below, excess_below = at, excess
        else:
            above, excess_above = at, excess
        if missed == 0 or above - below < 1e-9:
            break
        if math.isnan(excess_above):
            at = min(at + max(excess * 0.55, 0.01 * 2**step), above)
        elif math.isnan(excess_below):
            at = max(at + min(excess * 0.55, -0.01 * 2**step), below)
        else:
            # Every third step halves the bracket, where the secant creeps along one side.
            share = 0.5 if step % 3 == 2 else excess_below / (excess_below - excess_above)
            at = below + (above - below) * min(max(share, 0.05), 0.95)
    assert best is not None
    return best[1], best[2]
