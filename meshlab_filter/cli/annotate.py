"""``meshlab-filter annotate``."""

from __future__ import annotations

from pathlib import Path

import click

#: The preset for any cloud, by the method it ranks with.
PRESET_OF = {"adaptive": "adaptive", "cluster-entropy": "default"}


@click.command("annotate")
@click.argument("source", type=click.Path(path_type=Path), metavar="SCAN")
@click.argument("target", type=click.Path(path_type=Path), metavar="ANNOTATED")
@click.option("--preset", "-p", metavar="NAME|FILE",
              help="A preset, or a filter script with its own <?meshlab-filter …?>: it says how "
              "to rank. Default: default, the rule of the paper.")  # fmt: skip
@click.option("--method", type=click.Choice(list(PRESET_OF)),
              help="Instead: the method, as the preset for any cloud has it.")  # fmt: skip
@click.option("--fit", "script", type=click.Path(path_type=Path), metavar="FILE.mlx",
              help="Also write a copy of the preset with the ball radii and the cut-off of the "
              "errors computed for this cloud.")  # fmt: skip
@click.option("--color/--no-color", default=None,
              help="Colour by entropy. Default: only if SCAN has no colours.")  # fmt: skip
@click.option("--seed", type=int, help="Instead of the preset's seed.")
@click.option("--drop-invalid", is_flag=True, help="Leave out points that are not finite.")
@click.option("--overwrite", is_flag=True, help="Allow ANNOTATED to be SCAN, and replace FILE.mlx.")
@click.option("--quiet", "-q", is_flag=True, help="Print nothing but errors.")
def command(
    source: Path,
    target: Path,
    preset: str | None,
    method: str | None,
    script: Path | None,
    color: bool | None,
    seed: int | None,
    drop_invalid: bool,
    overwrite: bool,
    quiet: bool,
) -> None:
    """Write SCAN with the rank of every point as quality, so that MeshLab can cut it anywhere.

    Open ANNOTATED (.ply) in MeshLab, then Filters > Show current filter script > Open Script, and
    apply the preset: its condition (q < 60) deletes what ranks below 60. Another number there is
    another level of detail, with nothing computed again.

    \b
    Examples:
      meshlab-filter annotate scan.ply annotated.ply --preset bunny --fit annotated.mlx
      meshlab-filter annotate scan.ply annotated.ply --method adaptive
    """  # noqa: D301 (click wants the escape itself)
    if preset is not None and method is not None:
        raise click.UsageError("--preset says the method; give one of --preset and --method.")
    from ..annotation import annotate_file
    from .console import progress, show

    with progress(quiet) as tell:
        done = annotate_file(
            source,
            target,
            preset=preset or PRESET_OF[method or "cluster-entropy"],
            script=script,
            color=color,
            seed=seed,
            drop_invalid=drop_invalid,
            overwrite=overwrite,
            progress=tell,
        )
    if quiet:
        return
    colored = f"coloured by {done.colored}" if done.colored else "with its own colours"
    ends = f"{done.lowest:.6g} to {done.highest:.6g}"
    lines = [f"{done.target}: {done.points} points with quality {ends}, {colored}."]
    if done.left is not None:
        lines.append(f"The preset's own cut leaves {done.left} points.")
    if done.script is not None:
        lines.append(f"{done.script}: the preset with radii and cut-off for this cloud.")
    show(*lines)
