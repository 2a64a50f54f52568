"""Surfaces in PLY files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import plyfile

from .validation import FloatArray, IntArray


def write_surface(
    path: Path,
    *,
    points: FloatArray,
    faces: IntArray,
    quality: FloatArray,
    colors: FloatArray,
    comments: Sequence[str] = (),
) -> None:
    """Write a triangle mesh with a quality and a colour at each vertex, binary little endian.

    Parameters
    ----------
    path : Path
    points : numpy.ndarray, shape (V, 3)
    faces : numpy.ndarray, shape (F, 3)
    quality : numpy.ndarray, shape (V,)
    colors : numpy.ndarray, shape (V, 4)
        Red, green, blue, alpha in 0 … 1.
    comments : sequence of str
    """
    channels = ("red", "green", "blue", "alpha")
    vertices = np.empty(
        len(points),
        dtype=[*((axis, "f8") for axis in "xyz"), *((name, "u1") for name in channels),
               ("quality", "f8")],
    )  # fmt: skip
    for column, axis in enumerate("xyz"):
        vertices[axis] = points[:, column]
    for column, name in enumerate(channels):
        vertices[name] = np.rint(colors[:, column] * 255)
    vertices["quality"] = quality
    triangles = np.empty(len(faces), dtype=[("vertex_indices", "i4", (3,))])
    triangles["vertex_indices"] = faces
    plyfile.PlyData(
        [
            plyfile.PlyElement.describe(vertices, "vertex"),
            plyfile.PlyElement.describe(triangles, "face"),
        ],
        byte_order="<",
        comments=list(comments),
    ).write(str(path))
