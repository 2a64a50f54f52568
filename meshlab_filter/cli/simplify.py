"""``meshlab-filter simplify``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..amounts import parse_count
from .options import flags_of, given_options, method_arguments, method_options, preset_options


@click.command("simplify")
@click.argument("source", type=click.Path(path_type=Path), metavar="SCAN")
@click.argument("target", type=click.Path(path_type=Path), metavar="THIN")
@preset_options
@method_options
@click.option(
    "--tiles",
    metavar="N|auto",
    help="Work on a LAS file tile by tile, in bounded memory; auto takes a million points a tile.",
)
@click.option(
    "--scheduler",
    metavar="WHERE",
    help="With --tiles: threads, processes, or the address of "
    "a Dask scheduler such as tcp://host:8786. Default: threads.",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="With --tiles: threads or processes at a time. Default: one a core.",
)
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
    tiles: str | None,
    scheduler: str | None,
    workers: int | None,
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
      meshlab-filter simplify big.laz thin.laz --keep 5% --tiles auto
    """  # noqa: D301 (click wants the escape itself)
    given = given_options(ctx)
    if tiles is None and given & {"scheduler", "workers"}:
        raise click.UsageError("--scheduler and --workers go with --tiles.")
    if tiles is not None:
        if barred := flags_of(ctx, given & {"preset", "save_preset", "drop_invalid"}):
            raise click.UsageError(f"{barred[0]} cannot go with --tiles.")
        _simplify_tiles(
            source, target, tiles, seed=seed, overwrite=overwrite, quiet=quiet,
            scheduler=scheduler, workers=workers, **method_arguments(**options),
        )  # fmt: skip
        return
    from ..files import simplify_file
    from ..recording import check_target, of_summary, save
    from .console import progress, show
    from .run import refuse_with_preset

    if save_preset is not None:
        check_target(save_preset)
    with progress(quiet) as tell:
        if preset is not None:
            from ..scripted import simplify_preset

            refuse_with_preset(ctx)
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


def _simplify_tiles(source: Path, target: Path, tiles: str, *, quiet: bool, **options: Any) -> None:
    from ..distributed import simplify_tiles
    from .console import progress, show

    def announce(address: str) -> None:
        if not quiet:
            click.echo(f"Dask's dashboard: {address}", err=True)

    with progress(quiet) as tell:
        report = simplify_tiles(
            source, target, tiles=tiles if tiles == "auto" else parse_count(tiles, name="--tiles"),
            progress=tell, announce=announce, **options,
        )  # fmt: skip
    if quiet:
        return
    points, clusters = report["points"], report.get("clusters")
    show(
        f"{target}: kept {points['simplified']} of {points['original']} points "
        f"({points['simplified'] / points['original']:.2%}), method "
        f"{report['parameters']['method']}, {report['tiles']} tiles."
    )
    if clusters:
        show(f"Deleted {clusters['deleted']} of {clusters['total']} clusters.")
    if report["missed"]:
        show(
            f"Missed the count asked for by {report['missed']:+d}, as near as whole clusters come."
        )
