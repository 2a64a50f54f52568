"""Edges of triangle meshes, each as one number."""

from __future__ import annotations

import numpy as np

from .validation import IntArray


def sides(faces: IntArray) -> tuple[IntArray, IntArray]:
    """Return at which vertex each side of each face begins and ends, face by face.

    Parameters
    ----------
    faces : numpy.ndarray, shape (F, 3), int64

    Returns
    -------
    tail, head : numpy.ndarray, shape (3 F,), int64

    Examples
    --------
    >>> [ends.tolist() for ends in sides(np.array([[0, 1, 2]]))]
    [[0, 1, 2], [1, 2, 0]]
    """
    return faces.ravel(), np.roll(faces, -1, axis=1).ravel()


def edge_keys(one: IntArray, other: IntArray, vertices: int) -> IntArray:
    """Return a number for each pair of vertices, the same whichever comes first.

    Parameters
    ----------
    one, other : numpy.ndarray, of one shape, int64
        Vertices at the two ends.
    vertices : int
        How many vertices there are; keys compare only among those made with the same number. The
        lower vertex is the key divided by it, the higher one the remainder.

    Returns
    -------
    numpy.ndarray, of that shape, int64

    Examples
    --------
    >>> edge_keys(np.array([1, 2]), np.array([2, 1]), 3).tolist()
    [5, 5]
    """
    return np.asarray(np.minimum(one, other) * vertices + np.maximum(one, other))
