"""``meshlab-filter run``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from .options import (
    as_arguments,
    flags_of,
    given_options,
    method_arguments,
    method_options,
    preset_options,
)

#: What a preset says by itself.
SAID_BY_PRESET = ("method", "count", "keep", "clusters", "delete", "k", "init", "assignments",
                  "keep_representative", "surface", "order", "move", "fit")  # fmt: skip


@click.command("run")
@click.argument("sources", type=click.Path(path_type=Path), nargs=-1, required=True,
                metavar="SCAN...")  # fmt: skip
@click.option("--out", "-o", type=click.Path(path_type=Path), default=Path("result"),
              show_default=True, metavar="FOLDER", help="Where the results go.")  # fmt: skip
@preset_options
@click.option("--jobs", "-j", type=click.IntRange(min=1), metavar="N",
              help="Run N files at a time, each into FOLDER/its name.")  # fmt: skip
@method_options
@click.option("--surface", default="ball-pivoting", show_default=True, metavar="KIND",
              help="ball-pivoting (passes of growing radius), ball-pivoting-auto (one pass, as in "
              "the paper), screened-poisson or none.")  # fmt: skip
@click.option(
    "--order",
    default="points-first",
    show_default=True,
    metavar="ORDER",
    help="points-first: simplify, then build the surface. surface-first: build the surface of the "
    "whole cloud, then collapse its edges (with --count or --keep).",
)
@click.option("--move", is_flag=True, help="surface-first: let points move to lower the error.")
@click.option(
    "--fit/--no-fit",
    default=None,
    help="Mend the surface and flip its edges where that brings it nearer to the original points. "
    "Default: with --surface ball-pivoting only.",
)
@click.option("--no-floor", is_flag=True, help="Do not run the chain on the untouched cloud too.")
@click.option("--no-report", is_flag=True, help="Do not write report.html.")
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")
@click.pass_context
def command(
    ctx: click.Context,
    /,
    sources: tuple[Path, ...],
    out: Path,
    preset: str | None,
    save_preset: Path | None,
    jobs: int | None,
    seed: int,
    drop_invalid: bool,
    quiet: bool,
    surface: str,
    order: str,
    move: bool,
    fit: bool | None,
    no_floor: bool,
    no_report: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Run the whole chain on SCAN: simplify, rebuild the surface, measure the error.

    \b
    Writes to FOLDER: simplified.ply, surface.ply (error near each vertex as
    quality and colour), original.ply (distance of each point as quality),
    project.mlp (all three, for MeshLab), report.json and report.html (views,
    histograms and figures; opens offline). Several scans each get a folder of
    their name in FOLDER; one that fails does not stop the others, and the exit
    code is that of the first that failed.

    \b
    Examples:
      meshlab-filter run scan.ply --keep 10% --out result/
      meshlab-filter run scan.ply --delete 7.4% --surface ball-pivoting-auto
      meshlab-filter run scan.ply --preset bunny
      meshlab-filter run *.ply --preset default --out result/ --jobs 2
    """  # noqa: D301 (click wants the escape itself)
    given = given_options(ctx)
    if preset is not None:
        refuse_with_preset(ctx)
    if len(sources) > 1 or jobs is not None:
        if save_preset is not None:
            raise click.UsageError("--save-preset writes down one run; give one SCAN.")
        arguments = as_arguments(ctx, leave_out=("out", "jobs", "as_json", "quiet"))
        _run_many(ctx, sources, out, arguments, jobs=jobs or 1, quiet=quiet, as_json=as_json)
        return
    from ..chain import run
    from ..recording import check_target, of_report, save
    from .console import can_write_page, progress
    from .summary import show_run

    if save_preset is not None:
        check_target(save_preset)
        if order != "points-first":
            raise click.UsageError("--save-preset cannot write down --order surface-first.")
    html = not no_report and can_write_page(quiet=quiet)
    with progress(quiet) as tell:
        if preset is not None:
            from ..scripted import run_preset

            report = run_preset(
                sources[0],
                out,
                preset,
                seed=seed if "seed" in given else None,
                floor=not no_floor,
                drop_invalid=drop_invalid,
                html=html,
                progress=tell,
            )
        else:
            report = run(
                sources[0],
                out,
                seed=seed,
                surface=surface,
                order=order,
                move=move,
                fit=fit,
                floor=not no_floor,
                drop_invalid=drop_invalid,
                html=html,
                progress=tell,
                **method_arguments(**options),
            )
    if save_preset is not None:
        if preset is not None:
            from ..scripted import seeded

            save(seeded(preset, seed if "seed" in given else None), save_preset)
        else:
            save(of_report(report), save_preset)
    if as_json:
        click.echo(json.dumps(report, indent=2))
    elif not quiet:
        show_run(report, out, page=html)


def refuse_with_preset(ctx: click.Context) -> None:
    """Refuse options that contradict a preset, which is edited rather than overruled."""
    both = flags_of(ctx, given_options(ctx) & set(SAID_BY_PRESET))
    if both:
        raise click.UsageError(
            f"{', '.join(both)} cannot go with --preset, which says that itself; copy and edit "
            "the preset ('meshlab-filter presets copy')."
        )


def _run_many(
    ctx: click.Context,
    sources: tuple[Path, ...],
    out: Path,
    arguments: list[str],
    *,
    jobs: int,
    quiet: bool,
    as_json: bool,
) -> None:
    from ..batch import run_batch
    from .console import progress
    from .summary import show_batch

    with progress(quiet) as tell:
        rows = run_batch(sources, out, arguments, jobs=jobs, progress=tell)
    if as_json:
        listed = [
            {"source": str(row.source), "code": row.code, "message": row.message or None,
             "report": row.report}
            for row in rows
        ]  # fmt: skip
        click.echo(json.dumps(listed, indent=2))
    elif not quiet:
        show_batch(rows)
    failed = [row for row in rows if row.code]
    for row in failed:
        click.echo(f"Error: {row.source}: {row.message}", err=True)
    if failed:
        ctx.exit(failed[0].code if 0 < failed[0].code < 256 else 1)
