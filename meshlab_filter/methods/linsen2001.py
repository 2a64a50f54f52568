"""Linsen: take away the point of least local information, again and again."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..errors import InvalidParameterError
from ..normals import nearest_neighbours
from ..validation import FloatArray, IntArray, check_number
from .ranking import Ranking
from .rounds import Information, rank_in_rounds
from .selection import check_normals


def rank(
    points: npt.ArrayLike,
    *,
    normals: npt.ArrayLike | None = None,
    count: int | None = None,
    seed: int = 0,
    neighbors: int = 15,
    weight_distance: float = 1.0,
    weight_plane: float = 1.0,
    weight_normal: float = 1.0,
) -> Ranking:
    """Rank points by when they are the one that tells least beyond its neighbours.

    The information of a point is a weighted sum of three means over its nearest neighbours: their
    distance, their distance to its tangent plane (both in units of the cloud's mean distance to
    the neighbours), and 1 − cos of the angle between the normals.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    normals : array_like, shape (N, 3), optional
        Their signs count. Without them they are estimated from 15 nearest neighbours.
    count : int, optional
        Points to keep, met exactly; without it every point is ranked and none is cut.
    seed : int
        Of the random order among points of equal information.
    neighbors : int
        Nearest neighbours a point is judged by.
    weight_distance, weight_plane, weight_normal : float
        Weights of the three terms, not negative, one of them positive.

    Returns
    -------
    Ranking
        A total order: ``rank >= N - M`` keeps M points for every M.

    Raises
    ------
    InvalidCloudError
        If points or normals are not finite or do not fit together.
    InvalidParameterError
        If a parameter is out of range.

    Notes
    -----
    Source: L. Linsen, "Point cloud representation", technical report, Fakultät für Informatik,
    Universität Karlsruhe, 2001. Guessed, for the description leaves it open: the weights, the unit
    of the distances and the number of neighbours; the report's term for colours is left out, and
    points go in rounds (:func:`meshlab_filter.methods.rounds.remove_in_rounds`).

    Examples
    --------
    Of points on a line the one in the closest company goes first.

    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [1.5, 0, 0], [2, 0, 0], [5, 0, 0]])
    >>> rank(points, normals=np.tile([0, 0, 1.0], (5, 1)), neighbors=2, count=4).indices
    array([0, 1, 3, 4])
    """
    weights = [
        check_number(value, name=name, minimum=0.0)
        for name, value in (
            ("weight_distance", weight_distance),
            ("weight_plane", weight_plane),
            ("weight_normal", weight_normal),
        )
    ]
    if not any(weights):
        raise InvalidParameterError("Invalid weights. One must be positive. Given: 0, 0, 0.")

    def prepare(cloud: FloatArray) -> Information:
        vectors = check_normals(cloud, normals)
        near = nearest_neighbours(cloud, neighbors)
        away = np.linalg.norm(cloud[near] - cloud[:, None], axis=2)
        unit = float(away.mean()) if away.size else 1.0
        scaled = cloud / (unit or 1.0)

        def information(left: IntArray, near: IntArray) -> FloatArray:
            return _information(scaled[left], vectors[left], near, weights)

        return information

    return rank_in_rounds(points, prepare, neighbors=neighbors, count=count, seed=seed)


def _information(
    points: FloatArray, normals: FloatArray, near: IntArray, weights: list[float]
) -> FloatArray:
    """Return the weighted sum of distance, distance to the plane and change of normals."""
    offset = points[near] - points[:, None]
    distance = np.sqrt(np.einsum("nki,nki->nk", offset, offset)).mean(axis=1)
    plane = np.abs(np.einsum("nki,ni->nk", offset, normals)).mean(axis=1)
    bend = 1.0 - np.einsum("nki,ni->nk", normals[near], normals).mean(axis=1)
    total: FloatArray = weights[0] * distance + weights[1] * plane + weights[2] * bend
    return total
