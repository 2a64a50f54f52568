"""Decimation in rounds: the points whose loss moves the surface least go first.

The idea, to take away again and again the point that tells least, is that of L. Linsen, "Point
cloud representation", 2001, and of M. Alexa et al., "Point set surfaces", IEEE Visualization 2001.
What a point tells is here the rise in squared error of all *original* points that its removal
causes.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

from ..neighbourhood import Neighbourhood
from ..noise import suggest_noisy
from ..normals import estimate_normals, smooth_to_tangent_planes, unit_normals
from ..validation import (
    FloatArray,
    IntArray,
    check_integer,
    check_number,
    check_points,
    check_switch,
)
from ..witnesses import Witnesses
from .ranking import Ranking

_NEIGHBOURS = 8
# Witnesses estimated at a time: their arrays stay in a core's cache.
_CHUNK = 512
# Points whose spacing is measured at a time, for the same reason.
_BLOCK = 8192
# The points of a round: among the lowest fifth of the costs, and at most a tenth of what is left.
_CANDIDATES = 5
_LARGEST_ROUND = 10
# Costs within a tenth of an e-fold count as equal and go in random order: removals spread.
_STEPS_PER_E_FOLD = 10.0
# Mean curvature (1 / RMS radius of the cloud) under which a cloud counts as flat: there the errors
# are rounding noise and evenness alone must decide.
_LEAST_CURVATURE = 1e-4


def rank(
    points: npt.ArrayLike,
    *,
    normals: npt.ArrayLike | None = None,
    count: int | None = None,
    evenness: float = 0.4,
    crease_safety: float = 0.4,
    noisy: bool = False,
    seed: int = 0,
    progress: Callable[[float], object] | None = None,
) -> Ranking:
    """Rank every point by when the decimation takes it away: ``rank >= N - M`` keeps the best M.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    normals : array_like, shape (N, 3), optional
        Normals of any length and sign; estimated from 12 neighbours where not given.
    count : int, optional
        Stop once exactly this many points are left. The points removed until then have the
        same ranks as without it.
    evenness : float
        How much an even spacing counts against a small error, at least 0: 0 spends the points
        only where the shape bends, 2 comes near an evenly spaced cloud.
    crease_safety : float
        How much is made of neighbours that lie off a point's tangent plane, at least 0: a higher
        value keeps more points along sharp edges and between close sheets.
    noisy : bool
        Judge the points by where the smoothed cloud has them (projected to the tangent plane of
        their neighbours). The points kept are the original ones all the same.
        :func:`~meshlab_filter.noise.suggest_noisy` says when it pays.
    seed : int
        Seed of the random order among points of equal cost.
    progress : callable, optional
        Called with the share of the work that is done, from 0 to 1.

    Returns
    -------
    Ranking
        ``rank`` is a permutation of 0 … N − 1; ``threshold`` is N − count, or 0 without a count.
        ``info`` says how many rounds it took, whether the normals were estimated, how noisy the
        cloud is and whether ``noisy`` may pay.

    Raises
    ------
    InvalidCloudError
        If the points or normals are not usable.
    InvalidParameterError
        If the count is not in 1 … N or another parameter is out of range.

    Notes
    -----
    Every original point x is a witness of one point that is left, its owner o. In each round

    - e(x) is the distance of x to the local Delaunay triangle of o's 8 nearest neighbours, o
      itself left out (:class:`~meshlab_filter.witnesses.Witnesses`), plus ``crease_safety`` times
      the mean height of these neighbours over the tangent plane of x;
    - the cost of o is the sum over its witnesses of (e(x) + ``evenness`` · κ · r²(o))² − g²(x),
      with r² the mean squared distance of o to its neighbours, κ the mean of e over that of r²
      over all points left, and g(x) the distance alone when x last lost its owner, zero before;
    - points cheaper than all their neighbours go, at most a tenth of what is left, and their
      witnesses pass to the nearest neighbour.

    Normals span tangent planes only, so that their signs have no effect. Time is near
    proportional to N, memory some 300 bytes a point. The result does not depend on the number of
    cores and, but for ties in rounding, on scale, place and rotation of the cloud.

    Examples
    --------
    >>> import numpy as np
    >>> u = np.linspace(-1, 1, 21)
    >>> x, y = (a.ravel() for a in np.meshgrid(u, u))
    >>> roof = np.column_stack([x, y, -abs(x)])
    >>> kept = roof[rank(roof, count=50).indices]
    >>> kept.shape
    (50, 3)

    The ridge is a twentieth of the points and more of what is kept:

    >>> bool((kept[:, 0] == 0).mean() > 0.1)
    True
    """
    cloud = check_points(points)
    size = len(cloud)
    left = size if count is None else check_integer(count, name="count", minimum=1, maximum=size)
    stop = 0 if count is None else left
    evenness = check_number(evenness, name="evenness", minimum=0)
    crease_safety = check_number(crease_safety, name="crease_safety", minimum=0)
    noisy = check_switch(noisy, name="noisy")
    seed = check_integer(seed, name="seed", minimum=0)

    order = _near_in_memory(cloud)
    local = _centred(cloud)[order]
    if normals is None:
        directions = estimate_normals(local, orient=False)
    else:
        directions = unit_normals(normals, local[np.argsort(order)])[order]
    suggested, level = suggest_noisy(local, directions)
    if noisy:
        local = smooth_to_tangent_planes(local, directions)
    lottery = np.random.default_rng(seed).permutation(size)[order]
    decimation = _Decimation(local, directions, evenness, crease_safety, lottery)
    removed = decimation.run(stop, progress or (lambda done: None))
    ranks = np.empty(size, dtype=np.int64)
    ranks[order[removed]] = np.arange(size)
    return Ranking(
        rank=ranks,
        threshold=0 if count is None else size - left,
        info={
            "rounds": decimation.rounds,
            "normals_estimated": normals is None,
            "noise_level": level,
            "noisy_suggested": suggested and not noisy,
        },
    )


class _Decimation:
    """One run: all arrays are in an order that keeps neighbours in space close in memory."""

    def __init__(
        self,
        points: FloatArray,
        normals: FloatArray,
        evenness: float,
        crease_safety: float,
        lottery: IntArray,
    ) -> None:
        self.points = points
        self.columns = np.ascontiguousarray(points.T)
        self.directions = np.ascontiguousarray(normals.T)
        self.evenness = evenness
        self.crease_safety = crease_safety
        self.lottery = lottery
        self.rounds = 0

    def run(self, stop: int, progress: Callable[[float], object]) -> IntArray:
        """All points in the order they go; the last ``stop`` of them are the ones that stay."""
        size = left = len(self.points)
        least = max(stop, _NEIGHBOURS + 1)
        gone = [np.empty(0, dtype=np.int64)]
        with ThreadPoolExecutor(os.cpu_count()) as self.pool:
            if left > _NEIGHBOURS + 1:
                self._begin()
            while left > least:
                victims = self._victims()[: left - least]
                self._take(victims)
                gone.append(victims)
                left -= len(victims)
                self.rounds += 1
                progress((size - left) / max(size - stop, 1))
            if stop > _NEIGHBOURS + 1:
                survivors = np.flatnonzero(self.alive)
                gone.append(survivors[np.argsort(self._queue()[survivors])])
            else:
                survivors = np.setdiff1d(np.arange(size), np.concatenate(gone))
                gone.append(self._handful(survivors))
        progress(1.0)
        return np.concatenate(gone)

    def _begin(self) -> None:
        size = len(self.points)
        self.hood = Neighbourhood(self.points, _NEIGHBOURS)
        self.alive = self.hood.alive
        self.witnesses = Witnesses(_NEIGHBOURS)
        self.owner = np.arange(size)
        self.gap = np.empty(size)
        self.error = np.empty(size)
        self.before2 = np.zeros(size)
        self.spacing2 = np.empty(size)
        self.stale = np.ones(size, dtype=bool)
        self._measure_spacing(np.arange(size))
        self._measure_errors(self.stale)

    def _measure_spacing(self, rows: IntArray) -> None:
        def measure(start: int) -> None:
            block = rows[start : start + _BLOCK]
            d = self.points[self.hood.nearest[block]] - self.points[block, None, :]
            self.spacing2[block] = np.einsum("ijk,ijk->i", d, d) / _NEIGHBOURS

        for _ in self.pool.map(measure, range(0, len(rows), _BLOCK)):
            pass

    def _measure_errors(self, owners: npt.NDArray[np.bool_]) -> None:
        """Estimate the error of the witnesses of these owners, in chunks over all cores."""
        rows = np.flatnonzero(owners[self.owner])

        def measure(start: int) -> None:
            x = rows[start : start + _CHUNK]
            owner = self.owner[x]
            gap, crease = self.witnesses.errors(
                self.columns[:, x],
                self.directions[:, x],
                self.columns[:, self.hood.nearest[owner].T],
                self.spacing2[owner],
            )
            self.gap[x] = gap
            self.error[x] = gap + self.crease_safety * crease

        for _ in self.pool.map(measure, range(0, len(rows), _CHUNK)):
            pass
        self.stale[owners] = False

    def _queue(self) -> IntArray:
        """Queue up: a number for each point, lower for lower cost, the highest for removed ones."""
        alive = self.alive
        curvature = self.error[alive].mean() / max(self.spacing2[alive].mean(), _TINY)
        bow = self.evenness * max(curvature, _LEAST_CURVATURE) * self.spacing2
        rise = self.error + bow[self.owner]
        rise *= rise
        rise -= self.before2
        cost = np.bincount(self.owner, weights=rise, minlength=len(alive))[alive]
        step = np.floor(_STEPS_PER_E_FOLD * np.log(np.maximum(cost, _TINY)))
        queue = np.full(len(alive), np.iinfo(np.int64).max)
        queue[alive] = step.astype(np.int64) * len(alive) + self.lottery[alive]
        return queue

    def _victims(self) -> IntArray:
        """Points cheaper than all their neighbours, both ways, cheapest first.

        Estimates are renewed only for the candidates: a point whose neighbours have gone is
        hardly ever cheaper than it was, so that the others are no candidates either way.
        """
        left = int(self.alive.sum())
        last = -(-left // _CANDIDATES)
        while True:
            queue = self._queue()
            among = queue <= np.partition(queue, last - 1)[last - 1]
            self._measure_errors(self.stale & among)
            queue = self._queue()
            candidates = np.flatnonzero(queue <= np.partition(queue, last - 1)[last - 1])
            neighbours = self.hood.nearest[candidates]
            mine, theirs = queue[candidates, None], queue[neighbours]
            free = ~self.stale
            free[candidates[(theirs < mine).any(axis=1)]] = False
            free[neighbours[theirs > mine]] = False
            chosen = candidates[free[candidates]]
            if len(chosen):
                chosen = chosen[np.argsort(queue[chosen])]
                return chosen[: max(left // _LARGEST_ROUND, 1)]

    def _take(self, victims: IntArray) -> None:
        """Remove points; their witnesses pass to the nearest of the neighbours."""
        dying = np.zeros(len(self.points), dtype=bool)
        dying[victims] = True
        orphans = np.flatnonzero(dying[self.owner])
        heirs = self.hood.nearest[self.owner[orphans]]
        d = self.points[heirs] - self.points[orphans, None, :]
        nearest = np.einsum("ijk,ijk->ij", d, d).argmin(axis=1)
        self.before2[orphans] = self.gap[orphans] ** 2
        self.owner[orphans] = heirs[np.arange(len(orphans)), nearest]
        changed = self.hood.remove(victims)
        self._measure_spacing(changed)
        self.stale[changed] = True
        self.stale[self.owner[orphans]] = True
        self.stale[victims] = False

    def _handful(self, rows: IntArray) -> IntArray:
        """Order the last few: always the one nearest to another goes, so the far ones stay."""
        rows = rows[np.argsort(self.lottery[rows])]
        order = []
        while len(rows) > 1:
            p = self.points[rows]
            distance = np.linalg.norm(p[:, None] - p[None], axis=2)
            np.fill_diagonal(distance, np.inf)
            first = int(distance.min(axis=1).argmin())
            order.append(rows[first])
            rows = np.delete(rows, first)
        return np.array([*order, *rows], dtype=np.int64)


_TINY = float(np.finfo(float).tiny)


def _near_in_memory(points: FloatArray) -> IntArray:
    """Order the points so that neighbours in space are mostly neighbours in memory."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(points).indices, dtype=np.int64)


def _centred(points: FloatArray) -> FloatArray:
    """Move the centroid to the origin and scale the RMS radius to one."""
    local = points - points.mean(axis=0)
    radius = np.sqrt((local * local).sum(axis=1).mean())
    return np.asarray(local / radius if radius > 0 else local)
