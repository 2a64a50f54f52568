"""The same cloud at several levels of detail: error against size."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from .amounts import points_to_keep
from .cloud import check_readable
from .errors import InvalidParameterError, OutputError
from .htmlreport import check_html, render
from .measure import Outcome, Scan, figures, measure, prepare
from .methods.registry import get_method
from .outputs import writing_folder
from .provenance import fingerprint, versions
from .report import SCHEMA_VERSION, write_report
from .simplification import CLUSTER_METHOD, COUNT_METHOD, Simplification, simplify
from .stopwatch import Stopwatch

FILES = ("sweep.json", "sweep.html")


def sweep(
    path: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    keep: Sequence[float],
    method: str = COUNT_METHOD,
    seed: int = 0,
    surface: str = "ball-pivoting",
    fit: bool | None = None,
    floor: bool = True,
    drop_invalid: bool = False,
    html: bool = False,
    progress: Callable[[str, float | None], object] | None = None,
    **parameters: Any,
) -> dict[str, Any]:
    """Measure the error of a cloud at several sizes, to choose one.

    The cloud is ranked once where the levels of the method nest, as those of "adaptive" and
    "cluster-entropy" do: each level is then the one that a run of its own would give.

    Parameters
    ----------
    path : path-like
        The cloud, or a mesh whose vertices are the cloud.
    out : path-like, optional
        Folder for ``sweep.json`` and, if asked for, ``sweep.html``.
    keep : sequence of float
        The shares of the points to keep, each above 0 and up to 1.
    method, seed, **parameters
        As for :func:`meshlab_filter.simplify`.
    surface, fit, floor, drop_invalid
        As for :func:`meshlab_filter.run`; the floor is measured once.
    html : bool
        Also write ``sweep.html``: the curve and the table.
    progress : callable, optional
        Called with a stage and the share of it done, None where that is not known.

    Returns
    -------
    dict
        "levels": for each share, the largest first, "keep" and what ``report.json`` says of the
        "points", the "surface" and the "error"; "floor": the error of the untouched cloud, or
        None; "input", "parameters", "versions", "normals", "diagonal" and "times".

    Raises
    ------
    MeshlabFilterError
        A subclass, with one sentence that says what is wrong. Nothing is written then.

    Examples
    --------
    >>> from meshlab_filter.bridge.samples import sample_mesh
    >>> found = sweep(sample_mesh("bone.ply"), keep=[0.5, 0.2], floor=False)
    >>> [level["points"]["simplified"] for level in found["levels"]]
    [936, 374]
    """
    if html:
        check_html()
    shares = _check_shares(keep)
    fit = surface == "ball-pivoting" if fit is None else fit
    if {"delete", "count"} & parameters.keys():
        raise InvalidParameterError(
            "Invalid parameter of a sweep. Must be left out, as the shares say how much stays. "
            f"Given: {', '.join(sorted({'delete', 'count'} & parameters.keys()))}."
        )
    tell = progress or (lambda stage, share: None)
    watch = Stopwatch(lambda stage: tell(stage, None))
    path = check_readable(path)
    folder = None if out is None else Path(out)
    if folder is not None and any(
        (folder / name).exists() and (folder / name).samefile(path) for name in FILES
    ):
        raise OutputError(f"An output would replace the input. Given: {path} and {folder}.")
    scan = prepare(path, drop_invalid=drop_invalid, watch=watch)
    levels: list[dict[str, Any]] = []
    used: dict[str, Any] = {}
    for share, result in _levels(scan, shares, watch, tell, method=method, seed=seed, **parameters):
        used = result.parameters
        with watch(f"surface and error at {share:.4g}"):
            measured = measure(scan, result.indices, surface=surface, fit=fit)
        found = figures(Outcome(scan=scan, result=result, measured=measured, base=None))
        del found["error"]["floor"], found["surface"]["compactness_before"]
        levels.append(
            {"keep": share, **{key: found[key] for key in ("points", "surface", "error")}}
        )
    base = None
    if floor and surface != "none":
        with watch("floor"):
            everything = np.arange(len(scan.cloud.points))
            untouched = measure(scan, everything, surface=surface)
        whole = replace(result, indices=everything, asked=None)
        base = figures(Outcome(scan=scan, result=whole, measured=untouched, base=None))["error"]
        del base["floor"]
    report = {
        "schema": SCHEMA_VERSION,
        "input": {**fingerprint(path), "dropped": scan.cloud.dropped, "faces": scan.cloud.faces},
        "parameters": {
            "method": method,
            "keep": shares,
            **used,
            "surface": surface,
            "fit": fit,
            "drop_invalid": drop_invalid,
        },
        "versions": versions(),
        "normals": "estimated" if scan.estimated else "from the file",
        "diagonal": scan.cloud.diagonal,
        "levels": levels,
        "floor": base,
        "times": watch.times,
    }
    if folder is not None:
        with writing_folder(folder, outdated=FILES) as staging:
            if html:
                _write_page(staging / "sweep.html", report)
            write_report(report, staging / "sweep.json")
    return report


def cut(result: Simplification, count: int) -> Simplification:
    """Return another level of the same ranking, as near the count as its ties allow.

    Parameters
    ----------
    result : Simplification
        Of a method whose levels nest.
    count : int
        Points to keep.

    Returns
    -------
    Simplification

    Examples
    --------
    >>> points = np.random.default_rng(0).random((100, 3))
    >>> cut(simplify(points, method="random", count=10), 30).missed
    0
    """
    ranks, starts = np.unique(np.sort(result.rank), return_index=True)
    # The first of equally near ones keeps more points.
    threshold = int(ranks[np.argmin(np.abs(len(result.rank) - starts - count))])
    indices = np.flatnonzero(result.rank >= threshold)
    return replace(result, indices=indices, threshold=threshold, asked=count)


def _levels(
    scan: Scan,
    shares: list[float],
    watch: Stopwatch,
    tell: Callable[[str, float | None], object],
    *,
    method: str,
    seed: int,
    **parameters: Any,
) -> Iterator[tuple[float, Simplification]]:
    """Yield the cloud at each share, ranking it as rarely as the method allows."""
    total = len(scan.cloud.points)
    counts = [points_to_keep(total, keep=share) or 0 for share in shares]

    def at(count: int) -> Simplification:
        return simplify(
            scan.cloud.points,
            method=method,
            normals=scan.normals,
            count=count,
            seed=seed,
            progress=lambda done: tell("simplify", done),
            **parameters,
        )

    # A representative is chosen for each cluster that goes, so the ranks depend on the level.
    clusters_nest = method == CLUSTER_METHOD and not parameters.get("keep_representative")
    if clusters_nest or get_method(method).total_order:
        with watch("simplify"):
            deepest = at(min(counts))
        for share, count in zip(shares, counts):
            yield share, cut(deepest, count)
        return
    for share, count in zip(shares, counts):
        with watch(f"simplify to {share:.4g}"):
            result = at(count)
        yield share, result


def _check_shares(keep: Sequence[float]) -> list[float]:
    """Return the shares, the largest first, if there is one and none is there twice."""
    shares = sorted((float(share) for share in keep), reverse=True)
    if not shares or len(set(shares)) < len(shares) or not 0 < shares[-1] <= shares[0] <= 1:
        raise InvalidParameterError(
            "Invalid keep. Must be different shares above 0 and up to 1, such as 0.5 and 0.1 "
            f"(50%,10% on the command line). Given: {list(keep)}."
        )
    return shares


def _write_page(path: Path, report: dict[str, Any]) -> None:
    """Write the curve and the table as a page that opens offline."""
    levels, floor = report["levels"], report["floor"]
    payload = {
        "points": [level["points"]["simplified"] for level in levels],
        "curves": {
            name: [level["error"]["uncut"][name] for level in levels]
            for name in ("mean", "rms", "max")
        },
        "floor": None if floor is None else floor["uncut"]["mean"],
    }
    name = Path(report["input"]["path"]).name
    page = render(
        "sweep.html", payload=payload, title=f"{name}: error against size", name=name, report=report
    )
    path.write_text(page, encoding="utf-8", errors="backslashreplace")
