"""The steps that presets are made of, as filters of MeshLab."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from .mlx import Filter, FilterScript, Param, format_number
from .quality import PAPER_CUT
from .recipe import Recipe

#: No distance is farther, so nothing is cut off.
FAR = 1e30

_CUT = re.compile(r"\s*\(?\s*q\s*<\s*(?P<cut>\d+\.?\d*)\s*\)?\s*")
_BALL_PIVOTING = "Surface Reconstruction: Ball Pivoting"
_HAUSDORFF = "Hausdorff Distance"


def thinning(cut: float) -> tuple[Filter, ...]:
    """Return the filters that copy the layer and delete what ranks below the cut."""
    condition = f"(q < {format_number(cut)})"
    return (
        Filter("Duplicate Current layer"),
        Filter("Conditional Vertex Selection", _params(condSelect=("RichString", condition))),
        Filter("Delete Selected Vertices"),
    )


def point_normals() -> Filter:
    """Return the filter that estimates normals from 12 neighbours."""
    return Filter(
        "Compute normals for point sets",
        _params(
            K=("RichInt", 12),
            smoothIter=("RichInt", 0),
            flipFlag=("RichBool", False),
            viewPos=("RichPoint3f", (0.0, 0.0, 0.0)),
        ),
    )


def ball_pivoting(
    radius: float = 0.0, *, clustering: float = 5.0, largest: float = 100.0
) -> Filter:
    """Return a pass of ball pivoting.

    Parameters
    ----------
    radius : float
        In the unit of the coordinates; 0 lets MeshLab choose it.
    clustering : float
        Per cent of the radius under which vertices count as one. MeshLab's own 20 ends MeshLab
        2020.09 on some clouds, and lets rounding change more faces.
    largest : float
        The end of MeshLab's scale for the radius.
    """
    return Filter(
        _BALL_PIVOTING,
        (
            Param(name="BallRadius", type="RichAbsPerc", value=float(radius), minimum=0.0,
                  maximum=float(max(largest, radius))),
            *_params(
                Clustering=("RichFloat", float(clustering)),
                CreaseThr=("RichFloat", 90.0),
                DeleteFaces=("RichBool", False),
            ),
        ),
    )  # fmt: skip


def screened_poisson() -> Filter:
    """Return Poisson reconstruction as `meshlab_filter.run` does it; it makes a layer."""
    return Filter(
        "Surface Reconstruction: Screened Poisson",
        _params(
            visibleLayer=("RichBool", False), depth=("RichInt", 8), fullDepth=("RichInt", 5),
            cgDepth=("RichInt", 0), scale=("RichFloat", 1.1), samplesPerNode=("RichFloat", 1.5),
            pointWeight=("RichFloat", 4.0), iters=("RichInt", 8), confidence=("RichBool", False),
            preClean=("RichBool", True), threads=("RichInt", 1),
        ),
    )  # fmt: skip


def hausdorff(*, sampled: int = 0, target: int = 1, cut: float = FAR) -> Filter:
    """Return the filter that measures every vertex of one layer against another layer."""
    return Filter(
        _HAUSDORFF,
        (
            *_params(
                SampledMesh=("RichMesh", sampled),
                TargetMesh=("RichMesh", target),
                SaveSample=("RichBool", False),
                SampleVert=("RichBool", True),
                SampleEdge=("RichBool", False),
                SampleFauxEdge=("RichBool", False),
                SampleFace=("RichBool", False),
                SampleNum=("RichInt", 10_000_000),
            ),
            Param(name="MaxDist", type="RichAbsPerc", value=cut, minimum=0.0, maximum=FAR),
        ),
    )


def record(
    recipe: Recipe,
    *,
    threshold: float,
    surface: str = "none",
    radii: Sequence[float] = (),
    measured: bool = False,
    comment: str = "",
) -> FilterScript:
    """Return the script that does again what a run did.

    Parameters
    ----------
    recipe : Recipe
        How the cloud was ranked.
    threshold : float
        Points whose quality is below went.
    surface : str
        As in :func:`meshlab_filter.bridge.surface.reconstruct`.
    radii : sequence of float
        Of the passes, for "ball-pivoting".
    measured : bool
        Whether the error was measured.
    comment : str
        What the file says about itself.

    Examples
    --------
    >>> [f.name for f in record(Recipe(), threshold=60)]
    ['Duplicate Current layer', 'Conditional Vertex Selection', 'Delete Selected Vertices']
    """
    filters = list(thinning(threshold))
    if surface != "none":
        # MeshLab 2020.09 leaves holes where vertices were deleted, on which ball pivoting crashes;
        # a copy has none.
        filters.append(filters[0])
    if surface == "ball-pivoting":
        filters += [ball_pivoting(radius) for radius in radii]
    elif surface == "ball-pivoting-auto":
        filters.append(ball_pivoting(clustering=20))
    elif surface == "screened-poisson":
        filters.append(screened_poisson())
    if measured:
        made = {"none": 1, "screened-poisson": 3}.get(surface, 2)
        filters.append(hausdorff(target=made))
    return FilterScript(tuple(filters), recipe.instruction(), comment)


def untouched(script: FilterScript) -> FilterScript | None:
    """Return the script without the deletion in it, None if it does not thin as presets do.

    Examples
    --------
    >>> [f.name for f in untouched(record(Recipe(), threshold=60))]
    ['Duplicate Current layer']
    """
    names = [filter_.name for filter_ in script]
    pattern = [filter_.name for filter_ in thinning(0)]
    if names[: len(pattern)] != pattern:
        return None
    return replace(script, filters=(script.filters[0], *script.filters[len(pattern) :]))


def cut_of(script: FilterScript) -> float | None:
    """Return the number that the script's first condition compares the quality with.

    Examples
    --------
    >>> cut_of(record(Recipe(), threshold=60))
    60.0
    """
    for filter_ in script:
        condition = filter_.values().get("condSelect")
        if isinstance(condition, str):
            found = _CUT.fullmatch(condition)
            return float(found["cut"]) if found else None
    return None


def radii_of(script: FilterScript) -> list[float]:
    """Return the radii of a script's passes of ball pivoting, if they are as ``run`` makes them.

    Parameters
    ----------
    script : FilterScript

    Returns
    -------
    list of float
        In the unit of the coordinates; empty if there are none, or if MeshLab is to choose one or
        another parameter is not that of :func:`ball_pivoting`.

    Examples
    --------
    >>> radii_of(FilterScript((ball_pivoting(0.5), ball_pivoting(0.75))))
    [0.5, 0.75]
    >>> radii_of(FilterScript((ball_pivoting(),)))
    []
    """
    passes = [filter_ for filter_ in script if filter_.name == _BALL_PIVOTING]
    values = [filter_.values().get("BallRadius") for filter_ in passes]
    radii = [float(radius) if isinstance(radius, (int, float)) else 0.0 for radius in values]
    ours = [ball_pivoting(radius).values() for radius in radii]
    same = all(filter_.values() == own for filter_, own in zip(passes, ours))
    return radii if same and all(radii) else []


def fit(script: FilterScript, *, radii: Sequence[float], diagonal: float) -> FilterScript:
    """Return the script with the lengths in it made for one cloud.

    Parameters
    ----------
    script : FilterScript
    radii : sequence of float
        Of the passes of ball pivoting that take the place of one with the automatic radius.
    diagonal : float
        Of the cloud's bounding box. The Hausdorff filter is cut off at 1 % of it, as in the paper.

    Examples
    --------
    >>> from meshlab_filter.presets import PRESETS
    >>> fitted = fit(PRESETS["bunny"].script(), radii=[1, 1.5], diagonal=160)
    >>> [f["BallRadius"].value for f in fitted if f.name == "Surface Reconstruction: Ball Pivoting"]
    [1.0, 1.5]
    >>> fitted.filters[-1]["MaxDist"].value
    1.6
    """
    filters: list[Filter] = []
    for filter_ in script:
        values = filter_.values()
        if filter_.name == _BALL_PIVOTING and values.get("BallRadius") == 0:
            filters += [ball_pivoting(radius, largest=diagonal) for radius in radii]
        elif filter_.name == _HAUSDORFF:
            cut = replace(filter_["MaxDist"], value=PAPER_CUT * diagonal, maximum=float(diagonal))
            kept = tuple(cut if p.name == "MaxDist" else p for p in filter_.params)
            filters.append(replace(filter_, params=kept))
        else:
            filters.append(filter_)
    return replace(script, filters=tuple(filters))


def _params(**params: tuple[str, Any]) -> tuple[Param, ...]:
    return tuple(
        Param(name=name, type=type_, value=value) for name, (type_, value) in params.items()
    )
