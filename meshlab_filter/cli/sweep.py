"""``meshlab-filter sweep``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from ..amounts import parse_amount


class Shares(click.ParamType):  # type: ignore[type-arg,unused-ignore]
    """Percentages with commas between them."""

    name = "percent,percent…"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> list[float]:
        """Parse the text."""
        if isinstance(value, list):
            return value
        found = [parse_amount(text, name="--keep") for text in value.split(",")]
        if not all(isinstance(share, float) for share in found):
            self.fail(f"must be percentages such as 50%,10%. Given: {value}.", param, ctx)
        return [float(share) for share in found]


@click.command("sweep")
@click.argument("source", type=click.Path(path_type=Path), metavar="SCAN")
@click.option("--keep", type=Shares(), default="50%,20%,10%,5%", show_default=True,
              metavar="SHARES", help="The shares of the points to keep.")  # fmt: skip
@click.option("--out", "-o", type=click.Path(path_type=Path), default=Path("sweep-result"),
              show_default=True, metavar="FOLDER", help="Where the results go.")  # fmt: skip
@click.option("--method", metavar="NAME", default="adaptive", show_default=True,
              help="How to choose the points; see 'meshlab-filter methods'.")  # fmt: skip
@click.option("--set", "assignments", multiple=True, metavar="NAME=VALUE",
              help="Set a parameter of the method; may be repeated.")  # fmt: skip
@click.option("--seed", type=int, default=0, show_default=True,
              help="Same input, parameters and seed: same output.")  # fmt: skip
@click.option("--surface", default="ball-pivoting", show_default=True, metavar="KIND",
              help="As for 'run'.")  # fmt: skip
@click.option("--fit/--no-fit", default=None, help="As for 'run'.")
@click.option("--no-floor", is_flag=True, help="Do not run the chain on the untouched cloud too.")
@click.option("--no-report", is_flag=True, help="Do not write sweep.html.")
@click.option("--drop-invalid", is_flag=True, help="Leave out points that are not finite.")
@click.option("--json", "as_json", is_flag=True, help="Print every figure as JSON.")
@click.option("--quiet", "-q", is_flag=True, help="Print nothing but errors.")
def command(
    source: Path,
    keep: list[float],
    out: Path,
    method: str,
    assignments: tuple[str, ...],
    seed: int,
    surface: str,
    fit: bool | None,
    no_floor: bool,
    no_report: bool,
    drop_invalid: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Measure the error of SCAN at several sizes, to choose one.

    The cloud is ranked once, where the method allows it; each size gets its own surface. Writes
    to FOLDER: sweep.json and sweep.html, the curve of error against size, which opens offline.

    \b
    Examples:
      meshlab-filter sweep scan.ply
      meshlab-filter sweep scan.ply --keep 30%,10%,3%,1% --out levels/
    """  # noqa: D301 (click wants the escape itself)
    from ..methods.registry import get_method
    from ..sweep import sweep
    from .console import can_write_page, level_table, progress, show

    html = not no_report and can_write_page(quiet=quiet)
    with progress(quiet) as tell:
        report = sweep(
            source,
            out,
            keep=keep,
            method=method,
            seed=seed,
            surface=surface,
            fit=fit,
            floor=not no_floor,
            drop_invalid=drop_invalid,
            html=html,
            progress=tell,
            **get_method(method).parse(assignments),
        )
    if as_json:
        click.echo(json.dumps(report, indent=2))
    elif not quiet:
        files = "sweep.json and, with the curve, sweep.html" if html else "sweep.json"
        show(level_table(report), f"Written to {out}: {files}.")
