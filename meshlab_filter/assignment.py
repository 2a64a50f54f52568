"""The nearest centroid of every point, kept up to date while the centroids move."""

from __future__ import annotations

import numpy as np

from .threads import run_all, slices
from .validation import FloatArray, IntArray

# Nearest centroids each centroid knows. On a surface twelve are about the two rings around it.
_NEIGHBOURS = 12
# The lists of neighbours are made anew once half of the centroids have together moved this share
# of the distance to their farthest neighbour.
_STALE = 0.15
# Points a thread takes at a time: its arrays stay in a core's cache.
_CHUNK = 8192


class Assignment:
    """Labels of points by their nearest centroid, with bounds that say who need not ask again.

    A point keeps an upper bound on the distance to its own centroid and a lower bound on the
    distance to any other. When the centroids move, the bounds give way by as much as the point's
    centroid and that centroid's neighbours moved; only where they meet are distances computed, to
    the neighbours first, and from a kd-tree of all centroids where those cannot decide. The labels
    are exactly those of comparing every point with every centroid.

    Parameters
    ----------
    points : numpy.ndarray, shape (N, 3)
        Fastest when points next to each other in the array are near each other in space.
    centroids : numpy.ndarray, shape (c, 3)
        In the unit of the points.
    guess : numpy.ndarray, shape (N,), int64, optional
        Centroids that are probably near the points; spares a search for those where it is so.

    Attributes
    ----------
    labels : numpy.ndarray, shape (N,), int64
        The nearest centroid of each point.
    centroids : numpy.ndarray, shape (c, 3)
        As last moved.

    Notes
    -----
    G. Hamerly, "Making k-means even faster", SIAM International Conference on Data Mining 2010,
    has the two bounds but lets all of them give way by the largest movement of all centroids;
    C. Elkan, "Using the triangle inequality to accelerate k-means", ICML 2003, has one bound for
    each pair. Lists of neighbours keep the memory of the first and most of the thrift of the
    second.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [4, 0, 0]])
    >>> assignment = Assignment(points, points[[0, 2]])
    >>> assignment.labels.tolist()
    [0, 0, 1]
    >>> assignment.move(np.array([[-3.0, 0, 0], [3, 0, 0]]))
    1
    >>> assignment.labels.tolist(), assignment.distances().tolist()
    ([0, 1, 1], [3.0, 2.0, 1.0])
    """

    def __init__(
        self, points: FloatArray, centroids: FloatArray, guess: IntArray | None = None
    ) -> None:
        self._points = points
        self.centroids = centroids
        n, c = len(points), len(centroids)
        self._shift = self._neighbour_shift = self._drift = np.zeros(c)
        self._find_neighbours()
        if guess is None:
            self.labels = np.zeros(n, dtype=np.int64)
            self._upper, self._lower = np.empty(n), np.empty(n)
            self._ask_tree(np.arange(n))
        else:
            self.labels = guess.astype(np.int64)
            self._upper, self._lower = np.zeros(n), np.full(n, -np.inf)
            self._update()

    def move(self, centroids: FloatArray) -> int:
        """Take new positions of the centroids and return how many labels that changed."""
        self._shift = np.sqrt(((centroids - self.centroids) ** 2).sum(axis=1))
        self.centroids = centroids
        self._drift = self._drift + self._shift
        if np.mean(self._drift + self._drift.max() > _STALE * self._reach) > 0.5:
            self._find_neighbours()
        others = self._neighbours != np.arange(len(centroids))[:, None]
        self._neighbour_shift = (self._shift[self._neighbours] * others).max(axis=1)
        return self._update()

    def distances(self) -> FloatArray:
        """Return the distance of each point to its centroid: shape (N,)."""
        parts = slices(len(self._points), _CHUNK)
        return np.concatenate(
            run_all(lambda part: self._own(self._points[part], self.labels[part]), parts)
        )

    def _own(self, points: FloatArray, labels: IntArray) -> FloatArray:
        difference = points - self.centroids[labels]
        difference *= difference
        return np.asarray(np.sqrt(difference.sum(axis=1)))

    def _find_neighbours(self) -> None:
        from scipy.spatial import cKDTree

        c = len(self.centroids)
        size = min(_NEIGHBOURS + 1, c)
        distances, self._neighbours = cKDTree(self.centroids).query(
            self.centroids, k=np.arange(1, size + 1), workers=-1
        )
        # Nobody outside a list is nearer to its centroid than this, less what both moved since.
        self._reach = distances[:, -1] if size < c else np.full(c, np.inf)
        self._drift = np.zeros(c)

    def _update(self) -> int:
        """Loosen the bounds by the last move and settle the points where they meet."""
        unlisted = self._reach - self._drift - self._drift.max()
        settled = run_all(
            lambda part: self._settle(part, unlisted), slices(len(self._points), _CHUNK)
        )
        undecided = np.concatenate([rows for _, rows in settled])
        changed = sum(count for count, _ in settled)
        return changed + (self._ask_tree(undecided) if len(undecided) else 0)

    def _settle(self, part: slice, unlisted: FloatArray) -> tuple[int, IntArray]:
        """Update a piece; return how many labels changed and the rows only the tree can tell."""
        labels, upper, lower = self.labels[part], self._upper[part], self._lower[part]
        upper += self._shift[labels]
        lower -= self._neighbour_shift[labels]
        np.minimum(lower, unlisted[labels] - upper, out=lower)
        rows = np.flatnonzero(upper >= lower)
        own = self._own(self._points[part][rows], labels[rows])
        upper[rows] = own
        meet = own >= lower[rows]
        rows, own = rows[meet], own[meet]

        points, old = self._points[part][rows], labels[rows]
        listed = self._neighbours[old]
        squared = np.zeros(listed.shape)
        for axis in range(3):
            difference = self.centroids[:, axis][listed]
            difference -= points[:, axis, None]
            difference *= difference
            squared += difference
        each = np.arange(len(rows))
        nearest = squared.argmin(axis=1)
        new = listed[each, nearest]
        best = np.sqrt(squared[each, nearest])
        squared[each, nearest] = np.inf
        second = np.sqrt(squared.min(axis=1, initial=np.inf))
        # Triangle inequality: a centroid outside the list is at least this far from the point.
        limit = unlisted[old] - own
        certain = best < limit
        rows, uncertain = rows[certain], rows[~certain]
        labels[rows] = new[certain]
        upper[rows] = best[certain]
        lower[rows] = np.minimum(second, limit)[certain]
        return int((new[certain] != old[certain]).sum()), uncertain + part.start

    def _ask_tree(self, rows: IntArray) -> int:
        """Settle rows by the tree of all centroids; return how many labels changed."""
        from scipy.spatial import cKDTree

        distances, nearest = cKDTree(self.centroids).query(self._points[rows], k=[1, 2], workers=-1)
        changed = int((self.labels[rows] != nearest[:, 0]).sum())
        self.labels[rows] = nearest[:, 0]
        self._upper[rows], self._lower[rows] = distances.T
        return changed
