"""The short table at the end of a run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .console import error_table, show

if TYPE_CHECKING:
    from ..batch import BatchRow


#: Which order a run took, and why.
ORDER = {
    "points-first": "Order: points first, so that what stays are points of the scan, chosen "
    "before any surface (--order surface-first for MeshLab's edge collapse)",
    "surface-first": "Order: surface first, as asked: the surface of the whole cloud, its edges "
    "collapsed by MeshLab",
}


def show_run(report: dict[str, Any], out: Path, *, page: bool = False) -> None:
    """Print what came out of a run: counts, surface, errors, where the files are."""
    from ..noise import advice

    points, surface, clusters = report["points"], report["surface"], report["clusters"]
    lines = [
        f"Points: {points['original']} -> {points['simplified']} "
        f"({points['simplified'] / points['original']:.2%}), "
        f"method {report['parameters']['method']}"
    ]
    if points["missed"]:
        lines[0] += f", missed the count asked for by {points['missed']:+d}"
    if clusters["total"] is not None:
        lines.append(f"Clusters: {clusters['deleted']} of {clusters['total']} deleted")
    order = report["parameters"].get("order")
    if order is not None:
        lines.append(ORDER[order])
    if surface["surface"] == "none":
        lines.append("Surface: none; the error is measured to the points that stay")
    else:
        compact = f"{surface['compactness']:.2%}"
        if surface["compactness_before"] is not None:
            compact += f" (before: {surface['compactness_before']:.2%})"
        lines.append(
            f"Surface: {surface['faces']} faces, {surface['holes']} holes, "
            f"{'fitted to the original points, ' if surface['fitted'] else ''}"
            f"compactness 0.6 and above: {compact}"
        )
    if (noise := advice(report["method_info"])) is not None:
        lines.append(noise)
    if report["input"]["dropped"]:
        lines.append(f"Left out: {report['input']['dropped']} points that were not finite")
    if report["input"]["faces"]:
        lines.append(f"Not used: the {report['input']['faces']} faces of the input")
    seconds = sum(report["times"].values())
    show(
        *lines,
        error_table(report["error"]),
        f"Written to {out} in {seconds:.1f} s: open project.mlp in MeshLab; all figures are in "
        f"report.json{' and, with views, in report.html' if page else ''}.",
    )


def show_batch(rows: Sequence[BatchRow]) -> None:
    """Print one line for each file of a batch."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for name in ("file", "points", "left", "faces", "mean error", "max error", "result"):
        numeric = name not in ("file", "result")
        table.add_column(name, justify="right" if numeric else "left", no_wrap=numeric)
    for row in rows:
        if row.report is None:
            table.add_row(str(row.source), "-", "-", "-", "-", "-", f"failed (exit {row.code})")
            continue
        points, error = row.report["points"], row.report["error"]["uncut"]
        table.add_row(
            str(row.source),
            str(points["original"]),
            str(points["simplified"]),
            str(row.report["surface"]["faces"]),
            f"{error['mean']:.3e}",
            f"{error['max']:.3e}",
            str(row.out),
        )
    done = sum(row.report is not None for row in rows)
    show(table, f"{done} of {len(rows)} files done, errors as shares of the diagonal, uncut.")
