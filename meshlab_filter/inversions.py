"""Parts of a surface that are inside out, while they hang together with the rest.

Where two sheets are close, a ball rolls through between them and goes on along the inside. What it
builds there never joins the outside: a seam runs around it, of two borders that go the same way.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .edges import sides
from .flaps import border_sides
from .orientation import groups_of, joints_of
from .validation import FloatArray, IntArray, check_points

#: Borders that each border is compared with.
_COMPARED = 8
#: Up to what distance, in mean lengths of a border's sides.
_REACH = 2.0


def turn_inverted(
    vertices: npt.ArrayLike, faces: npt.ArrayLike, normals: npt.ArrayLike
) -> IntArray:
    """Cut off parts that are inside out and turn them, if that makes one surface of a seam.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
    faces : array_like, shape (F, 3), of integers
    normals : array_like, shape (V, 3)
        Normals of the points. They tell parts from each other; which of two is right does not
        matter.

    Returns
    -------
    numpy.ndarray, shape (F', 3), int64
        The faces that stay, some turned, in their order. Those on both sides of a cut are gone.

    Notes
    -----
    A part is what hangs together of faces that all face with the normals, or all against. It is
    turned if more of its border runs along borders that face the other way than is cut.

    Examples
    --------
    A sheet with a slit, to the right of which it is inside out. At one end both sides hang
    together; the two faces there go:

    >>> x, y = (a.ravel() for a in np.meshgrid(np.arange(9.0), np.arange(9.0)))
    >>> grid = np.column_stack([x, y, 0 * x])
    >>> cells = [i for i in range(72) if i % 9 < 4 or i == 4]
    >>> left = [f for i in cells for f in ([i, i + 1, i + 10], [i, i + 10, i + 9])]
    >>> cells = [i for i in range(72) if 4 < i % 9 < 8]
    >>> right = [f for i in cells for f in ([i, i + 10, i + 1], [i, i + 9, i + 10])]
    >>> mended = turn_inverted(grid, left + right, np.tile([0, 0, 1], (81, 1)))
    >>> one, two, three = (grid[mended[:, corner]] for corner in range(3))
    >>> up = np.cross(two - one, three - one)[:, 2] > 0
    >>> len(left + right), len(up), bool(up.all())
    (114, 112, True)
    """
    corners = check_points(vertices, name="vertices")
    directions = check_points(normals, name="normals")
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    if not len(triangles):
        return triangles
    a, b, c = (corners[triangles[:, corner]] for corner in range(3))
    normal = np.cross(b - a, c - a)
    along = np.einsum("ij,ij->i", directions[triangles].sum(axis=1), normal) > 0
    border = np.flatnonzero(border_sides(triangles))
    one, two = joints_of(triangles)
    alike = along[one] == along[two]
    part, parts = groups_of(len(triangles), one[alike], two[alike])
    area = np.linalg.norm(normal, axis=1)
    total = np.bincount(part, weights=area, minlength=parts)
    cut = np.bincount(part[one][part[one] != part[two]], minlength=parts)
    cut += np.bincount(part[two][part[one] != part[two]], minlength=parts)
    against = np.bincount(
        part[_conflicts(corners, triangles, normal, border, part)], minlength=parts
    )
    largest = int(total.argmax())
    turned = (against > cut) & (cut > 0)
    turned[largest] = False
    flip = turned[part]
    apart = flip[one] != flip[two]
    keep = np.ones(len(triangles), dtype=bool)
    keep[one[apart]] = keep[two[apart]] = False
    if not keep.any():  # a few faces, all of them at the cut
        return triangles
    triangles[flip] = triangles[flip][:, ::-1]
    return triangles[keep]


def _conflicts(
    vertices: FloatArray,
    faces: IntArray,
    normal: FloatArray,
    border: IntArray,
    part: IntArray,
) -> IntArray:
    """Return the faces at borders along which another part's border runs the same way."""
    from scipy.spatial import cKDTree

    if len(border) < 2:
        return np.empty(0, dtype=np.int64)
    tail, head = sides(faces)
    begin, end = vertices[tail[border]], vertices[head[border]]
    middle = (begin + end) / 2
    length = np.linalg.norm(end - begin, axis=1)
    way = (end - begin) / np.maximum(length, _TINY)[:, None]
    face = border // 3
    unit = normal[face] / np.maximum(np.linalg.norm(normal[face], axis=1), _TINY)[:, None]
    count = min(_COMPARED, len(border) - 1)
    far, near = cKDTree(middle).query(
        middle, k=np.arange(2, count + 2), distance_upper_bound=_REACH * length.mean()
    )
    there = np.isfinite(far)
    near = np.where(there, near, 0)
    same = there & (part[face[near]] != part[face][:, None])
    same &= np.einsum("ij,ikj->ik", way, way[near]) > 0
    same &= np.einsum("ij,ikj->ik", unit, unit[near]) < 0
    return np.asarray(face[same.any(axis=1)])


_TINY = float(np.finfo(float).tiny)
