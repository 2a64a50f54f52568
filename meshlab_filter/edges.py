"""Edges of triangle meshes, each as one number."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

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


def are_among(keys: IntArray, ordered: IntArray) -> npt.NDArray[np.bool_]:
    """Tell which keys are among those of a sorted list.

    Parameters
    ----------
    keys : numpy.ndarray, of any shape, int64
    ordered : numpy.ndarray, shape (K,), int64

    Returns
    -------
    numpy.ndarray, of the first one's shape, bool

    Examples
    --------
    >>> are_among(np.array([[1, 2], [3, 9]]), np.array([1, 3])).tolist()
    [[True, False], [True, False]]
    """
    if not len(ordered):
        return np.zeros(keys.shape, dtype=bool)
    place = np.minimum(np.searchsorted(ordered, keys), len(ordered) - 1)
    return np.asarray(ordered[place] == keys)


def corners_of(faces: IntArray) -> IntArray:
    """Return the vertices that have a face, in their order.

    Parameters
    ----------
    faces : numpy.ndarray, shape (F, 3), int64

    Returns
    -------
    numpy.ndarray, shape (C,), int64

    Examples
    --------
    >>> corners_of(np.array([[4, 0, 2]])).tolist()
    [0, 2, 4]
    """
    return np.flatnonzero(np.bincount(faces.ravel()))


def without_face(faces: IntArray, vertices: int) -> IntArray:
    """Return the vertices that have no face, in their order.

    Parameters
    ----------
    faces : numpy.ndarray, shape (F, 3), int64
    vertices : int
        How many there are.

    Returns
    -------
    numpy.ndarray, shape (V - C,), int64

    Examples
    --------
    >>> without_face(np.array([[4, 0, 2]]), 6).tolist()
    [1, 3, 5]
    """
    return np.flatnonzero(np.bincount(faces.ravel(), minlength=vertices) == 0)
