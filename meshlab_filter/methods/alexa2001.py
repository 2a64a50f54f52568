"""Alexa et al.: take away the point nearest its projection on the surface of the others."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..validation import FloatArray, IntArray
from .ranking import Ranking
from .rounds import Information, rank_in_rounds

_CHUNK = 20_000  # points fitted at a time


def rank(
    points: npt.ArrayLike,
    *,
    normals: npt.ArrayLike | None = None,
    count: int | None = None,
    seed: int = 0,
    neighbors: int = 15,
) -> Ranking:
    """Rank points by when they are nearest the moving least squares surface of the others.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    normals : array_like, optional
        Taken for the sake of the common interface; the surface has its own.
    count : int, optional
        Points to keep, met exactly; without it every point is ranked and none is cut.
    seed : int
        Of the random order among points at equal distances.
    neighbors : int
        Nearest neighbours that a point's surface is fitted to, at least 6.

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

    Notes
    -----
    Source: M. Alexa, J. Behr, D. Cohen-Or, S. Fleishman, D. Levin and C. T. Silva, "Point set
    surfaces", IEEE Visualization 2001, pp. 21-28, doi:10.1109/VISUAL.2001.964489, section on
    down-sampling. Chosen here: the reference plane is the weighted least squares plane of the
    neighbours, the polynomial over it is quadratic (theirs cubic or quartic), the Gaussian's h is
    the root mean square distance of the neighbours, and points go in rounds
    (:func:`meshlab_filter.methods.rounds.remove_in_rounds`).

    Examples
    --------
    A lone bump on a plane stays to the last.

    >>> points = np.mgrid[0:7, 0:7, 0:1].reshape(3, -1).T + 0.0
    >>> points[24, 2] = 0.8
    >>> 24 in rank(points, count=10).indices
    True
    """

    def prepare(cloud: FloatArray) -> Information:
        def information(left: IntArray, near: IntArray) -> FloatArray:
            position = cloud[left]
            blocks = (slice(i, i + _CHUNK) for i in range(0, len(left), _CHUNK))
            return np.concatenate(
                [
                    surface_distance(position[near[block]] - position[block, None])
                    for block in blocks
                ]
            )

        return information

    return rank_in_rounds(points, prepare, neighbors=neighbors, fewest=6, count=count, seed=seed)


def surface_distance(offset: FloatArray) -> FloatArray:
    """Return the distance of points to the surface of their neighbours, without themselves.

    Parameters
    ----------
    offset : numpy.ndarray, shape (n, k, 3)
        The neighbours of each point, from the point.

    Returns
    -------
    numpy.ndarray, shape (n,), float64
        In the unit of the points, along the normal of the reference plane.

    Examples
    --------
    Eight neighbours in a plane 0.5 above the point:

    >>> ring = np.radians(np.arange(0, 360, 45))
    >>> offset = np.stack([np.cos(ring), np.sin(ring), 0.5 + 0 * ring], axis=1)
    >>> surface_distance(offset[None])
    array([0.5])
    """
    square = np.einsum("nki,nki->nk", offset, offset)
    spread = square.mean(axis=1, keepdims=True)
    weight = np.exp(-square / np.where(spread > 0, spread, 1.0))
    weight = weight / weight.sum(axis=1, keepdims=True)
    centre = np.einsum("nk,nki->ni", weight, offset)
    local = offset - centre[:, None]
    frame = np.linalg.eigh(np.einsum("nk,nki,nkj->nij", weight, local, local))[1]
    scale = np.sqrt(np.where(spread > 0, spread, 1.0))[:, :, None]
    seen = local @ frame / scale  # height over the plane first, then the plane
    height, v, u = seen[..., 0], seen[..., 1], seen[..., 2]
    basis = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=2)
    normal = np.einsum("nk,nki,nkj->nij", weight, basis, basis)
    # Neighbours on a line leave the quadratic open; this picks a small one.
    normal += 1e-9 * np.eye(6)
    right = np.einsum("nk,nki,nk->ni", weight, basis, height)
    fit = np.linalg.solve(normal, right[:, :, None])[:, :, 0]
    own = -np.einsum("ni,nij->nj", centre, frame) / scale[:, 0]
    at = np.stack(
        [
            np.ones(len(own)),
            own[:, 2],
            own[:, 1],
            own[:, 2] ** 2,
            own[:, 1] * own[:, 2],
            own[:, 1] ** 2,
        ],
        axis=1,
    )
    distance: FloatArray = np.abs((at * fit).sum(axis=1) - own[:, 0]) * scale[:, 0, 0]
    return distance
