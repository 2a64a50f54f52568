"""Points grouped by label: sums over groups, and distances to neighbours inside them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .threads import run_all
from .validation import FloatArray, IntArray

# Groups up to this size compare all pairs of their points; larger ones ask a kd-tree.
_PAIRWISE_LIMIT = 128
# Squared distances one thread holds at once: 2^17 doubles are 1 MB and stay in its cache.
_CHUNK_PAIRS = 1 << 17


@dataclass(frozen=True)
class Groups:
    """Rows with the same label, one after the other ("group order").

    Attributes
    ----------
    order : numpy.ndarray, shape (N,), int64
        Rows by label; within a label in ascending order.
    starts : numpy.ndarray, shape (C,), int64
        Where each group begins in ``order``.
    counts : numpy.ndarray, shape (C,), int64
        Rows of each group; 0 for a label that nobody has.
    """

    order: IntArray
    starts: IntArray
    counts: IntArray

    @classmethod
    def of(cls, labels: IntArray) -> Groups:
        """Group the rows 0 … N − 1 by their labels, which are 0 or greater.

        Examples
        --------
        >>> groups = Groups.of(np.array([1, 0, 1]))
        >>> groups.order.tolist(), groups.starts.tolist(), groups.counts.tolist()
        ([1, 0, 2], [0, 1], [1, 2])
        """
        counts = np.bincount(labels)
        starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
        return cls(np.argsort(labels, kind="stable"), starts, counts)

    def spread(self, per_group: FloatArray) -> FloatArray:
        """Give every row, in group order, the value of its group."""
        return np.repeat(per_group, self.counts)

    def total(self, per_row: FloatArray) -> FloatArray:
        """Sum the values of rows, in group order, over each group; 0 where it has no row."""
        return self._reduce(np.add, per_row, 0.0)

    def minimum(self, per_row: FloatArray) -> FloatArray:
        """Return the least value of each group, values in group order; infinite without rows."""
        return self._reduce(np.minimum, per_row, np.inf)

    def _reduce(self, operation: np.ufunc, per_row: FloatArray, empty: float) -> FloatArray:
        reduced = np.full(len(self.counts), empty)
        filled = self.counts > 0
        reduced[filled] = operation.reduceat(per_row, self.starts[filled])
        return reduced


def kth_distances(points: FloatArray, groups: Groups, ks: IntArray) -> FloatArray:
    """Return the distance from each point to its k-th nearest neighbour in its own group.

    Parameters
    ----------
    points : numpy.ndarray, shape (N, 3)
        Coordinates.
    groups : Groups
        The groups of the rows.
    ks : numpy.ndarray, shape (C,), int64
        The k of each group, at most its number of points less one.

    Returns
    -------
    numpy.ndarray, shape (N,), float64
        In group order; NaN where k is 0.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0], [9, 0, 0]])
    >>> kth_distances(points, Groups.of(np.array([0, 0, 0, 1])), np.array([1, 0])).tolist()
    [1.0, 1.0, 2.0, nan]
    """
    distances = np.full(len(points), np.nan)
    sorted_points = points[groups.order]

    def fill(task: tuple[int, int, IntArray]) -> None:
        size, k, starts = task
        rows = starts[:, None] + np.arange(size)
        squared = np.zeros((len(starts), size, size))
        for axis in range(3):
            coordinate = sorted_points[:, axis][rows]
            difference = coordinate[:, :, None] - coordinate[:, None, :]
            difference *= difference
            squared += difference
        # The point itself is the nearest, so the k-th neighbour stands at place k.
        squared.partition(k, axis=2)
        distances[rows] = np.sqrt(squared[:, :, k])

    # Each task writes rows of its own: the result does not depend on their order or number.
    run_all(fill, _pairwise_tasks(groups, ks))
    _fill_large(sorted_points, groups, ks, distances)
    return distances


def _pairwise_tasks(groups: Groups, ks: IntArray) -> Iterator[tuple[int, int, IntArray]]:
    """Yield (size, k, starts of some groups of this size and k), each a bounded piece of work."""
    small = np.flatnonzero((ks > 0) & (groups.counts <= _PAIRWISE_LIMIT))
    # k is less than the size, so one number tells both.
    kinds = groups.counts[small] * _PAIRWISE_LIMIT + ks[small]
    by_kind = np.argsort(kinds, kind="stable")
    starts = groups.starts[small[by_kind]]
    for kind, first, count in zip(
        *np.unique(kinds[by_kind], return_index=True, return_counts=True)
    ):
        size, k = divmod(int(kind), _PAIRWISE_LIMIT)
        step = max(1, _CHUNK_PAIRS // size**2)
        for begin in range(first, first + count, step):
            yield size, k, starts[begin : min(begin + step, first + count)]


def _fill_large(
    sorted_points: FloatArray, groups: Groups, ks: IntArray, distances: FloatArray
) -> None:
    """Fill in the distances of groups too large to compare all pairs of their points."""
    from scipy.spatial import cKDTree

    large = np.flatnonzero((ks > 0) & (groups.counts > _PAIRWISE_LIMIT))
    if not len(large):
        return
    group = np.repeat(large, groups.counts[large])
    within = np.arange(len(group)) - np.repeat(
        np.cumsum(groups.counts[large]) - groups.counts[large], groups.counts[large]
    )
    rows = groups.starts[group] + within
    points = sorted_points[rows]
    # One tree for all: a fourth coordinate puts the groups farther apart than the cloud is wide,
    # and adds an exact 0 to distances inside a group.
    apart = 2 * float(np.linalg.norm(np.ptp(points, axis=0))) + 1.0
    lifted = np.column_stack([points, group * apart])
    tree = cKDTree(lifted)
    row_ks = ks[group]
    for k in np.unique(row_ks):
        mine = np.flatnonzero(row_ks == k)
        distances[rows[mine]] = tree.query(lifted[mine], k=[int(k) + 1], workers=-1)[0][:, 0]
