"""``meshlab-filter simplify``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .options import given_options, method_arguments, method_options, preset_options


@click.command("simplify")
@click.argument("source", type=click.Path(path_type=Path), metavar="SCAN")
@click.argument("target", type=click.Path(path_type=Path), metavar="THIN")
@preset_options
@method_options
@click.option("--overwrite", is_flag=True, help="Allow THIN to be SCAN itself.")
@click.pass_context
def command(
    ctx: click.Context,
    /,
    source: Path,
    target: Path,
    preset: str | None,
    save_preset: Path | None,
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
      meshlab-filter simplify scan.ply thin.ply --preset my.mlx
    """  # noqa: D301 (click wants the escape itself)
    from ..files import simplify_file
    from ..recording import check_target, of_summary, save
    from .console import progress, show
    from .run import refuse_with_preset

    given = given_options(ctx)
    if save_preset is not None:
        check_target(save_preset)
    with progress(quiet) as tell:
        if preset is not None:
            from ..scripted import simplify_preset

            refuse_with_preset(given)
            summary = simplify_preset(
                source,
                target,
                preset,
                seed=seed if "seed" in given else None,
                drop_invalid=drop_invalid,
                overwrite=overwrite,
                progress=tell,
            )
        else:
            summary = simplify_file(
                source,
                target,
                seed=seed,
                drop_invalid=drop_invalid,
                overwrite=overwrite,
                progress=tell,
                **method_arguments(**options),
            )
    if save_preset is not None:
        if preset is not None:
            from ..scripted import seeded

            save(seeded(preset, seed if "seed" in given else None), save_preset)
        else:
            save(of_summary(summary), save_preset)
    if not quiet:
        show(*summary.lines())
