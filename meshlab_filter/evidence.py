"""What the original points say about a patch that would close a hole of a rebuilt surface."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .flips import nearest_faces
from .validation import FloatArray, IntArray

#: Share of the points expected on a triangle, by the density around, that must be there.
_LEAST_SUPPORT = 0.2
#: Points expected below which their number says nothing and the triangle counts as supported.
_FEW = 3.0
#: Points lie all over a patch if this share of samples on it has a point within so many spacings.
_ALL_OVER, _NEAR = 0.9, 1.2
_STEPS = 40
#: A patch reaches a point if it comes nearer than this share of the mesh's distance.
_REACHED = 0.5
_FACES_FOR_ONE, _ENOUGH, _HALF = 20, 10, 0.5
#: The share of a patch that must be off the mesh.
_NEW = 0.4


class Evidence:
    """The original points, asked whether a patch is missing from a mesh."""

    def __init__(
        self,
        vertices: FloatArray,
        faces: IntArray,
        points: FloatArray,
        near: IntArray,
        rim: IntArray,
    ) -> None:
        from scipy.spatial import cKDTree

        self.vertices, self.faces, self.points = vertices, faces, points
        self.tree = cKDTree(points)
        # Points in a hole have its rim near; the mesh has all the others.
        beside = np.isin(near, rim).any(axis=1)
        self.gap = np.zeros(len(points))
        found = nearest_faces(vertices, faces, points[beside], near=near[beside])[1]
        self.gap[beside] = np.sqrt(found)
        out = np.ones(len(vertices), dtype=bool)
        out[faces.ravel()] = False
        _, away = nearest_faces(vertices, faces, vertices[out])
        missed = np.flatnonzero(self.gap > 0)
        self.missed = np.vstack([vertices[out], points[missed]])
        self.missed_gap = np.concatenate([np.sqrt(away), self.gap[missed]])
        self.left_out = len(away)
        self.missed_tree = cKDTree(self.missed) if len(self.missed) else None

    def speaks_for(self, patch: IntArray, *, covered: bool = False) -> bool:
        """Tell whether the points want a patch: missed by the mesh or, if asked, all over it."""
        return self.supports(patch) or self.reaches(patch) or (covered and self.covers(patch))

    def supports(self, patch: IntArray) -> bool:
        """Tell whether points that the mesh misses lie on at least half of a patch's area."""
        a, b, c = (self.vertices[patch[:, corner]] for corner in range(3))
        normal = np.cross(b - a, c - a)
        doubled = np.linalg.norm(normal, axis=1)
        spacing = self._spacing(patch)
        if spacing == 0.0:
            return False
        # A point has about the square of the spacing to itself.
        expected = doubled / 2 / spacing**2
        centre = (a + b + c) / 3
        reach = np.linalg.norm(np.stack([a, b, c]) - centre, axis=2).max(axis=0)
        held = float(doubled[expected < _FEW].sum())
        for index in np.flatnonzero(expected >= _FEW):
            near = self.tree.query_ball_point(centre[index], reach[index])
            relative = self.points[near] - a[index]
            unit = normal[index] / doubled[index]
            height = np.abs(relative @ unit)
            v = np.cross(relative, c[index] - a[index]) @ unit
            w = np.cross(b[index] - a[index], relative) @ unit
            inside = (v > 0) & (w > 0) & (v + w < doubled[index])
            inside &= height < np.sqrt(doubled[index]) / 2
            missed = int((inside & (self.gap[near] > height + 1e-6 * reach[index])).sum())
            if missed >= _LEAST_SUPPORT * expected[index]:
                held += float(doubled[index])
        return bool(held >= doubled.sum() / 2)

    def reaches(self, patch: IntArray) -> bool:
        """Tell whether a patch comes far nearer to points that are off the mesh.

        For every twenty faces one vertex that was kept and has no face is enough, or ten other
        points on a patch with points near at least half of it.
        """
        if self.missed_tree is None or self._spacing(patch) == 0:
            return False
        corner = self.vertices[np.unique(patch)]
        centre = corner.mean(axis=0)
        reach = float(np.linalg.norm(corner - centre, axis=1).max())
        close = np.array(self.missed_tree.query_ball_point(centre, reach), dtype=np.int64)
        close = close[self.missed_gap[close] > self._spacing(patch)]
        if not len(close):
            return False
        _, square = nearest_faces(self.vertices, patch, self.missed[close])
        reached = close[np.sqrt(square) < _REACHED * self.missed_gap[close]]
        samples = self._samples(patch)
        if _FACES_FOR_ONE * np.count_nonzero(reached < self.left_out) < len(patch):
            near = self.tree.query(samples, workers=-1)[0] <= _NEAR * self._spacing(patch)
            if len(reached) < _ENOUGH or _share(near, patch, self.vertices) < _HALF:
                return False
        # What lies on the mesh, such as the back of a sheet with a hole, reaches nothing new.
        _, square = nearest_faces(self.vertices, self.faces, samples)
        return _share(np.sqrt(square) > self._spacing(patch) / 3, patch, self.vertices) > _NEW

    def covers(self, patch: IntArray) -> bool:
        """Tell whether points lie all over a patch, be they missed by the mesh or not."""
        spacing = self._spacing(patch)
        if spacing == 0.0:
            return False
        gap = self.tree.query(self._samples(patch), workers=-1)[0]
        return _share(gap <= _NEAR * spacing, patch, self.vertices) >= _ALL_OVER

    def _samples(self, patch: IntArray) -> FloatArray:
        """Return points all over a patch, no further apart than the original ones."""
        corner = self.vertices[patch]
        longest = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max()
        steps = int(np.clip(np.ceil(longest / self._spacing(patch)), 2, _STEPS))
        # Barycentric coordinates of an even grid, corners left out: these are points themselves.
        grid = np.array(
            [(i, j, steps - i - j) for i in range(steps + 1) for j in range(steps + 1 - i)]
        )
        grid = grid[grid.max(axis=1) < steps] / steps
        return np.asarray(np.einsum("sc,tcd->tsd", grid, corner)).reshape(-1, 3)

    def _spacing(self, patch: IntArray) -> float:
        """Spacing of the original points around a hole: the mean distance of six neighbours."""
        rim = self.vertices[np.unique(patch)]
        far = self.tree.query(rim, k=min(7, len(self.points)))[0].reshape(len(rim), -1)
        return float(np.median(far[:, 1:].mean(axis=1))) if far.shape[1] > 1 else 0.0


def _areas(patch: IntArray, vertices: FloatArray) -> FloatArray:
    a, b, c = (vertices[patch[:, corner]] for corner in range(3))
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1)) / 2


def _share(where: npt.NDArray[np.bool_], patch: IntArray, vertices: FloatArray) -> float:
    """Return the share of a patch's area, of as many samples in each of its triangles."""
    area = _areas(patch, vertices)
    return float(where.reshape(len(patch), -1).mean(axis=1) @ area / max(area.sum(), _TINY))


_TINY = float(np.finfo(float).tiny)
