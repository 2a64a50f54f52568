"""Points and triangles, pair by pair: distances and barycentric coordinates."""

from __future__ import annotations

import numpy as np

from .validation import FloatArray


def squared_distances(
    points: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray
) -> FloatArray:
    """Return the squared distance of each point to its own triangle.

    Parameters
    ----------
    points, a, b, c : numpy.ndarray, shape (P, 3)
        Points and the corners of their triangles, which may be degenerate.

    Returns
    -------
    numpy.ndarray, shape (P,), float64
        In the square of the unit of length.

    References
    ----------
    C. Ericson, "Real-Time Collision Detection", 2005, section 5.1.5.

    Examples
    --------
    >>> corners = [np.array([corner]) for corner in ([0.0, 0, 0], [1.0, 0, 0], [0.0, 1, 0])]
    >>> squared_distances(np.array([[0.2, 0.2, 3.0]]), *corners)
    array([9.])
    """
    ab, ac, ap = b - a, c - a, points - a
    d00 = np.einsum("ij,ij->i", ab, ab)
    d01 = np.einsum("ij,ij->i", ab, ac)
    d11 = np.einsum("ij,ij->i", ac, ac)
    d20 = np.einsum("ij,ij->i", ap, ab)
    d21 = np.einsum("ij,ij->i", ap, ac)
    d22 = np.einsum("ij,ij->i", ap, ap)
    area = d00 * d11 - d01 * d01
    safe = np.where(area > 0, area, 1.0)
    v = (d11 * d20 - d01 * d21) / safe
    w = (d00 * d21 - d01 * d20) / safe
    inside = (area > 0) & (v >= 0) & (w >= 0) & (v + w <= 1)
    # Nearest point on each side, by its parameter clipped to the side.
    t_ab = _clip_ratio(d20, d00)
    t_ac = _clip_ratio(d21, d11)
    length_bc = d00 - 2 * d01 + d11
    t_bc = _clip_ratio(d21 - d20 + d00 - d01, length_bc)
    best = np.minimum(
        d22 - 2 * t_ab * d20 + t_ab**2 * d00,
        d22 - 2 * t_ac * d21 + t_ac**2 * d11,
    )
    from_b = d22 - 2 * d20 + d00
    best = np.minimum(best, from_b - 2 * t_bc * (d21 - d20 + d00 - d01) + t_bc**2 * length_bc)
    plane = d22 - v * d20 - w * d21
    return np.asarray(np.maximum(np.where(inside, plane, best), 0.0))


def barycentric(points: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Return where the feet of points are in the planes of their triangles.

    Parameters
    ----------
    points, a, b, c : numpy.ndarray, shape (P, 3)
        Points and the corners of their triangles.

    Returns
    -------
    numpy.ndarray, shape (P, 3), float64
        Barycentric coordinates of the foot, zero for a triangle without area.

    Examples
    --------
    >>> corners = [np.array([corner]) for corner in ([0.0, 0, 0], [4.0, 0, 0], [0.0, 4, 0])]
    >>> barycentric(np.array([[1.0, 2, 9]]), *corners)
    array([[0.25, 0.25, 0.5 ]])
    """
    normal = np.cross(b - a, c - a)
    squared = np.einsum("ij,ij->i", normal, normal)
    safe = np.where(squared > 0, squared, 1.0)
    pairs = ((b, c), (c, a), (a, b))
    return np.column_stack(
        [np.einsum("ij,ij->i", np.cross(q - p, points - p), normal) / safe for p, q in pairs]
    )


def _clip_ratio(numerator: FloatArray, denominator: FloatArray) -> FloatArray:
    positive = denominator > 0
    ratio = np.divide(numerator, denominator, out=np.zeros_like(numerator), where=positive)
    return np.asarray(np.clip(ratio, 0.0, 1.0))
