"""``meshlab-filter demo``."""

from __future__ import annotations

from pathlib import Path

import click


@click.command("demo")
@click.option("--out", "-o", type=click.Path(path_type=Path), default=Path("demo-result"),
              show_default=True, metavar="FOLDER", help="Where the results go.")  # fmt: skip
@click.option("--quiet", "-q", is_flag=True, help="Print nothing but errors.")
def command(out: Path, quiet: bool) -> None:
    """Run the whole chain on the bunny inside pymeshlab's wheel: no file, no network.

    The paper's rule deletes 7.4 % of the clusters, as for its Bunny; then the same number of
    points is kept by our own method.
    """
    from ..bridge.samples import sample_mesh
    from ..chain import run
    from .console import can_write_page, progress, show
    from .summary import show_run

    bunny = sample_mesh("bunny.obj")
    html = can_write_page(quiet=quiet)
    with progress(quiet) as tell:
        paper = run(bunny, out / "paper", html=html, progress=tell)
        kept = paper["points"]["simplified"]
        ours = run(bunny, out / "adaptive", count=kept, html=html, progress=tell)
    if not quiet:
        show("The rule of the paper:")
        show_run(paper, out / "paper", page=html)
        show("", "The same number of points, chosen one by one:")
        show_run(ours, out / "adaptive", page=html)
