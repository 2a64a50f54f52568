"""Pictures of meshes and clouds without a display: a small software renderer in numpy.

Orthographic view, depth buffer, one light at the camera, two-fold oversampling. Scripts and the
documentation use it, so that figures need neither a window nor a graphics driver.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
OVERSAMPLING = 2


@dataclass(frozen=True)
class View:
    """From where a cloud is seen; made once and used for every picture of a figure.

    Attributes
    ----------
    rotation : numpy.ndarray, shape (3, 3)
        Rows are the picture's right, up and towards-the-viewer in model coordinates.
    centre : numpy.ndarray, shape (3,)
    scale : float
        Pixels per unit of length, before oversampling.
    width, height : int
        Of the picture in pixels.
    """

    rotation: Floats
    centre: Floats
    scale: float
    width: int
    height: int

    @classmethod
    def of(
        cls,
        points: Floats,
        *,
        azimuth: float = 0.0,
        elevation: float = 0.0,
        up: str = "y",
        width: int = 480,
        height: int = 480,
        margin: float = 0.04,
    ) -> View:
        """Look at all points from an azimuth and an elevation in degrees, ``up`` being up."""
        base = {
            "y": np.eye(3),
            "z": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
            "x": np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]),
        }[up]
        a, e = np.radians([azimuth, elevation])
        turn = np.array([[np.cos(a), 0, -np.sin(a)], [0, 1, 0], [np.sin(a), 0, np.cos(a)]])
        tilt = np.array([[1, 0, 0], [0, np.cos(e), -np.sin(e)], [0, np.sin(e), np.cos(e)]])
        rotation = tilt @ turn @ base
        seen = points @ rotation.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        room = 1 - 2 * margin
        scale = room * min(width / (high[0] - low[0]), height / (high[1] - low[1]))
        return cls(rotation, (low + high) / 2 @ rotation, float(scale), width, height)

    def project(self, points: Floats) -> Floats:
        """Return column, row and nearness of points, in oversampled pixels."""
        seen = (points - self.centre) @ self.rotation.T * self.scale * OVERSAMPLING
        middle = np.array([self.width, self.height]) * OVERSAMPLING / 2
        return np.column_stack([middle[0] + seen[:, 0], middle[1] - seen[:, 1], seen[:, 2]])


def render_mesh(points: Floats, faces: npt.ArrayLike, colors: Floats, view: View) -> Floats:
    """Draw a triangle mesh with colours at its vertices.

    Parameters
    ----------
    points : numpy.ndarray, shape (V, 3)
    faces : array_like, shape (F, 3), of integers
    colors : numpy.ndarray, shape (V, 3) or (3,)
        In 0 … 1.
    view : View

    Returns
    -------
    numpy.ndarray, shape (height, width, 3), in 0 … 1, on white.
    """
    faces = np.asarray(faces, dtype=np.int64)
    colors = np.broadcast_to(np.asarray(colors, dtype=float)[..., :3], (len(points), 3))
    seen = view.project(points)
    corners = seen[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    light = 0.35 + 0.65 * np.abs(normal[:, 2]) / np.where(length > 0, length, 1)
    # Sample each triangle densely enough that no pixel in it is missed; triangles of about the
    # same size together.
    extent = (corners[:, :, :2].max(axis=1) - corners[:, :, :2].min(axis=1)).max(axis=1)
    steps = np.ceil(np.maximum(extent, 1) * 1.5).astype(int)
    buffer = _Buffer(view)
    for step in np.unique(steps):
        u, v = np.meshgrid(np.arange(step + 1), np.arange(step + 1))
        inside = u + v <= step
        weights = np.column_stack([u[inside], v[inside]]) / step
        weights = np.column_stack([1 - weights.sum(axis=1), weights])
        chosen = np.flatnonzero(steps == step)
        for block in np.array_split(chosen, max(1, len(chosen) * len(weights) // 2_000_000)):
            places = np.einsum("wc,fcd->fwd", weights, corners[block])
            shades = np.einsum("wc,fcd->fwd", weights, colors[faces[block]])
            shades *= light[block, None, None]
            buffer.draw(places.reshape(-1, 3), shades.reshape(-1, 3))
    return buffer.picture()


def render_points(points: Floats, colors: Floats, view: View, *, radius: float = 1.0) -> Floats:
    """Draw points as discs of a radius in pixels.

    Parameters
    ----------
    points : numpy.ndarray, shape (N, 3)
    colors : numpy.ndarray, shape (N, 3) or (3,)
    view : View
    radius : float

    Returns
    -------
    numpy.ndarray, shape (height, width, 3), in 0 … 1, on white.
    """
    colors = np.broadcast_to(np.asarray(colors, dtype=float)[..., :3], (len(points), 3))
    seen = view.project(points)
    reach = round(radius * OVERSAMPLING)
    buffer = _Buffer(view)
    for dx in range(-reach, reach + 1):
        for dy in range(-reach, reach + 1):
            if dx * dx + dy * dy <= (radius * OVERSAMPLING) ** 2 + 0.5:
                buffer.draw(seen + np.array([dx, dy, 0]), colors)
    return buffer.picture()


class _Buffer:
    """Colour and nearness of every oversampled pixel."""

    def __init__(self, view: View) -> None:
        self.shape = (view.height * OVERSAMPLING, view.width * OVERSAMPLING)
        self.nearness = np.full(self.shape[0] * self.shape[1], -np.inf)
        self.colors = np.ones((len(self.nearness), 3))

    def draw(self, places: Floats, colors: Floats) -> None:
        """Put colours where they are nearer than what is there."""
        column, row = np.floor(places[:, 0]).astype(int), np.floor(places[:, 1]).astype(int)
        height, width = self.shape
        visible = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        pixel = (row * width + column)[visible]
        near, colors = places[visible, 2], colors[visible]
        order = np.lexsort((near, pixel))
        last = np.flatnonzero(np.diff(pixel[order], append=-1))
        best = order[last]
        better = near[best] > self.nearness[pixel[best]]
        best = best[better]
        self.nearness[pixel[best]] = near[best]
        self.colors[pixel[best]] = colors[best]

    def picture(self) -> Floats:
        """Average the oversampled pixels."""
        height, width = self.shape
        fine = self.colors.reshape(
            height // OVERSAMPLING, OVERSAMPLING, width // OVERSAMPLING, OVERSAMPLING, 3
        )
        return np.asarray(fine.mean(axis=(1, 3)))
