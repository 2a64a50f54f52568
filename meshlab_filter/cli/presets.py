"""``meshlab-filter presets``."""

from __future__ import annotations

from pathlib import Path

import click


@click.group("presets")
def command() -> None:
    """List, show and copy the ready filter scripts."""


@command.command("list")
def list_presets() -> None:
    """List the presets, with what the paper reports."""
    from rich import box
    from rich.table import Table

    from ..presets import PRESETS
    from .console import show

    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column("preset", no_wrap=True)
    table.add_column("for")
    table.add_column("the paper: points left", justify="right")
    for preset in PRESETS.values():
        paper = preset.published
        table.add_row(
            preset.name, preset.title, f"{paper.left} of {paper.points}" if paper else "-"
        )
    show(table)


@command.command("show")
@click.argument("preset", metavar="NAME|FILE")
@click.option("--xml", is_flag=True, help="Print the file itself.")
def show_preset(preset: str, xml: bool) -> None:
    """Show what each filter of a preset, or of any .mlx file, will do."""
    from ..explain import explain
    from ..presets import find, open_script
    from .console import show

    script = open_script(preset)
    if xml:
        click.echo(find(preset).read_text(encoding="utf-8"), nl=False)
        return
    show(*explain(script))


@command.command("copy")
@click.argument("names", nargs=-1, metavar="[NAME]...")
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--overwrite", is_flag=True, help="Replace files of the same name.")
def copy_presets(names: tuple[str, ...], folder: Path, overwrite: bool) -> None:
    """Copy presets (all, if no NAME is given) to FOLDER, to open or edit them in MeshLab."""
    from ..presets import copy
    from .console import show

    show(*(str(path) for path in copy(names, folder, overwrite=overwrite)))
