"""How far the surface would move at a point if the point that stands for it were taken away.

In a decimation every original point is a *witness*: it belongs to one point that is still there,
its owner, and says how badly the cloud would represent it without that owner. The figures here are
local estimates from the owner's neighbours; no surface is reconstructed.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import numpy.typing as npt

from .validation import FloatArray, IntArray

# Barycentric coordinates may be this much below zero: points half-way between two others, as
# subdivided meshes have by the thousand, must fall inside one of the two triangles.
_ON_EDGE = 1e-5
# A triangle of less area than this, over the squared distance of the farthest neighbour, is a
# line: its barycentric coordinates would be rounding noise.
_THINNEST = 1e-5
# A segment between neighbours longer than this many nearest distances bridges a gap, not a border.
_LONGEST_SEGMENT = 8.0


def tangent_frames(normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors that span the plane perpendicular to each normal.

    Parameters
    ----------
    normals : numpy.ndarray, shape (3, N)
        Unit normals, one a column.

    Returns
    -------
    u, v : numpy.ndarray, shape (3, N)
        With the normal, a right-handed orthonormal frame: T. Duff et al., "Building an
        Orthonormal Basis, Revisited", JCGT 6(1), 2017.
    """
    nx, ny, nz = normals
    sign = np.copysign(1.0, nz)
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    u = np.stack([1.0 + sign * nx * nx * a, sign * b, -sign * nx])
    v = np.stack([b, sign + ny * ny * a, -ny])
    return u, v


class Witnesses:
    """Estimates, for many witnesses at a time, of the error once an owner is gone.

    Parameters
    ----------
    neighbours : int
        How many neighbours of the owner each estimate uses; at least 3.

    Notes
    -----
    The neighbours are projected on the tangent plane of the witness. Of the triangles of
    neighbours that contain the witness the local Delaunay one is taken, which has the least
    barycentric mean of the squared distances; the error is the distance to its plane. Where no
    triangle contains the witness (a border) it is the distance to the nearest segment between two
    neighbours. It is never more than the distance to the nearest neighbour.
    """

    def __init__(self, neighbours: int) -> None:
        self.neighbours = neighbours
        pairs = list(combinations(range(neighbours), 2))
        number = {pair: index for index, pair in enumerate(pairs)}
        triangles = np.array(list(combinations(range(neighbours), 3)))
        self._first, self._second = np.array(pairs).T
        self._corners = triangles.T
        self._opposite = np.array(
            [[number[j, k], number[i, k], number[i, j]] for i, j, k in triangles]
        ).T

    def errors(
        self, witness: FloatArray, normal: FloatArray, around: FloatArray, spacing2: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Error of each witness, and how far the neighbours lie off its tangent plane.

        Parameters
        ----------
        witness, normal : numpy.ndarray, shape (3, n)
            Positions and unit normals of the witnesses; the sign of a normal has no effect.
        around : numpy.ndarray, shape (3, k, n)
            Positions of the neighbours of each witness's owner.
        spacing2 : numpy.ndarray, shape (n,)
            Mean squared distance of the owner to these neighbours.

        Returns
        -------
        gap : numpy.ndarray, shape (n,)
            Distance to the surface the neighbours span, a length.
        crease : numpy.ndarray, shape (n,)
            Weighted mean of the neighbours' heights over the tangent plane, a length.
        """
        d = around - witness[:, None, :]
        u, v = tangent_frames(normal)
        a, b, h = (np.einsum("ckn,cn->kn", d, axis) for axis in (u, v, normal))
        flat2 = a * a + b * b
        dist2 = flat2 + h * h
        nearest2 = dist2.min(axis=0)

        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            gap = self._triangle_gap(a, b, h, flat2)
        outside = np.flatnonzero(np.isinf(gap))
        if len(outside):
            gap[outside] = self._segment_gap(d[:, :, outside], nearest2[outside])
        np.minimum(gap, np.sqrt(nearest2), out=gap)

        weight = 1.0 / (dist2 + 0.25 * spacing2 + np.finfo(float).tiny ** 0.25) ** 2
        crease = (weight * np.abs(h)).sum(axis=0) / weight.sum(axis=0)
        return gap, crease

    def _triangle_gap(
        self, a: FloatArray, b: FloatArray, h: FloatArray, flat2: FloatArray
    ) -> FloatArray:
        """Distance to the plane of the local Delaunay triangle, infinite where there is none."""
        corners, found = self._local_delaunay(a, b, flat2)
        column = np.arange(a.shape[1])
        (ai, aj, ak), (bi, bj, bk), (hi, hj, hk) = (m[corners, column] for m in (a, b, h))
        # Twice the signed areas that the witness makes with each side are its barycentric weights.
        wi, wj, wk = aj * bk - bj * ak, ak * bi - bk * ai, ai * bj - bi * aj
        area = wi + wj + wk
        nx = (bj - bi) * (hk - hi) - (hj - hi) * (bk - bi)
        ny = (hj - hi) * (ak - ai) - (aj - ai) * (hk - hi)
        # The height over the tangent plane is over the area; the normal's third part is the area.
        gap = np.abs(wi * hi + wj * hj + wk * hk) / np.sqrt(nx * nx + ny * ny + area * area)
        gap[~found] = np.inf
        return np.asarray(gap)

    def _local_delaunay(
        self, a: FloatArray, b: FloatArray, flat2: FloatArray
    ) -> tuple[IntArray, npt.NDArray[np.bool_]]:
        """Corners, shape (3, n), of the triangle about each witness, and whether there is one.

        Single precision and the largest distance as unit: only which triangle it is, is asked.
        """
        unit = 1.0 / np.sqrt(np.maximum(flat2.max(axis=0), np.finfo(float).tiny))
        x, y = (a * unit).astype(np.float32), (b * unit).astype(np.float32)
        r2 = x * x + y * y
        cross = x[self._first] * y[self._second] - y[self._first] * x[self._second]
        jk, ik, ij = self._opposite
        i, j, k = self._corners
        wi, wj, wk = cross[jk], -cross[ik], cross[ij]
        area = wi + wj + wk
        wi /= area
        wj /= area
        wk /= area
        inside = np.minimum(np.minimum(wi, wj), wk) >= -_ON_EDGE
        inside &= np.abs(area) > _THINNEST
        wi *= r2[i]
        wj *= r2[j]
        wk *= r2[k]
        wi += wj
        wi += wk
        wi[~inside] = np.inf
        best = wi.argmin(axis=0)
        return self._corners[:, best], inside[best, np.arange(len(best))]

    def _segment_gap(self, d: FloatArray, nearest2: FloatArray) -> FloatArray:
        """Distance to the nearest segment between two neighbours that is not too long."""
        start = d[:, self._first]
        along = d[:, self._second] - start
        length2 = (along * along).sum(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.clip(-(start * along).sum(axis=0) / length2, 0.0, 1.0)
        foot = start + np.nan_to_num(t) * along
        gap2 = (foot * foot).sum(axis=0)
        gap2[length2 > _LONGEST_SEGMENT**2 * nearest2] = np.inf
        return np.asarray(np.sqrt(gap2.min(axis=0)))
