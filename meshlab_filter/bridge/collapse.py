"""Surface first: rebuild the surface of the whole cloud, then collapse its edges."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import MeshLabError
from ..validation import check_integer
from .session import stage

if TYPE_CHECKING:
    import pymeshlab


def collapse(meshset: pymeshlab.MeshSet, count: int, *, move: bool = False) -> None:
    """Collapse edges of the current layer until at most ``count`` vertices are left.

    MeshLab's quadric edge collapse takes a number of faces. On a surface a collapse takes one
    vertex and two faces, at a border one of each, so the number of vertices is approached from
    above, in ever smaller steps.

    Parameters
    ----------
    meshset : pymeshlab.MeshSet
        The current layer has faces; vertices without one are removed.
    count : int
        Vertices asked for. As a rule exactly as many stay; a last collapse that takes several
        vertices at once can leave a few fewer.
    move : bool
        Put each vertex where the error is least, instead of leaving original points in place.

    Raises
    ------
    MeshLabError
        If the surface cannot be collapsed so far.

    References
    ----------
    M. Garland, P. S. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH
    1997.
    """
    check_integer(count, name="count", minimum=4)
    with stage("collapsing the edges of the surface"):
        meshset.meshing_remove_unreferenced_vertices()
        while (excess := meshset.current_mesh().vertex_number() - count) > 0:
            faces = meshset.current_mesh().face_number()
            # One vertex may cost two faces at the most, so half of what that would allow is safe
            # from overshooting until single collapses are left.
            target = faces - max(2, excess)
            _collapse_to(meshset, target, move=move)
            if meshset.current_mesh().face_number() >= faces:
                raise MeshLabError(
                    f"MeshLab cannot collapse the surface below "
                    f"{meshset.current_mesh().vertex_number()} points. Given: count={count}."
                )


def _collapse_to(meshset: pymeshlab.MeshSet, faces: int, *, move: bool) -> None:
    meshset.meshing_decimation_quadric_edge_collapse(
        targetfacenum=max(faces, 4), targetperc=0, qualitythr=0.3, preserveboundary=True,
        boundaryweight=1, preservenormal=False, preservetopology=False, optimalplacement=move,
        planarquadric=False, planarweight=0.001, qualityweight=False, autoclean=True,
        selected=False,
    )  # fmt: skip
    meshset.meshing_remove_unreferenced_vertices()
