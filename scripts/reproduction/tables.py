"""The tables of the document, and how figures are written in them."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable
from typing import Any

from meshlab_filter.models import get_model

from .subjects import SUBJECTS

#: Points that the paper keeps of Fandisk by Shi et al. and by the 3D grid.
FIG8_KEPT = {"shi2011": 9682, "lee2001": 9694}
F0 = "{:.0f}"
BIMBA_COMPACT = (65.9498, 66.7420)

Results = dict[str, Any]


def spread(values: Iterable[float], form: str = "{:.2e}") -> str:
    """Return mean ± standard deviation."""
    numbers = list(values)
    deviation = statistics.stdev(numbers) if len(numbers) > 1 else 0.0
    return f"{form.format(statistics.fmean(numbers))} ± {form.format(deviation)}"


def figure(values: Iterable[float], *, digits: int = 3) -> str:
    """Return the mean with so many digits, and ± standard deviation where there are several."""
    numbers = list(values)
    mean = statistics.fmean(numbers)
    places = max(0, digits - 1 - math.floor(math.log10(mean))) if mean > 0 else digits
    form = f"{{:.{places}f}}"
    return spread(numbers, form) if len(numbers) > 1 else form.format(mean)


def table(head: list[str], rows: list[list[str]]) -> str:
    """Return a Markdown table, the first column to the left and the others to the right."""
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def rows_of(results: Results) -> list[tuple[str, Any, list[Results]]]:
    """Return subject, preset and runs (one a seed) of every row of Table 1 and Fig. 7."""
    return [
        (name, preset, [run[preset.name] for run in results[name]["runs"]])
        for name in results
        for preset in SUBJECTS[name].rows()
    ]


def published_loss(preset: Any) -> int:
    """Return how many points the paper removes."""
    return int(preset.published.points - preset.published.left)


def within(preset: Any, gone: list[int]) -> bool:
    """Return whether the paper's number lies within two standard deviations of ours."""
    deviation = statistics.stdev(gone) if len(gone) > 1 else 0.0
    return abs(statistics.fmean(gone) - published_loss(preset)) <= 2 * deviation


def by_neighbour(results: Results) -> dict[int | None, list[tuple[str, Any, list[int]]]]:
    """Return, by k, what goes in the rows whose model has the paper's number of points."""
    found: dict[int | None, list[tuple[str, Any, list[int]]]] = {}
    for name in results:
        if not SUBJECTS[name].same:
            continue
        runs = results[name]["runs"]
        for preset in SUBJECTS[name].rows():
            for k in runs[0]["neighbours"]:
                gone = [run["neighbours"][k][preset.name] for run in runs]
                found.setdefault(k, []).append((name, preset, gone))
    return found


def mean_of(runs: list[Results], get: Callable[[Results], float]) -> float:
    """Return the mean of a figure over runs."""
    return statistics.fmean(get(run) for run in runs)


def removed(results: Results) -> str:
    """Return the table of points removed."""
    body = []
    for name, preset, runs in rows_of(results):
        subject, paper = SUBJECTS[name], preset.published
        total = results[name]["floor"]["points"]
        gone = [total - run["paper"]["kept"] for run in runs]
        parameters = preset.recipe.parameters
        body.append(
            [
                f"{subject.label}, {paper.place}",
                f"{total} ({paper.points})",
                subject.note,
                str(parameters["clusters"]),
                str(parameters["delete"]),
                str(published_loss(preset)),
                spread(gone, F0),
                f"{(paper.points - paper.left) / paper.points:.2%}",
                f"{statistics.fmean(gone) / total:.2%}",
            ]
        )
    head = "model|points (paper)|our cloud|clusters|deleted|removed, paper|removed, ours"
    return table([*head.split("|"), "share, paper", "share, ours"], body)


def neighbours(results: Results) -> str:
    """Return the table of points removed by which neighbour gives the density."""
    by = by_neighbour(results)
    rows = next(iter(by.values()))
    body = [["paper", *(str(published_loss(preset)) for _, preset, _ in rows), ""]]
    for k, columns in by.items():
        label = "rounded root of the cluster's size (default)" if k is None else f"k = {k}"
        fits = sum(within(preset, gone) for _, preset, gone in columns)
        cells = [spread(gone, F0) for _, _, gone in columns]
        body.append([label, *cells, f"{fits} of {len(columns)}"])
    lead = (
        "The paper does not say which neighbour gives the density. Points removed from the models "
        "with its number of points, and how many of the rows are within two standard deviations:"
    )
    head = [
        f"{SUBJECTS[name].title}, {preset.recipe.parameters['delete']} deleted"
        for name, preset, _ in rows
    ]
    tail = ""
    if "genus" in results and 1 in by:
        tail = (
            "A cluster of two points has the entropy ln 2. With k = 1 one of three cannot have "
            "less, for the nearest two of them share a distance: of Genus, three points to a "
            "cluster on average, thirty clusters of two go, whatever the seed. With a larger k "
            "some of three go before them.\n\n"
        )
    return f"{lead}\n\n{table(['k', *head, 'within two'], body)}\n{tail}"


def errors(results: Results, surface: str) -> str:
    """Return the table of errors with one kind of surface."""
    body = []
    for name, preset, runs in rows_of(results):
        base, paper = results[name]["floor"][surface], preset.published

        def of(cut: str, figure: str, runs: list[Results] = runs, form: str = "{:.1e}") -> str:
            return spread((run[surface][cut][figure] for run in runs), form)

        body.append(
            [
                f"{SUBJECTS[name].label}, n = {preset.recipe.parameters['delete']}",
                f"{paper.mean:.1e}" if paper.mean is not None else "–",
                of("cut", "mean"),
                of("uncut", "mean"),
                f"{base['uncut']['mean']:.1e}",
                f"{paper.maximum:.4f}" if paper.maximum is not None else "–",
                of("cut", "max", form="{:.4f}"),
                of("uncut", "max", form="{:.4f}"),
                f"{base['uncut']['max']:.4f}",
                spread((run[surface]["cut"]["dropped"] for run in runs), "{:.0f}"),
            ]
        )
        if surface == "paper":
            body[-1].append(spread((run["random"]["uncut"]["mean"] for run in runs), "{:.1e}"))
    head = "model|mean, paper|mean, cut|mean, uncut|mean, floor"
    head += "|max, paper|max, cut|max, uncut|max, floor|samples cut off"
    return table(head.split("|") + ["mean, random, uncut"] * (surface == "paper"), body)


def compact(results: Results) -> str:
    """Return the table of compact triangles."""
    body = []
    for name, preset, runs in rows_of(results):
        base = results[name]["floor"]
        cells = [f"{SUBJECTS[name].label}, n = {preset.recipe.parameters['delete']}"]
        paper = name == "bimba"
        cells.append(f"{BIMBA_COMPACT[0]:.2f} → {BIMBA_COMPACT[1]:.2f}" if paper else "–")
        for surface in ("paper", "passes"):
            cells.append(f"{base[surface]['compact'] * 100:.2f}")
            cells.append(spread((run[surface]["compact"] * 100 for run in runs), "{:.2f}"))
        body.append(cells)
    head = "model|paper, before → after|automatic radius, before|after|passes, before|after"
    return table(head.split("|"), body)


def fig8(results: Results) -> str:
    """Return the table of Fandisk at the counts of Fig. 8."""
    body = []
    for method, runs in results["fandisk"]["fig8"].items():

        def of(cut: str, name: str, scale: float, runs: list[Results] = runs) -> str:
            return figure(run[cut][name] * scale for run in runs)

        body.append(
            [
                method,
                str(FIG8_KEPT.get(method, "")) or "–",
                "/".join(str(kept) for kept in dict.fromkeys(run["kept"] for run in runs)),
                of("uncut", "mean", 1e5),
                of("uncut", "rms", 1e5),
                of("uncut", "max", 100),
                of("cut", "mean", 1e5),
                "/".join(str(run["cut"]["dropped"]) for run in runs),
            ]
        )
    head = "method|kept, paper|kept, ours|mean, uncut|RMS, uncut|max, uncut|mean, cut|cut off"
    lead = "Mean and root mean square in 1e-5 of the diagonal, maximum in % of it.\n\n"
    return lead + table(head.split("|"), body)


def readings(results: Results) -> str:
    """Return the table of what the two rivals keep by each reading of their parameters."""
    body = []
    for row in results["fandisk"]["readings"]:
        paper = FIG8_KEPT[row["method"]]
        share = statistics.fmean(row["kept"]) / paper - 1
        kept = spread(row["kept"], F0) if len(row["kept"]) > 1 else str(row["kept"][0])
        body.append([row["method"], row["reading"], kept, str(paper), f"{share:+.1%}"])
    lead = (
        "What they keep of Fandisk with the parameters that the paper gives, a space interval of "
        "0.076 and a threshold of 0.13 for `shi2011`, 0.0696 and 0.41 for `lee2001`, depends on "
        "how these are read (normals of 15 nearest neighbours):"
    )
    tail = (
        "No reading meets its count by the words that are at hand, and among so many one that "
        "comes near proves nothing; `count` sets the methods by what they keep."
    )
    head = ["method", "reading", "kept", "kept, paper", "difference"]
    return f"{lead}\n\n{table(head, body)}\n{tail}\n"


def uncut(runs: list[Results], name: str = "mean") -> list[float]:
    """Return an uncut error of each run."""
    return [run["uncut"][name] for run in runs]


def comparison(results: Results, name: str) -> str:
    """Return the table of one model: mean and maximum of every method at every count."""
    curves = results[name]["compared"]
    total = results[name]["floor"]["points"]
    shares = [f"{share:.0%}" for share in results[name]["shares"]]
    order = sorted(curves, key=lambda method: statistics.fmean(uncut(curves[method][-1])))
    best = [
        min(statistics.fmean(uncut(curves[method][column])) for method in curves)
        for column in range(len(shares))
    ]
    body = []
    for method in order:
        cells, worst, missed = [], [], []
        for runs, least in zip(curves[method], best):
            cell = figure(mean * 1e5 for mean in uncut(runs))
            cells.append(f"**{cell}**" if statistics.fmean(uncut(runs)) == least else cell)
            worst.append(f"{statistics.fmean(uncut(runs, 'max')) * 100:.2f}")
            missed.append(max((run["missed"] for run in runs), key=abs))
        exact = "exact" if not any(missed) else "/".join(map(str, missed))
        body.append([method, *cells, *worst, exact])
    head = ["method", *(f"mean {share}" for share in shares), *(f"max {share}" for share in shares)]
    lead = f"{total} points; mean error in 1e-5 of the diagonal, maximum in % of it, all uncut.\n\n"
    return lead + table([*head, "points missed"], body)


def models(results: Results) -> str:
    """Return the table of the files that the clouds were made from."""
    entries = [get_model(SUBJECTS[name].model) for name in results]
    body = [
        [f"[{entry.file}]({entry.address})", entry.stands_for, entry.licence] for entry in entries
    ]
    return table(["file", "stands for", "licence as its source states it"], body)
