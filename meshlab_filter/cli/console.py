"""What the commands print: progress on stderr, results on stdout."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rich.table import Table

Progress = Callable[[str, "float | None"], object]


@contextmanager
def progress(quiet: bool) -> Iterator[Progress]:
    """Show the stage at work, and its share where known, as long as it lasts; terminals only."""
    from rich.console import Console
    from rich.progress import BarColumn, SpinnerColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield lambda stage, share: None
        return
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Bars(*columns, console=console, transient=True) as bars:
        task = bars.add_task("starting", total=None)
        current = ""

        def tell(stage: str, share: float | None) -> None:
            nonlocal current
            if stage != current:
                current = stage
                bars.reset(task, description=stage, total=None)
            if share is not None:
                bars.update(task, total=1.0, completed=share)

        yield tell


def show(*tables: Table | str) -> None:
    """Print tables and lines to stdout."""
    from rich.console import Console

    console = Console(highlight=False, soft_wrap=True)
    console.width = max(console.width, 88)
    with console.capture() as capture:
        for table in tables:
            console.print(table, markup=False) if isinstance(table, str) else console.print(table)
    click.echo(capture.get(), nl=False)


def error_table(error: dict[str, Any]) -> Table:
    """Return the table of errors of a report."""
    from rich import box
    from rich.table import Table

    from ..report import error_rows

    table = Table(
        title="Error of the original points, as a share of the bounding box's diagonal",
        title_justify="left",
        title_style="",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    table.add_column("", no_wrap=True)
    for name in ("mean", "RMS", "p95", "p99", "max", "samples", "dropped"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in error_rows(error):
        table.add_row(*row)
    return table


def level_table(report: dict[str, Any]) -> Table:
    """Return the table of a sweep, one row a level."""
    from rich import box
    from rich.table import Table

    table = Table(
        title="Error of the original points (uncut), as a share of the bounding box's diagonal",
        title_justify="left",
        title_style="",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    for name in ("kept", "points", "mean", "RMS", "p99", "max", "faces", "holes"):
        table.add_column(name, justify="right", no_wrap=True)
    for level in report["levels"]:
        error, surface = level["error"]["uncut"], level["surface"]
        table.add_row(
            f"{100 * level['keep']:.4g} %",
            str(level["points"]["simplified"]),
            *(f"{error[name]:.2e}" for name in ("mean", "rms", "p99", "max")),
            str(surface["faces"]),
            str(surface["holes"]),
        )
    if report["floor"] is not None:
        floor = report["floor"]["uncut"]
        total = str(report["levels"][0]["points"]["original"])
        figures = (f"{floor[name]:.2e}" for name in ("mean", "rms", "p99", "max"))
        table.add_row("floor", total, *figures, "", "")
    return table


def can_write_page(*, quiet: bool) -> bool:
    """Tell whether the HTML report can be written; if not, say how to install what it needs."""
    from ..htmlreport import INSTALL, missing

    absent = missing()
    if absent and not quiet:
        import click

        click.echo(f"No report.html: it needs {' and '.join(absent)}; {INSTALL}", err=True)
    return not absent
