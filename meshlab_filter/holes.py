"""Holes of a rebuilt surface, closed where the original points say that there is surface.

Ball pivoting leaves a hole where the ball falls through or two normals disagree. Border of the
scan and hole of the reconstruction look alike to a mesh filter; they differ in that original
points lie across the one and not across the other.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .edges import edge_keys, sides
from .evidence import Evidence
from .flips import nearest_vertices
from .loops import boundary_loops, facing_loops
from .orientation import pieces_of
from .patches import SideNormals, triangulate
from .validation import FloatArray, IntArray, check_points

#: What other faces cover already is closed up to this share of the area of the piece around it.
_LARGEST_BACK = 0.25
#: A band is laid between two borders up to this share of the larger piece that they belong to.
_LARGEST_BAND = 0.5


def close_holes(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    points: npt.ArrayLike,
    *,
    near: IntArray | None = None,
    max_edges: int = 64,
    covered: bool = False,
    bands: bool = False,
) -> IntArray:
    """Close holes of a triangle mesh across which the original points lie.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
    faces : array_like, shape (F, 3), of integers
    points : array_like, shape (N, 3)
        The original points, in the unit of the vertices.
    near : numpy.ndarray, shape (N, k), int64, optional
        What :func:`~meshlab_filter.flips.nearest_vertices` says of these points, if that is known
        already.
    max_edges : int
        Holes with more edges stay as they are.
    covered : bool
        Close as well what other faces cover already, as long as there are points all over it.
    bands : bool
        Close as well between two borders that face each other, as those of a limb cut in two do.

    Returns
    -------
    numpy.ndarray, shape (F + new, 3), int64
        The faces given, then the new ones, oriented as those around.

    Notes
    -----
    A hole gets the faces that :func:`~meshlab_filter.patches.triangulate` finds. It stays open if
    on less than half of their area there are about as many original points as the density around
    the hole promises, and if they do not reach what lies off the mesh there either. A single
    missing face is always closed.

    Examples
    --------
    A square without its middle, on which there are points, and again without them:

    >>> grid = np.stack(np.meshgrid(*[np.arange(4.0)] * 2, [0.0]), axis=-1).reshape(-1, 3)
    >>> cells = (0, 1, 2, 4, 6, 8, 9, 10)
    >>> faces = [f for i in cells for f in ([i, i + 1, i + 5], [i, i + 5, i + 4])]
    >>> dense = np.stack(np.meshgrid(*[np.linspace(0, 3, 31)] * 2, [0.0]), axis=-1).reshape(-1, 3)
    >>> len(faces), len(close_holes(grid, faces, dense))
    (16, 18)
    >>> around = (np.abs(dense[:, :2] - 1.5) > 0.5).any(axis=1)
    >>> len(close_holes(grid, faces, dense[around]))
    16
    """
    corners = check_points(vertices, name="vertices")
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    cloud = check_points(points)
    loops = [loop for loop in boundary_loops(triangles) if len(loop) <= max_edges]
    if not loops:
        return triangles
    known = np.sort(edge_keys(*sides(triangles), len(corners)))
    if near is None:
        near = nearest_vertices(corners, triangles, cloud)
    rim = np.unique(np.concatenate(loops))
    evidence = Evidence(corners, triangles, cloud, near, rim)
    normals = SideNormals(corners, triangles)
    added = [triangles]
    closed: set[int] = set()
    piece, pieces = pieces_of(triangles)
    area = np.bincount(piece, weights=_areas(corners, triangles), minlength=pieces)

    def fill(loop: IntArray) -> IntArray | None:
        return triangulate(corners, loop, known, normals.beyond(loop))

    def share(patch: IntArray, loop: IntArray) -> float:
        # What is as large as the piece it borders is the back of an open sheet.
        around = area[piece[normals.faces_beyond(loop)]].max()
        return float(_areas(corners, patch).sum() / max(around, np.finfo(float).tiny))

    for one, two, around in facing_loops(corners, loops) if bands else []:
        band = fill(around) if len(around) <= 2 * max_edges else None
        if band is None or min(share(band, loops[one]), share(band, loops[two])) > _LARGEST_BAND:
            continue
        if evidence.speaks_for(band, covered=share(band, loops[one]) <= _LARGEST_BACK):
            # Two small holes beside each other face each other, too; less is missing in them.
            lids = [fill(loops[one]), fill(loops[two])]
            total = sum(np.inf if lid is None else _areas(corners, lid).sum() for lid in lids)
            if _areas(corners, band).sum() < total:
                added.append(band)
                closed |= {one, two}
                known = _with_edges(known, band, len(corners))
    for loop in (loop for number, loop in enumerate(loops) if number not in closed):
        patch = fill(loop)
        if patch is None:
            continue
        # One face missing amid its neighbours needs no witness, unless it is a face seen from
        # behind: the border of a lone triangle.
        single = len(patch) == 1 and not (np.sort(triangles, axis=1) == np.sort(patch)).all(1).any()
        if single or evidence.speaks_for(
            patch, covered=covered and share(patch, loop) <= _LARGEST_BACK
        ):
            added.append(patch)
            known = _with_edges(known, patch, len(corners))
    return np.vstack(added)


def _areas(vertices: FloatArray, faces: IntArray) -> FloatArray:
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1)) / 2


def _with_edges(known: IntArray, patch: IntArray, size: int) -> IntArray:
    """Return sorted keys of edges with those of a patch among them."""
    fresh = np.unique(edge_keys(*sides(patch), size))
    return np.insert(known, np.searchsorted(known, fresh), fresh)
