"""The order in which a Hilbert curve visits points: near in the order is near in space."""

from __future__ import annotations

import numpy as np

from .threads import run_all, slices
from .validation import FloatArray, IntArray, check_points

# 2^21 cells an axis fill the 63 bits that an int64 key has.
_BITS = 21
# Points a thread takes at a time: its arrays stay in a core's cache.
_CHUNK = 16384


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

    def keys(part: slice) -> IntArray:
        cells = ((points[part] - low) * ((1 << _BITS) / extent)).astype(np.int64)
        np.minimum(cells, (1 << _BITS) - 1, out=cells)
        return _key(cells)

    key = np.concatenate(run_all(keys, slices(len(points), _CHUNK)))
    return np.argsort(key, kind="stable")


def _key(cells: IntArray) -> IntArray:
    """Return the position on the Hilbert curve of each cell (N, 3) of a 2^21 cube."""
    x = [cells[:, axis].copy() for axis in range(3)]
    bit = 1 << (_BITS - 1)
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
    bit = 1 << (_BITS - 1)
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
