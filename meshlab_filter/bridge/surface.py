"""Surfaces through points, by MeshLab's reconstruction filters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..errors import InvalidCloudError, InvalidParameterError
from ..orientation import orient_coherently
from ..quality import regularity, spacing_and_regularity
from ..validation import FloatArray, IntArray, check_choice
from .layer import add_layer, current_normals, current_points
from .session import import_pymeshlab, stage

if TYPE_CHECKING:
    import pymeshlab

SURFACES = ("ball-pivoting", "ball-pivoting-auto", "screened-poisson", "none")

#: Surfaces whose vertices are the points themselves.
THROUGH_POINTS = ("ball-pivoting", "ball-pivoting-auto")

#: The largest extent of a cloud, in median spacings: with points farther off MeshLab's distance
#: filter does not come to an end.
LARGEST_EXTENT = 1e9

#: Radii of the ball-pivoting passes, in median spacings of the points.
PASSES = (1.0, 1.5, 2.5, 4.0)
#: The same for large clouds of points as irregular as if thrown at random. A ball of one spacing
#: falls through so often there that MeshLab spends nearly all its time searching the edges left
#: open, for every new face all of them.
IRREGULAR_PASSES = (1.6, 2.5)
_IRREGULAR, _MANY = 0.55, 20_000
# Borders of pieces are compared up to this many median spacings: what the largest ball spans.
_REACH = 4.0


def compute_normals(meshset: pymeshlab.MeshSet, *, neighbours: int = 12) -> bool:
    """Give the current layer normals, if it has none, by MeshLab's filter for point sets.

    Parameters
    ----------
    meshset : pymeshlab.MeshSet
    neighbours : int
        How many neighbours the tangent plane of a point is fitted to.

    Returns
    -------
    bool
        Whether normals were computed.
    """
    if current_normals(meshset) is not None:
        return False
    with stage("computing normals for the point set"):
        meshset.compute_normal_for_point_clouds(
            k=neighbours, smoothiter=0, flipflag=False, viewpos=[0.0, 0.0, 0.0]
        )
    return True


def pass_factors(points: npt.ArrayLike) -> tuple[float, ...]:
    """Return the radii of ball-pivoting passes that suit the points, in median spacings.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        In any unit of length.

    Returns
    -------
    tuple of float
        ``PASSES``, or ``IRREGULAR_PASSES`` in clouds of more than 20 000 points as irregular as
        if thrown at random (:func:`meshlab_filter.quality.regularity` below 0.55). Scans are not.

    Examples
    --------
    >>> pass_factors([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    (1.0, 1.5, 2.5, 4.0)
    """
    size = np.shape(points)[0]
    return _factors(size, regularity(points) if size > _MANY else 1.0)


def _factors(size: int, even: float) -> tuple[float, ...]:
    return IRREGULAR_PASSES if size > _MANY and even < _IRREGULAR else PASSES


def seed_order(points: FloatArray) -> IntArray:
    """Return the order in which ball pivoting finds its way about the points best.

    Parameters
    ----------
    points : numpy.ndarray, shape (N, 3)

    Returns
    -------
    numpy.ndarray, shape (N,), int64
        Farthest from the mean first. MeshLab's filter begins at the first point around which a
        triangle faces away from the mean and takes that side for the outside: at the outermost
        points it is, in a leg or under an arm it may not be, and then the ball rolls inside.

    Examples
    --------
    >>> seed_order(np.array([[0.0, 0, 0], [9, 0, 0], [1, 0, 0]])).tolist()
    [1, 0, 2]
    """
    away = np.sum((points - points.mean(axis=0)) ** 2, axis=1)
    return np.argsort(-away, kind="stable")


def reconstruct(
    meshset: pymeshlab.MeshSet,
    *,
    surface: str = "ball-pivoting",
    passes: Sequence[float] | None = None,
    radii: Sequence[float] | None = None,
    coherent: bool = False,
) -> dict[str, object]:
    """Build a surface through the vertices of the current layer.

    Parameters
    ----------
    meshset : pymeshlab.MeshSet
        The current layer is a point set; ball pivoting adds faces to it, Poisson adds a layer and
        makes it current.
    surface : str
        "ball-pivoting": passes of growing radius on the same layer, small enough not to bridge
        gaps and large enough to close the surface. "ball-pivoting-auto": one pass with MeshLab's
        automatic radius, as in the paper. "screened-poisson": a closed surface that need not pass
        through the points. "none": nothing is done.
    passes : sequence of float
        Radii in units of the median spacing of the points, for "ball-pivoting"; by default those
        of :func:`pass_factors`.
    radii : sequence of float, optional
        The radii themselves, in the cloud's unit, instead of passes.
    coherent : bool
        After each pass, let all pieces of the surface face the same way, so that the next pass can
        join them (:func:`meshlab_filter.orientation.orient_coherently`). The layer may be another
        one then, the current one.

    Returns
    -------
    dict
        "surface", "spacing" (in the cloud's unit) and "radii" (in the cloud's unit).

    Raises
    ------
    InvalidCloudError
        If fewer than three points are there, or all lie in one place.
    InvalidParameterError
        If the kind of surface is unknown.
    """
    check_choice(surface, name="surface", choices=SURFACES)
    points = current_points(meshset)
    spacing, even = spacing_and_regularity(points)
    extent = float(np.ptp(points, axis=0).max())
    if 0 < LARGEST_EXTENT * spacing < extent:
        raise InvalidCloudError(
            "Points are too far from the others for MeshLab to measure distances; remove the "
            f"outliers. Given: an extent of {extent:g} at a median spacing of {spacing:g}."
        )
    if surface == "none":
        return {"surface": surface, "spacing": None, "radii": []}
    if len(points) < 3:
        raise InvalidCloudError(
            f"A surface needs at least 3 points. Given: {len(points)} (use --surface none)."
        )
    if spacing == 0:
        raise InvalidCloudError(
            "A surface needs points in different places. Given: a cloud in which most points "
            "share their place with six others."
        )
    compute_normals(meshset)
    pure = import_pymeshlab().PureValue
    used: list[float] = []
    with stage(f"building the surface ({surface})"):
        if surface == "screened-poisson":
            _screened_poisson(meshset)
        elif surface == "ball-pivoting-auto":
            meshset.generate_surface_reconstruction_ball_pivoting(
                ballradius=pure(0), clustering=20, creasethr=90, deletefaces=False
            )
        else:
            passes = _factors(len(points), even) if passes is None else passes
            if not passes or min(passes) <= 0:
                raise InvalidParameterError(
                    f"Invalid passes. Must be positive radii. Given: {list(passes)}."
                )
            used = [factor * spacing for factor in passes] if radii is None else list(radii)
            for radius in used:
                meshset.generate_surface_reconstruction_ball_pivoting(
                    ballradius=pure(radius), clustering=5, creasethr=90, deletefaces=False
                )
                if coherent:
                    _orient(meshset, reach=_REACH * spacing)
    return {"surface": surface, "spacing": spacing, "radii": used}


def _orient(meshset: pymeshlab.MeshSet, *, reach: float) -> None:
    """Turn pieces of the current layer so that they agree, in a layer that takes its place."""
    mesh = meshset.current_mesh()
    faces = np.asarray(mesh.face_matrix(), dtype=np.int64).reshape(-1, 3)
    oriented = orient_coherently(mesh.vertex_matrix(), faces, reach)
    if not (oriented == faces).all():
        before = mesh.id()
        add_layer(
            meshset, mesh.vertex_matrix(), normals=mesh.vertex_normal_matrix(), faces=oriented
        )
        after = meshset.current_mesh_id()
        meshset.set_current_mesh(before)
        meshset.delete_current_mesh()
        meshset.set_current_mesh(after)


def _screened_poisson(meshset: pymeshlab.MeshSet) -> None:
    # One thread: with more, the octree's sums come in another order and the bytes differ.
    meshset.generate_surface_reconstruction_screened_poisson(
        visiblelayer=False, depth=8, fulldepth=5, cgdepth=0, scale=1.1, samplespernode=1.5,
        pointweight=4.0, iters=8, confidence=False, preclean=True, threads=1,
    )  # fmt: skip
