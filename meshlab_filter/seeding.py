"""Where the centroids of a clustering start."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .errors import InvalidParameterError
from .validation import FloatArray, IntArray, check_choice, check_points

INITS = ("random", "k-means++", "spread")
# 2^21 cells an axis fill the 63 bits that an int64 key has.
_HILBERT_BITS = 21


def start_centroids(
    points: FloatArray,
    n_clusters: int,
    *,
    init: str | npt.ArrayLike,
    offset: FloatArray,
    seed: int,
) -> FloatArray:
    """Return the centroids k-means starts from.

    Parameters
    ----------
    points : numpy.ndarray, shape (N, 3)
        Centred points.
    n_clusters : int
        How many centroids, 1 … N.
    init : {"random", "k-means++", "spread"} or array_like of shape (c, 3)
        As in :func:`meshlab_filter.clustering.kmeans`.
    offset : numpy.ndarray, shape (3,)
        What was taken from the points, and is to be taken from centroids that are given.
    seed : int
        Seed of the random starts; "spread" and given centroids do not use it.

    Returns
    -------
    numpy.ndarray, shape (n_clusters, 3), float64

    Raises
    ------
    InvalidParameterError
        If the start is unknown or has the wrong number of centroids.
    """
    if not isinstance(init, str):
        given = check_points(init, name="start centroids")
        if len(given) != n_clusters:
            raise InvalidParameterError(
                f"Invalid init. Must have one row for each of {n_clusters} clusters. "
                f"Given: {len(given)} rows."
            )
        return given - offset
    init = check_choice(init, name="init", choices=INITS)
    rng = np.random.default_rng(seed)
    if init == "random":
        return points[np.sort(rng.choice(len(points), n_clusters, replace=False))]
    if init == "k-means++":
        return points[_plus_plus(points, n_clusters, rng)]
    return _run_means(points, n_clusters)


def hilbert_order(points: FloatArray) -> IntArray:
    """Return the order in which a Hilbert curve visits the points.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit; the curve fills the smallest axis-aligned cube around them.

    Returns
    -------
    numpy.ndarray, shape (N,), int64
        Indices; points next to each other in it are near each other in space. Points in the same
        cell, 2^-21 of the cube's edge wide, keep their order.

    Notes
    -----
    J. Skilling, "Programming the Hilbert curve", AIP Conference Proceedings 707, 2004.

    Examples
    --------
    >>> import numpy as np
    >>> hilbert_order(np.array([[0.0, 0, 0], [1, 1, 1], [0, 0, 0.1], [1, 1, 0.9]])).tolist()
    [0, 2, 3, 1]
    """
    points = check_points(points)
    low = points.min(axis=0)
    extent = float((points.max(axis=0) - low).max())
    if extent == 0:
        return np.arange(len(points))
    cells = ((points - low) * ((1 << _HILBERT_BITS) / extent)).astype(np.int64)
    np.minimum(cells, (1 << _HILBERT_BITS) - 1, out=cells)
    return np.argsort(_hilbert_key(cells), kind="stable")


def _hilbert_key(cells: IntArray) -> IntArray:
    """Return the position on the Hilbert curve of each cell (N, 3) of a 2^21 cube."""
    x = [cells[:, axis].copy() for axis in range(3)]
    bit = 1 << (_HILBERT_BITS - 1)
    while bit > 1:
        low_bits = bit - 1
        for axis in range(3):
            # Where the bit is set the low bits of the first axis are inverted; elsewhere they
            # are exchanged with those of this axis.
            upper = (x[axis] & bit) != 0
            swap = np.where(upper, 0, (x[0] ^ x[axis]) & low_bits)
            x[0] ^= np.where(upper, low_bits, swap)
            if axis:
                x[axis] ^= swap
        bit >>= 1
    x[1] ^= x[0]
    x[2] ^= x[1]
    gray = np.zeros_like(x[0])
    bit = 1 << (_HILBERT_BITS - 1)
    while bit > 1:
        gray ^= np.where((x[2] & bit) != 0, bit - 1, 0)
        bit >>= 1
    key = np.zeros_like(x[0])
    for axis in range(3):
        key |= _spread_bits(x[axis] ^ gray) << (2 - axis)
    return key


def _spread_bits(values: IntArray) -> IntArray:
    """Return values of 21 bits with two zero bits between neighbouring bits."""
    spread = values & 0x1FFFFF
    for shift, mask in (
        (32, 0x001F00000000FFFF),
        (16, 0x001F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        spread = (spread | (spread << shift)) & mask
    return spread


def _run_means(points: FloatArray, n_clusters: int) -> FloatArray:
    """Return the means of ``n_clusters`` runs of equal length along the Hilbert curve."""
    along = points[hilbert_order(points)]
    starts = np.arange(n_clusters, dtype=np.int64) * len(points) // n_clusters
    lengths = np.diff(starts, append=len(points))
    return np.asarray(np.add.reduceat(along, starts, axis=0) / lengths[:, None])


def _plus_plus(points: FloatArray, n_clusters: int, rng: np.random.Generator) -> IntArray:
    """Return the indices of centroids drawn by k-means++.

    The points lie in blocks along a Hilbert curve. A new centroid can only change the squared
    distances in blocks whose box is nearer to it than the largest of them, so a draw costs about
    the number of blocks rather than the number of points.
    """
    n = len(points)
    order = hilbert_order(points)
    along = points[order]
    size = max(16, round(np.sqrt(n) / 4))
    starts = np.arange(0, n, size)
    low = np.minimum.reduceat(along, starts, axis=0)
    high = np.maximum.reduceat(along, starts, axis=0)
    squared = np.full(n, np.inf)
    largest = np.full(len(starts), np.inf)
    totals = np.zeros(len(starts))
    chosen = np.empty(n_clusters, dtype=np.int64)
    offsets = np.arange(size)
    pick = int(rng.integers(n))
    for draw in range(n_clusters):
        chosen[draw] = pick
        centre = along[pick]
        gap = np.maximum(low - centre, 0) + np.maximum(centre - high, 0)
        near = np.flatnonzero((gap * gap).sum(axis=1) < largest)
        rows = np.minimum(starts[near, None] + offsets, n - 1)
        reached = np.minimum(squared[rows], ((along[rows] - centre) ** 2).sum(axis=2))
        squared[rows] = reached
        largest[near] = reached.max(axis=1)
        # The last block is padded with its last point, which must not weigh more than once.
        totals[near] = np.where(starts[near, None] + offsets < n, reached, 0).sum(axis=1)
        cumulated = np.cumsum(totals)
        if cumulated[-1] == 0:
            # Every point lies on a centroid: k-means finds out what that means for its clusters.
            rest = np.setdiff1d(np.arange(n), chosen[: draw + 1])
            chosen[draw + 1 :] = rest[: n_clusters - draw - 1]
            break
        pick = _draw(squared, cumulated, float(rng.random()), size)
    return np.asarray(order[chosen])


def _draw(squared: FloatArray, cumulated: FloatArray, uniform: float, size: int) -> int:
    """Return the point at a share of the summed squared distances, found block by block."""
    target = uniform * cumulated[-1]
    block = min(int(np.searchsorted(cumulated, target, side="right")), len(cumulated) - 1)
    inside = np.cumsum(squared[block * size : (block + 1) * size])
    rest = target - (cumulated[block - 1] if block else 0.0)
    # Rounding may put the share at or beyond the end of the block: its last point of weight.
    within = np.searchsorted(inside, min(rest, np.nextafter(inside[-1], 0)), side="right")
    return block * size + int(within)
