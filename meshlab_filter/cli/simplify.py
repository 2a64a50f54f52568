"""``meshlab-filter simplify``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .options import method_arguments, method_options


@click.command("simplify")
@click.argument("source", type=click.Path(path_type=Path), metavar="SCAN")
@click.argument("target", type=click.Path(path_type=Path), metavar="THIN")
@method_options
@click.option("--overwrite", is_flag=True, help="Allow THIN to be SCAN itself.")
def command(
    source: Path,
    target: Path,
    seed: int,
    drop_invalid: bool,
    quiet: bool,
    overwrite: bool,
    **options: Any,
) -> None:
    """Thin the cloud SCAN and write what stays to THIN.

    What stays are points of SCAN, in its order, with all their attributes. Faces are not kept:
    THIN is a cloud; 'run' builds a surface.

    \b
    Examples:
      meshlab-filter simplify scan.ply thin.ply --keep 10%
      meshlab-filter simplify scan.ply thin.ply --count 5000
      meshlab-filter simplify scan.ply thin.ply --clusters 807 --delete 60 --seed 0
    """  # noqa: D301 (click wants the escape itself)
    from ..files import simplify_file
    from .console import progress, show

    with progress(quiet) as tell:
        summary = simplify_file(
            source,
            target,
            seed=seed,
            drop_invalid=drop_invalid,
            overwrite=overwrite,
            progress=tell,
            **method_arguments(**options),
        )
    if not quiet:
        show(*summary.lines())
