"""The nearest neighbours of each point among those that are left, while points are taken away."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .validation import FloatArray, IntArray

# Neighbours searched ahead: a point is searched for again only once all but k of these are gone.
_AHEAD = 16
# Points searched for at a time: a search needs far more memory than the lists it fills.
_BLOCK = 1 << 15


class Neighbourhood:
    """The k nearest alive neighbours of every alive point, kept up to date.

    Parameters
    ----------
    points : numpy.ndarray, shape (N, 3)
        Coordinates. Faster where points near each other in space are so in memory.
    k : int
        How many neighbours; N must exceed it.

    Attributes
    ----------
    nearest : numpy.ndarray, shape (N, k), int32
        Indices, nearest first, never the point itself; stale in rows of removed points.
    alive : numpy.ndarray, shape (N,), bool
    """

    def __init__(self, points: FloatArray, k: int) -> None:
        self.points = points
        self.k = k
        self.alive = np.ones(len(points), dtype=bool)
        self._ahead = np.empty((len(points), max(_AHEAD, k)), dtype=np.int32)
        self.nearest = np.empty((len(points), k), dtype=np.int32)
        self._search(np.arange(len(points)))

    def remove(self, gone: IntArray) -> IntArray:
        """Take points away; return the alive points whose neighbours changed, ascending.

        At least k + 1 points must stay.
        """
        self.alive[gone] = False
        rows = np.flatnonzero(self.alive)
        rows = rows[~self.alive[self.nearest[rows]].all(axis=1)]
        there = self._left(rows)
        enough = there.sum(axis=1) >= self.k
        known = rows[enough]
        order = np.argsort(~there[enough], axis=1, kind="stable")[:, : self.k]
        self.nearest[known] = np.take_along_axis(self._ahead[known], order, axis=1)
        self._search(rows[~enough])
        return rows

    def _left(self, rows: IntArray) -> npt.NDArray[np.bool_]:
        ahead = self._ahead[rows]
        return (ahead >= 0) & self.alive[ahead]

    def _search(self, rows: IntArray) -> None:
        from scipy.spatial import cKDTree

        if not len(rows):
            return
        left = np.flatnonzero(self.alive).astype(np.int32)
        width = min(self._ahead.shape[1], len(left) - 1)
        tree = cKDTree(self.points[left], compact_nodes=False, balanced_tree=False)
        for start in range(0, len(rows), _BLOCK):
            block = rows[start : start + _BLOCK]
            _, found = tree.query(self.points[block], k=width + 1, workers=-1)
            found = left[found]
            # A point comes first in its own list, but for duplicates, where it may come anywhere
            # or not at all: then the last is dropped.
            other = found != block[:, None]
            other[other.all(axis=1), -1] = False
            found = found[other].reshape(len(block), width)
            self._ahead[block, :width] = found
            self._ahead[block, width:] = -1
            self.nearest[block] = found[:, : self.k]
