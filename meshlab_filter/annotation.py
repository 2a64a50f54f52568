"""Clouds with the rank of every point as quality: each level of detail is one number in MeshLab."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .bridge.surface import pass_factors
from .cloud import Cloud, check_readable, check_writable, write_cloud
from .colormap import colorize
from .errors import OutputError, PresetError
from .measure import prepare
from .methods.ranking import Ranking
from .mlx import FilterScript, write
from .outputs import writing
from .plycloud import PlyRecords
from .presets import open_script
from .provenance import comments, fingerprint, versions
from .quality import median_spacing
from .recipe import QUALITIES, Recipe
from .steps import cut_of, fit
from .stopwatch import Stopwatch
from .validation import FloatArray


@dataclass(frozen=True, kw_only=True)
class Annotation:
    """What annotating a file came to.

    Attributes
    ----------
    target : Path
    script : Path or None
        The fitted copy of the preset.
    points : int
    left : int or None
        Points that the preset's own cut leaves, if it has one.
    lowest, highest : float
        The ends of the quality.
    colored : str
        "entropy", "rank", or "" if the cloud kept its own colours.
    """

    target: Path
    script: Path | None
    points: int
    left: int | None
    lowest: float
    highest: float
    colored: str


def annotate_file(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    *,
    preset: str | os.PathLike[str] | FilterScript = "default",
    script: str | os.PathLike[str] | None = None,
    color: bool | None = None,
    seed: int | None = None,
    drop_invalid: bool = False,
    overwrite: bool = False,
    progress: Any = None,
) -> Annotation:
    """Write a cloud with the rank of every point as quality, and normals.

    Parameters
    ----------
    source : path-like
    target : path-like
        A .ply file, the format whose quality MeshLab reads; binary. Of a scan in binary PLY it
        keeps every property (one named as what is added here becomes ``input_…``), of any other
        coordinates, normals and colours.
    preset : str, path or FilterScript
        Its instruction says how the points are ranked.
    script : path-like, optional
        Write here a copy of the preset with the radii of ball pivoting and the cut-off of the
        errors computed for this cloud.
    color : bool, optional
        Colour the points by the entropy of their cluster, or by rank for methods without
        entropy. By default only if the cloud has no colours.
    seed : int, optional
        Instead of the seed in the instruction.
    drop_invalid : bool
        Leave out points with NaN or infinite coordinates instead of refusing the file.
    overwrite : bool
        Allow the target to be the source, and replace a script that exists.
    progress : callable, optional

    Returns
    -------
    Annotation

    Raises
    ------
    PresetError
        If the preset has no instruction.
    MeshlabFilterError
        Another subclass, with one sentence. Nothing is written then.
    """
    tell = progress or (lambda stage, share: None)
    read = open_script(preset)
    if read.instruction is None:
        raise PresetError(
            "The filter script has no instruction <?meshlab-filter …?>, so it does not say how to "
            f"rank a cloud. Given: {read.source}."
        )
    recipe = Recipe.of(read.instruction, source=read.source)
    recipe = recipe if seed is None else replace(recipe, seed=seed)
    source, target = check_readable(source), check_writable(target)
    if target.suffix.lower() != ".ply":
        raise OutputError(f"An annotated cloud must be a .ply file. Given: {target}.")
    if script is not None and Path(script).exists() and not overwrite:
        raise OutputError(f"The preset's copy exists; pass --overwrite. Given: {script}.")
    scan = prepare(source, drop_invalid=drop_invalid, watch=Stopwatch(lambda s: tell(s, None)))
    normals = scan.normals if recipe.normals == "layer" else scan.cloud.normals
    ranking = recipe.rank(
        scan.cloud.points, normals=normals, progress=lambda share: tell("rank", share)
    )
    tell("write", None)
    values = recipe.values(ranking)
    columns: dict[str, npt.NDArray[Any]] = {"quality": values}
    if scan.estimated:
        columns |= {f"n{axis}": scan.normals[:, i] for i, axis in enumerate("xyz")}
    colored = ""
    if color or (color is None and scan.cloud.colors is None):
        colored, colors = _colors(ranking)
        names = ("red", "green", "blue")
        columns |= {name: colors[:, i] for i, name in enumerate(names)}
    cut = cut_of(read)
    kept = np.ones(len(values), dtype=bool) if cut is None else values >= cut
    lines = comments(
        {
            "input": fingerprint(source),
            "parameters": {"preset": read.source, **recipe.instruction().options},
            "versions": versions(),
        }
    )
    lines.append(f"quality is the {QUALITIES[recipe.quality]} of the point, low goes first")
    if colored:
        lines.append(f"colour is the {colored}, dark is low")
    fitted = None
    if script is not None:
        if kept.sum() < 7:
            raise PresetError(
                f"The preset's cut leaves too few points to fit its radii to. Given: {cut:g}, "
                f"which leaves {kept.sum()}."
            )
        left = scan.cloud.points[kept]
        spacing = median_spacing(left)
        fitted = fit(
            replace(read, instruction=recipe.instruction()),
            radii=[factor * spacing for factor in pass_factors(left)],
            diagonal=scan.cloud.diagonal,
        )
    write_cloud(_binary(scan.cloud), target, comments=lines, extra=columns, overwrite=overwrite)
    if fitted is not None and script is not None:
        with writing(script) as partial:
            write(fitted, partial)
    return Annotation(
        target=target,
        script=None if script is None else Path(script),
        points=len(values),
        left=None if cut is None else int(kept.sum()),
        lowest=float(values.min()),
        highest=float(values.max()),
        colored=colored,
    )


def _binary(cloud: Cloud) -> Cloud:
    """Return the cloud such that it is written in binary.

    MeshLab's reader of text rounds the last digit of a coordinate differently from everyone else.
    """
    if isinstance(cloud.records, PlyRecords) and not cloud.records.header.order:
        return replace(cloud, records=None)
    return cloud


def _colors(ranking: Ranking) -> tuple[str, npt.NDArray[np.uint8]]:
    """Return what the colour shows, and red, green and blue of every point."""
    shown: FloatArray
    if ranking.entropy is not None and ranking.labels is not None:
        name, shown = "entropy", ranking.entropy[ranking.labels]
    else:
        name, shown = "rank", ranking.rank.astype(np.float64)
    # A cluster of one point has no entropy; it is never deleted, so it shows as the highest.
    finite = shown[np.isfinite(shown)]
    low, high = np.percentile(finite, [1, 99]) if len(finite) else (0.0, 1.0)
    filled = np.where(np.isfinite(shown), shown, high)
    colors = colorize(filled, low=float(low), high=float(high))
    return name, np.rint(255 * colors[:, :3]).astype(np.uint8)
