"""Clouds and surfaces made small enough to be drawn in a browser, as text."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import numpy.typing as npt

from .validation import FloatArray, IntArray

#: Most points, and most triangles, that are drawn in one view.
MOST_POINTS, MOST_FACES = 200_000, 300_000


def pack(array: npt.ArrayLike, kind: str = "f4") -> dict[str, Any]:
    """Return an array as text that a browser turns into a typed array.

    Parameters
    ----------
    array : array_like
        Flattened in C order.
    kind : {"f4", "i4"}
        Little-endian single precision or 32-bit integers.

    Returns
    -------
    dict
        "kind" and "data" (base64).

    Examples
    --------
    >>> pack([1.0])
    {'kind': 'f4', 'data': 'AACAPw=='}
    """
    flat = np.ascontiguousarray(array, dtype="<" + kind)
    return {"kind": kind, "data": base64.b64encode(flat.tobytes()).decode("ascii")}


def thin(count: int, *, most: int = MOST_POINTS) -> IntArray:
    """Return which of so many points are drawn: all, or a random subset that is always the same.

    Parameters
    ----------
    count : int
        Points there are.
    most : int
        Points that are drawn at most.

    Returns
    -------
    numpy.ndarray, shape (min(count, most),), int64
        Indices, ascending.

    Examples
    --------
    >>> len(thin(1000, most=10)), len(thin(7, most=10))
    (10, 7)
    """
    if count <= most:
        return np.arange(count)
    # Random rather than every n-th: scanners write points row by row, and stripes would show.
    return np.sort(np.random.default_rng(0).choice(count, size=most, replace=False))


def coarsen(
    points: FloatArray, faces: IntArray, values: FloatArray, *, most: int = MOST_FACES
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Merge the vertices of a surface on ever coarser grids until few enough triangles are left.

    Parameters
    ----------
    points : numpy.ndarray, shape (V, 3)
    faces : numpy.ndarray, shape (F, 3)
    values : numpy.ndarray, shape (V, C)
        A row of values for each vertex.
    most : int
        Triangles that are drawn at most.

    Returns
    -------
    points, faces, values
        The mean of the vertices of each cell, the triangles that still have three corners, each
        once, and the largest values of each cell. A surface that is small enough comes back as
        it is.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1.01, 0, 0]])
    >>> faces = np.array([[0, 1, 2], [1, 3, 2]])
    >>> coarsen(points, faces, np.zeros((4, 1)), most=1)[1]
    array([[0, 2, 1]])
    """
    if len(faces) <= most:
        return points, faces, values
    low, extent = points.min(axis=0), float(np.ptp(points, axis=0).max())
    # A surface of F triangles crosses about F / 2 cells of a grid with as many cells as vertices.
    cells = 2.0 * np.sqrt(most)
    while True:
        keys = np.floor((points - low) * (cells / extent)).astype(np.int64)
        _, owner = np.unique(keys, axis=0, return_inverse=True)
        owner = owner.reshape(-1)
        corners = owner[faces]
        whole = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
        _, first = np.unique(np.sort(corners[whole], axis=1), axis=0, return_index=True)
        left = corners[whole][np.sort(first)]
        if len(left) <= most:
            break
        cells /= 1.2
    size = np.bincount(owner)
    merged = np.column_stack([np.bincount(owner, points[:, axis]) / size for axis in range(3)])
    highest = np.full((len(size), values.shape[1]), -np.inf)
    np.maximum.at(highest, owner, values)
    return merged, left, highest
