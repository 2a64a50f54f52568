"""Surfaces in PLY files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .plyheader import Property, header_of_surface
from .validation import FloatArray, IntArray

_PROPERTIES = (
    *(Property(name, "f8") for name in ("x", "y", "z")),
    *(Property(name, "u1") for name in ("red", "green", "blue", "alpha")),
    Property("quality", "f8"),
)


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
    vertices = np.empty(len(points), dtype=[(prop.name, "<" + prop.kind) for prop in _PROPERTIES])
    for column, axis in enumerate("xyz"):
        vertices[axis] = points[:, column]
    for column, name in enumerate(("red", "green", "blue", "alpha")):
        vertices[name] = np.rint(colors[:, column] * 255)
    vertices["quality"] = quality
    triangles = np.empty(len(faces), dtype=[("length", "u1"), ("vertex_indices", "<i4", (3,))])
    triangles["length"] = 3
    triangles["vertex_indices"] = faces
    with open(path, "wb") as file:
        file.write(header_of_surface(_PROPERTIES, len(points), len(faces), comments=comments))
        file.write(vertices.tobytes())
        file.write(triangles.tobytes())
