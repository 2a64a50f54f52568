"""Pauly, Gross and Kobbelt: hierarchical clustering by size and surface variation."""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..validation import FloatArray, IntArray, check_integer, check_number, check_points
from .ranking import Ranking
from .selection import check_count, nearest_in_group, ranking_from_subset

_SIZE = 20  # most points in a region, where neither a size nor a count is given


def rank(
    points: npt.ArrayLike,
    *,
    normals: npt.ArrayLike | None = None,
    count: int | None = None,
    seed: int = 0,
    size: int | None = None,
    variation: float = 1 / 3,
) -> Ranking:
    """Keep one point in each region of a binary partition that follows size and shape.

    A region is split by the plane through its centroid across its longest extent while it has
    more than ``size`` points or its surface variation λ0 / (λ0 + λ1 + λ2), from the eigenvalues of
    the covariance, exceeds ``variation``. Each region leaves the point nearest its centroid.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Coordinates in any unit of length.
    normals : array_like, optional
        Taken for the sake of the common interface; not used.
    count : int, optional
        Points to keep, met exactly: regions above the variation are split first, then the largest,
        of equals the one of greater variation, until there are so many. ``size`` is not used then.
    seed : int
        Taken for the sake of the common interface; the method uses no randomness.
    size : int, optional
        Most points in a region; 20 where it is not given.
    variation : float
        Most surface variation in a region, 0 … 1/3. At 1/3, the largest there is, size decides.

    Returns
    -------
    Ranking
        Rank 1 for the points that stay, 0 for the others; ``labels`` are the regions.

    Raises
    ------
    InvalidCloudError
        If the points are not finite coordinates of shape (N, 3).
    InvalidParameterError
        If a parameter is out of range.

    Notes
    -----
    Source: M. Pauly, M. Gross and L. P. Kobbelt, "Efficient simplification of point-sampled
    surfaces", IEEE Visualization 2002, pp. 163-170, doi:10.1109/VISUAL.2002.1183771, section 3.1.
    There a region leaves its centroid; here the point nearest it, so that the result is a subset.
    The defaults are those of CGAL's ``hierarchy_simplify_point_set``, 1/3 among them. Regions of
    coinciding points are halved by index.

    Examples
    --------
    >>> points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [9, 0, 0], [10, 0, 0], [11, 0, 0]])
    >>> rank(points, size=3).indices
    array([1, 4])
    """
    cloud = check_points(points)
    count = check_count(count, len(cloud))
    check_integer(seed, name="seed", minimum=0)
    most = _SIZE if size is None else check_integer(size, name="size", minimum=1)
    variation = check_number(variation, name="variation", minimum=0.0)
    tree = _split(cloud, 1 if count is not None else most, variation)
    leaves = np.flatnonzero(tree.child < 0) if count is None else _best(tree, variation, count)
    labels = np.empty(len(cloud), dtype=np.int64)
    for number, leaf in enumerate(leaves):
        labels[tree.order[tree.begin[leaf] : tree.end[leaf]]] = number
    away = ((cloud - tree.centroid[leaves][labels]) ** 2).sum(axis=1)
    kept = np.sort(nearest_in_group(labels, away))
    return ranking_from_subset(kept, len(cloud), count=count, labels=labels)


@dataclass(frozen=True)
class _Tree:
    """A binary partition: region i holds the points order[begin[i]:end[i]]."""

    order: IntArray
    begin: IntArray
    end: IntArray
    centroid: FloatArray
    variation: FloatArray
    child: IntArray  # of the first half, the second follows; -1 where the region is whole


def _split(points: FloatArray, size: int, variation: float) -> _Tree:
    """Split all regions of a level at once, until none is too large or too bent."""
    order = np.arange(len(points))
    begin, end = np.array([0]), np.array([len(points)])
    levels: list[tuple[IntArray, IntArray, FloatArray, FloatArray, IntArray]] = []
    made = 1
    while len(begin):
        count = end - begin
        region = np.repeat(np.arange(len(begin)), count)
        place = np.arange(len(region)) - np.repeat(np.cumsum(count) - count, count)
        place += np.repeat(begin, count)
        position = points[order[place]]
        sums = [np.bincount(region, weights=position[:, axis]) for axis in range(3)]
        centroid = np.stack(sums, axis=1) / count[:, None]
        local = position - centroid[region]
        covariance = np.empty((len(begin), 3, 3))
        for i in range(3):
            for j in range(3):
                covariance[:, i, j] = np.bincount(region, weights=local[:, i] * local[:, j])
        value, vector = np.linalg.eigh(covariance)
        total = value.sum(axis=1)
        bend = np.divide(value[:, 0].clip(0), total, out=np.zeros(len(begin)), where=total > 0)
        longest = vector[:, :, 2]
        # The sign of an eigenvector is arbitrary; its largest component decides here.
        largest = np.abs(longest).argmax(axis=1)
        longest = longest * np.sign(longest[np.arange(len(begin)), largest])[:, None]
        split = (count > 1) & ((count > size) | (bend > variation))
        child = np.where(split, made + 2 * (np.cumsum(split) - 1), -1)
        levels.append((begin, end, centroid, bend, child))
        made += 2 * int(split.sum())
        second = (local * longest[region]).sum(axis=1) > 0
        ahead = np.bincount(region, weights=second).astype(np.int64)
        one_sided = (ahead == 0) | (ahead == count)
        halved = place - begin[region] >= (count // 2)[region]
        second = np.where(one_sided[region], halved, second)
        ahead = np.bincount(region, weights=second).astype(np.int64)
        active = split[region]
        target = place[active]
        order[target] = order[target[np.lexsort((second[active], region[active]))]]
        middle = (end - ahead)[split]
        begin, end = (
            np.stack(pair, axis=1).ravel()
            for pair in ((begin[split], middle), (middle, end[split]))
        )
    return _Tree(order, *(np.concatenate(column) for column in zip(*levels)))


def _best(tree: _Tree, variation: float, count: int) -> IntArray:
    """Return so many regions, splitting the bent before the flat and the large before the small."""
    size = tree.end - tree.begin

    def entry(node: int) -> tuple[bool, int, float, int]:
        bend = float(tree.variation[node])
        return (bend <= variation, -int(size[node]), -bend, node)

    queue = [entry(0)]
    whole: list[int] = []
    while len(queue) + len(whole) < count:
        node = heapq.heappop(queue)[3]
        if tree.child[node] < 0:
            whole.append(node)
            continue
        for half in (int(tree.child[node]), int(tree.child[node]) + 1):
            heapq.heappush(queue, entry(half))
    return np.array(sorted([*whole, *(item[3] for item in queue)]), dtype=np.int64)
