"""``meshlab-filter compare``."""

from __future__ import annotations

import json
from pathlib import Path

import click


@click.command("compare")
@click.argument("original", type=click.Path(path_type=Path))
@click.argument("other", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print every figure as JSON.")
@click.option("--drop-invalid", is_flag=True, help="Leave out points that are not finite.")
def command(original: Path, other: Path, as_json: bool, drop_invalid: bool) -> None:
    """Measure the distance from every vertex of ORIGINAL to OTHER, and back.

    Where a file has faces the distance is to its surface, else to its nearest vertex. Figures are
    shares of the diagonal of ORIGINAL's bounding box.
    """
    from ..chain import compare
    from .console import error_table, show

    figures = compare(original, other, drop_invalid=drop_invalid)
    if as_json:
        click.echo(json.dumps(figures, indent=2))
        return
    rows = [
        f"{name}: {figures[key]['points']} points, {figures[key]['faces']} faces"
        for name, key in ((original, "original"), (other, "other"))
    ]
    show(
        *rows,
        f"From {original} to {other}:", error_table(figures["error"]),
        f"From {other} to {original}:", error_table(figures["backward"]),
    )  # fmt: skip
