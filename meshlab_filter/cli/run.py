"""``meshlab-filter run``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from .options import method_arguments, method_options


@click.command("run")
@click.argument("source", type=click.Path(path_type=Path), metavar="SCAN")
@click.option("--out", "-o", type=click.Path(path_type=Path), default=Path("result"),
              show_default=True, metavar="FOLDER", help="Where the results go.")  # fmt: skip
@method_options
@click.option("--surface", default="ball-pivoting", show_default=True, metavar="KIND",
              help="ball-pivoting (passes of growing radius), ball-pivoting-auto (one pass, as in "
              "the paper), screened-poisson or none.")  # fmt: skip
@click.option("--no-floor", is_flag=True, help="Do not run the chain on the untouched cloud too.")
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")
def command(
    source: Path,
    out: Path,
    seed: int,
    drop_invalid: bool,
    quiet: bool,
    surface: str,
    no_floor: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Run the whole chain on SCAN: simplify, rebuild the surface, measure the error.

    \b
    Writes to FOLDER: simplified.ply, surface.ply (error near each vertex as
    quality and colour), original.ply (distance of each point as quality),
    project.mlp (all three, for MeshLab) and report.json.

    \b
    Examples:
      meshlab-filter run scan.ply --keep 10% --out result/
      meshlab-filter run scan.ply --delete 7.4% --surface ball-pivoting-auto
    """  # noqa: D301 (click wants the escape itself)
    from ..chain import run
    from .console import progress
    from .summary import show_run

    with progress(quiet) as tell:
        report = run(
            source,
            out,
            seed=seed,
            surface=surface,
            floor=not no_floor,
            drop_invalid=drop_invalid,
            progress=tell,
            **method_arguments(**options),
        )
    if as_json:
        click.echo(json.dumps(report, indent=2))
    elif not quiet:
        show_run(report, out)
