"""Writing down what a run did, as a filter script that does it again."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .errors import OutputError
from .files import FileSummary
from .methods.registry import get_method
from .mlx import FilterScript, write
from .outputs import writing
from .recipe import Recipe
from .steps import record


def of_report(report: Mapping[str, Any]) -> FilterScript:
    """Return the script that does again what :func:`meshlab_filter.run` did.

    Parameters
    ----------
    report : mapping
        What it returned.
    """
    given, surface = report["parameters"], report["surface"]
    recipe = _recipe(
        given, asked=given["asked"], center=True, normals="layer", fit=surface["fitted"]
    )
    return record(
        recipe,
        threshold=report["points"]["threshold"],
        surface=given["surface"],
        radii=surface["radii"],
        measured=True,
        comment=_comment(recipe, report["points"]["original"], report["points"]["simplified"]),
    )


def of_summary(summary: FileSummary) -> FilterScript:
    """Return the script that does again what ``simplify_file`` did."""
    result = summary.result
    given = {"method": result.method, **result.parameters}
    recipe = _recipe(given, asked=result.asked, center=False, normals="file", fit=False)
    comment = _comment(recipe, len(summary.cloud.points), len(result.indices))
    return record(recipe, threshold=result.threshold, comment=comment)


def save(script: FilterScript, path: str | os.PathLike[str]) -> None:
    """Write a script whole or not at all.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    check_target(path)
    with writing(path) as partial:
        write(script, partial)


def check_target(path: str | os.PathLike[str]) -> None:
    """Check that a script can be written there.

    Raises
    ------
    OutputError
        If the name does not end in .mlx or the folder does not exist.
    """
    target = Path(path)
    if target.suffix.lower() != ".mlx":
        raise OutputError(f"A filter script must be a .mlx file. Given: {target}.")
    if not target.parent.is_dir():
        raise OutputError(f"The output's folder does not exist. Given: {target}.")


def _recipe(
    given: Mapping[str, Any], *, asked: int | None, center: bool, normals: str, fit: bool
) -> Recipe:
    method = get_method(given["method"])
    names = [parameter.name for parameter in method.parameters]
    return Recipe(
        method=method.name,
        parameters={name: given[name] for name in names if given.get(name) is not None},
        count=asked,
        seed=given["seed"],
        center=center,
        fit=fit,
        normals=normals if method.uses_normals else "layer",
    )


def _comment(recipe: Recipe, before: int, after: int) -> str:
    text = (
        f"What meshlab-filter did to a cloud of {before} points, of which {after} are left. "
        "Lengths in here fit that cloud only."
    )
    if not get_method(recipe.method).seeded:
        text += f" The method {recipe.method} has no seed, so its points differ from run to run."
    return text
