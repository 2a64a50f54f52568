"""Xuan et al.: take away the point of lowest entropy of normal angles, again and again."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..validation import FloatArray, IntArray
from .ranking import Ranking
from .rounds import Information, rank_in_rounds
from .selection import check_normals

_NO_ANGLE = 1e-6  # radians; below it the angle between unit normals is rounding


def rank(
    points: npt.ArrayLike,
    *,
    normals: npt.ArrayLike | None = None,
    count: int | None = None,
    seed: int = 0,
    neighbors: int = 15,
) -> Ranking:
    """Rank points by when their normal angles have the lowest entropy.

    The angles θ between a point's normal and those of its nearest neighbours, as shares
    p = θ / Σθ, have the entropy H = −Σ p ln p; the point of lowest entropy goes first.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    normals : array_like, shape (N, 3), optional
        Their signs count. Without them they are estimated from 15 nearest neighbours.
    count : int, optional
        Points to keep, met exactly; without it every point is ranked and none is cut.
    seed : int
        Of the random order among points of equal entropy, as all points of a plane are.
    neighbors : int
        Nearest neighbours a point is judged by.

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
    Source: W. Xuan, X. Hua, X. Chen, J. Zou and X. He, "A new progressive simplification method
    for point cloud using local entropy of normal angle", Journal of the Indian Society of Remote
    Sensing 46:581-589, 2018, doi:10.1007/s12524-017-0730-6. Chosen here: normals are not estimated
    anew from the points left, angles below 1e-6 count as none, their entropy as 0, and points go
    in rounds (:func:`meshlab_filter.methods.rounds.remove_in_rounds`).

    Examples
    --------
    >>> angle = np.radians([0, 0, 0, 10, 30, 60])
    >>> normals = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    >>> points = np.arange(6.0)[:, None] * [1, 0, 0]
    >>> 5 in rank(points, normals=normals, neighbors=2, count=4).indices
    True
    """

    def prepare(cloud: FloatArray) -> Information:
        vectors = check_normals(cloud, normals)

        def information(left: IntArray, near: IntArray) -> FloatArray:
            return angle_entropy(vectors[left], near)

        return information

    return rank_in_rounds(points, prepare, neighbors=neighbors, count=count, seed=seed)


def angle_entropy(normals: FloatArray, near: IntArray) -> FloatArray:
    """Return the entropy of the angles between each normal and those of its neighbours.

    Parameters
    ----------
    normals : numpy.ndarray, shape (N, 3)
        Unit normals.
    near : numpy.ndarray, shape (N, k), int64
        Neighbours of each.

    Returns
    -------
    numpy.ndarray, shape (N,), float64
        In nats, between 0 and ln k; 0 where all normals are parallel.

    Examples
    --------
    Two equal angles have the entropy ln 2.

    >>> normals = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])
    >>> angle_entropy(normals, np.array([[1, 2], [0, 2], [0, 1]])) / np.log(2)
    array([1., 1., 1.])
    """
    cosine = np.einsum("nki,ni->nk", normals[near], normals)
    # The arc cosine loses half the digits near 1; the half angle's sine does not.
    chord = np.linalg.norm(normals[near] - normals[:, None], axis=2)
    angle = np.where(
        cosine > 0.9, 2 * np.arcsin(chord / 2 * (chord < 2)), np.arccos(cosine.clip(-1, 1))
    )
    angle[angle < _NO_ANGLE] = 0.0
    total = angle.sum(axis=1, keepdims=True)
    share = np.divide(angle, total, out=np.zeros_like(angle), where=total > 0)
    logarithm = np.log(share, out=np.zeros_like(share), where=share > 0)
    entropy: FloatArray = -(share * logarithm).sum(axis=1)
    return entropy
