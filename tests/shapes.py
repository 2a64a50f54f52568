"""Closed surfaces that tests are made from."""

import numpy as np
from scipy.spatial import ConvexHull


def ball(count, seed=0):
    """Return points on the unit sphere, about evenly, in random order."""
    index = np.random.default_rng(seed).permutation(count) + 0.5
    polar, around = np.arccos(1 - 2 * index / count), np.pi * (1 + 5**0.5) * index + seed
    return np.column_stack(
        [np.cos(around) * np.sin(polar), np.sin(around) * np.sin(polar), np.cos(polar)]
    )


def hull(points):
    """Return the faces of the hull, turned outward."""
    faces = ConvexHull(points).simplices.astype(np.int64)
    a, b, c = (points[faces[:, corner]] for corner in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) < 0
    faces[inward] = faces[inward][:, ::-1]
    return faces


def euler(faces):
    """Return the number of vertices less edges plus faces: 2 for a ball."""
    ends = np.sort(np.column_stack([faces.ravel(), np.roll(faces, -1, axis=1).ravel()]), axis=1)
    return len(np.unique(faces)) - len(np.unique(ends, axis=0)) + len(faces)
