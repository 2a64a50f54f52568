"""The document: docs/REPRODUCTION.md, written from what was measured."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable
from typing import Any

from meshlab_filter.methods.registry import METHODS
from meshlab_filter.models import get_model

from .subjects import SUBJECTS

SHARES = (0.91, 0.5, 0.2, 0.1, 0.05)
#: Points that the paper keeps of Fandisk by Shi et al. and by the 3D grid, and by its own rule.
FIG8_KEPT = {"shi2011": 9682, "lee2001": 9694}
FIG8_REMOVED = 9759
F0 = "{:.0f}"
#: Which neighbour gives the density; None is the rounded root of a cluster's size.
NEIGHBOURS = (None, 1, 2, 4, 8)
BIMBA_COMPACT = (65.9498, 66.7420)

Results = dict[str, Any]


def spread(values: Iterable[float], form: str = "{:.2e}") -> str:
    """Return mean ± standard deviation."""
    numbers = list(values)
    deviation = statistics.stdev(numbers) if len(numbers) > 1 else 0.0
    return f"{form.format(statistics.fmean(numbers))} ± {form.format(deviation)}"


def table(head: list[str], rows: list[list[str]]) -> str:
    """Return a Markdown table, the first column to the left and the others to the right."""
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def _rows(results: Results) -> list[tuple[str, Any, list[Results]]]:
    """Return subject, preset and runs (one a seed) of every row of Table 1 and Fig. 7."""
    return [
        (name, preset, [run[preset.name] for run in results[name]["runs"]])
        for name in results
        for preset in SUBJECTS[name].rows()
    ]


def _gone(preset: Any) -> int:
    """Return how many points the paper removes."""
    return int(preset.published.points - preset.published.left)


def _within(preset: Any, gone: list[int]) -> bool:
    """Return whether the paper's number lies within two standard deviations of ours."""
    deviation = statistics.stdev(gone) if len(gone) > 1 else 0.0
    return abs(statistics.fmean(gone) - _gone(preset)) <= 2 * deviation


def _mean(runs: list[Results], get: Callable[[Results], float]) -> float:
    return statistics.fmean(get(run) for run in runs)


def summary(results: Results) -> str:
    """Return the first lines: what reproduces, what does not, and why."""
    rows = _rows(results)
    main = [row for row in rows if row[1].published.place == "Table 1"]
    lines = []
    if "bunny" in results:
        counts, one = [], []
        for name, preset, runs in rows:
            if name == "bunny":
                gone = [results[name]["floor"]["points"] - run["paper"]["kept"] for run in runs]
                counts.append(f"{spread(gone, '{:.0f}')} ({_gone(preset)})")
                one.append(spread((run[preset.name] for run in results[name]["neighbours"][1]), F0))
        lines.append(
            "- **Nearly reproduces:** the points removed. Bunny, 60 / 40 / 30 of 807 clusters: "
            f"ours (the paper's) {', '.join(counts)}; with k = 1, {', '.join(one)}."
        )
    near = [row for row in main if _mean(row[2], lambda run: run["paper"]["cut"]["max"]) > 0.009]
    lines.append(
        "- **Reproduces:** the maxima, which are a cut-off. MeshLab's filter drops samples farther "
        f"than its MaxDist; cut at 1 % of the diagonal, our maximum is above 0.9 % on {len(near)} "
        f"of {len(main)} models (the paper's on 5 of 6)."
    )
    uncut = [_mean(row[2], lambda run: run["paper"]["uncut"]["max"]) * 100 for row in main]
    lines.append(
        f"- **Does not:** the errors they hide. Uncut, the maximum is {min(uncut):.1f} to "
        f"{max(uncut):.1f} % of the diagonal."
    )
    ratio = {
        SUBJECTS[name].title: _mean(runs, lambda run: run["paper"]["cut"]["mean"])
        / preset.published.mean
        for name, preset, runs in main
    }
    low, high = min(ratio, key=ratio.__getitem__), max(ratio, key=ratio.__getitem__)
    above = [
        SUBJECTS[name].title
        for name, preset, _ in main
        if results[name]["floor"]["paper"]["cut"]["mean"] > preset.published.mean
    ]
    lines.append(
        f"- **Does not:** the mean errors. Cut like the paper's, ours are {ratio[low]:.2g} ({low}) "
        f"to {ratio[high]:.2g} ({high}) times as large. Already the floor exceeds the paper's on: "
        f"{', '.join(above) or 'none'}."
    )
    if "bimba" in results:
        before = results["bimba"]["floor"]["paper"]["compact"] * 100
        after = _mean(results["bimba"]["runs"], lambda run: run["bimba"]["paper"]["compact"]) * 100
        lines.append(
            f"- **Does not:** the share of compact triangles. Bimba, {before:.1f} → {after:.1f} %; "
            f"the paper has {BIMBA_COMPACT[0]:.1f} → {BIMBA_COMPACT[1]:.1f} %, of another sampling."
        )
    if "fandisk" in results and "fig8" in results["fandisk"]:
        fig8 = results["fandisk"]["fig8"]
        ours = fig8["cluster-entropy"]["uncut"]["mean"]
        others = " and ".join(
            f"{ours / fig8[method]['uncut']['mean']:.0f} times that of {method}"
            for method in FIG8_KEPT
        )
        lines.append(
            f"- **Does not:** Fig. 8. Its {FIG8_REMOVED} are points *removed*, the other two "
            f"counts points *kept*; with as many kept the rule's mean error is {others}."
        )
    better = [
        _mean(row[2], lambda run: run["paper"]["uncut"]["mean"])
        / _mean(row[2], lambda run: run["random"]["uncut"]["mean"])
        for row in main
    ]
    lines.append(
        "- **Why it matters:** deleting whole clusters leaves holes. Deleting as many points at "
        f"random has a smaller uncut mean error on {sum(value > 1 for value in better)} of "
        f"{len(main)} models; the rule's is {min(better):.2g} to {max(better):.2g} times as large."
    )
    return "\n".join(lines) + "\n"


def removed(results: Results) -> str:
    """Return the table of points removed."""
    body = []
    for name, preset, runs in _rows(results):
        subject, paper = SUBJECTS[name], preset.published
        total = results[name]["floor"]["points"]
        gone = [total - run["paper"]["kept"] for run in runs]
        parameters = preset.recipe.parameters
        body.append(
            [
                f"{subject.title}, {paper.place}",
                f"{total} ({paper.points})",
                subject.note,
                str(parameters["clusters"]),
                str(parameters["delete"]),
                str(_gone(preset)),
                spread(gone, F0),
                f"{(paper.points - paper.left) / paper.points:.2%}",
                f"{statistics.fmean(gone) / total:.2%}",
            ]
        )
    head = "model|points (paper)|our cloud|clusters|deleted|removed, paper|removed, ours"
    return table([*head.split("|"), "share, paper", "share, ours"], body)


def neighbours(results: Results) -> str:
    """Return the table of points removed from Bunny by which neighbour gives the density."""
    presets = SUBJECTS["bunny"].rows()
    body = [["paper", *(str(_gone(preset)) for preset in presets)]]
    for k, runs in results["bunny"]["neighbours"].items():
        label = "rounded root of the cluster's size (default)" if k is None else f"k = {k}"
        body.append(
            [label, *(spread((run[preset.name] for run in runs), F0) for preset in presets)]
        )
    close = [
        "the default" if k is None else f"k = {k}"
        for k, runs in results["bunny"]["neighbours"].items()
        if all(_within(preset, [run[preset.name] for run in runs]) for preset in presets)
    ]
    tail = f"Within two standard deviations of all three: {', '.join(close) or 'none'}.\n\n"
    deleted = (preset.recipe.parameters["delete"] for preset in presets)
    lead = (
        "The paper does not say which neighbour gives the density. Points removed from Bunny:\n\n"
    )
    return lead + table(["k", *(f"{n} clusters deleted" for n in deleted)], body) + "\n" + tail


def errors(results: Results, surface: str) -> str:
    """Return the table of errors with one kind of surface."""
    body = []
    for name, preset, runs in _rows(results):
        base, paper = results[name]["floor"][surface], preset.published

        def of(cut: str, figure: str, runs: list[Results] = runs, form: str = "{:.1e}") -> str:
            return spread((run[surface][cut][figure] for run in runs), form)

        body.append(
            [
                f"{SUBJECTS[name].title}, n = {preset.recipe.parameters['delete']}",
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
    for name, preset, runs in _rows(results):
        base = results[name]["floor"]
        cells = [f"{SUBJECTS[name].title}, n = {preset.recipe.parameters['delete']}"]
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
    rows = results["fandisk"]["fig8"]
    body = [
        [
            method,
            str(FIG8_KEPT.get(method, "")) or "–",
            str(row["kept"]),
            f"{row['uncut']['mean']:.1e}",
            f"{row['uncut']['rms']:.1e}",
            f"{row['uncut']['max']:.4f}",
            f"{row['cut']['mean']:.1e}",
            str(row["cut"]["dropped"]),
        ]
        for method, row in rows.items()
    ]
    head = "method|kept, paper|kept, ours|mean, uncut|RMS, uncut|max, uncut|mean, cut|cut off"
    return table(head.split("|"), body)


def compared(results: Results, name: str) -> str:
    """Return the tables of one model: mean and maximum of every method at every count."""
    curves = results[name]["compared"]
    total = results[name]["floor"]["points"]
    shares = [f"{share:.0%}" for share in results[name]["shares"]]
    order = sorted(curves, key=lambda method: curves[method][-1]["uncut"]["mean"])
    best = [
        min(curves[method][column]["uncut"]["mean"] for method in curves)
        for column in range(len(shares))
    ]
    body = []
    for method in order:
        means = [row["uncut"]["mean"] for row in curves[method]]
        cells = [
            f"**{mean * 1e5:.3g}**" if mean == least else f"{mean * 1e5:.3g}"
            for mean, least in zip(means, best)
        ]
        worst = [f"{row['uncut']['max'] * 100:.2f}" for row in curves[method]]
        kept = "/".join(str(row["missed"]) for row in curves[method])
        exact = all(row["missed"] == 0 for row in curves[method])
        body.append([method, *cells, *worst, "exact" if exact else kept])
    head = ["method", *(f"mean {share}" for share in shares), *(f"max {share}" for share in shares)]
    lead = f"{total} points; mean error in 1e-5 of the diagonal, maximum in % of it, all uncut.\n\n"
    return lead + table([*head, "points missed"], body)


def verdict(results: Results) -> str:
    """Return what the comparison says: ratios of mean errors over all models and counts."""
    ours, rule, first, lost = [], [], [], []
    for name in results:
        curves = results[name].get("compared", {})
        if {"adaptive", "cluster-entropy", "random"} - curves.keys():
            continue
        for column, share in enumerate(results[name]["shares"]):
            mean = {method: rows[column]["uncut"]["mean"] for method, rows in curves.items()}
            best = min((method for method in mean if method != "adaptive"), key=mean.__getitem__)
            ours.append(mean["adaptive"] / mean[best])
            if ours[-1] > 1:
                lost.append(f"{SUBJECTS[name].title} at {share:.0%} ({best}, {ours[-1]:.2f} times)")
            rule.append(mean["cluster-entropy"] / mean["random"])
            if share == max(results[name]["shares"]):
                first.append(rule[-1])
    if not ours:
        return ""
    won = sum(ratio < 1 for ratio in ours)
    return (
        f"Mean error, geometric means over models and counts: `adaptive` has "
        f"{statistics.geometric_mean(ours):.2f} times that of the best other method of each case "
        f"and is the best in {won} of {len(ours)}; it is not on: {', '.join(lost) or 'none'}. "
        f"The paper's rule has "
        f"{statistics.geometric_mean(rule):.0f} times that of random deletion, "
        f"{statistics.geometric_mean(first):.0f} times where most points are kept.\n"
    )


def models(results: Results) -> str:
    """Return the table of the files that the clouds were made from."""
    entries = [get_model(SUBJECTS[name].model) for name in results]
    body = [
        [f"[{entry.file}]({entry.address})", entry.stands_for, entry.licence] for entry in entries
    ]
    return table(["file", "stands for", "licence as its source states it"], body)


TEXT = """\
# Mahdaoui and Sbai 2020, reproduced

{summary}
A. Mahdaoui and E. H. Sbai, "3D Point Cloud Simplification Based on k-Nearest Neighbor and
Clustering", Advances in Multimedia 2020, 8825205, doi:10.1155/2020/8825205. Written by
`python scripts/reproduce_paper.py` with {seeds} and MeshLab {version};
± is one standard deviation over the seeds. Every error is that of *all* original points to
the rebuilt surface, divided by the diagonal of their bounding box. **Cut** leaves out samples
farther than 1 % of it, **uncut** leaves out none. The **floor** is the same chain on the untouched
cloud: what ball pivoting costs before any point is gone.

## Points removed (Table 1, Fig. 7)

{removed}
{neighbours}## Errors, ball pivoting with the automatic radius, as in the paper (Table 1)

{errors_paper}
The last column removes as many points at random and measures them in the same way. The automatic
radius leaves holes in irregular clouds even where nothing was deleted: see the floor.

## Errors, ball pivoting in passes of growing radius

{errors_passes}
Passes of 1, 1.5, 2.5 and 4 times the median spacing close the surface, so that what is left is the
error of the deletion. All that follows is measured with them.

## Compact triangles (Figs 3 and 4)

Triangles whose compactness 4√3·area / (a² + b² + c²) is 0.6 and above, in %.

{compact}
{figures}
## All methods at the same count

What the paper compares in Fig. 8 are different numbers of points. Here every method keeps the same
number, as nearly as it can ("points missed", in the order of the columns; positive: too many), with
the same normals, the same reconstruction and uncut errors; seed 0. [METHODS.md](METHODS.md) says
what each method is.

{verdict}
{comparison}
## Models

None is part of this project; `meshlab_filter/models.py` pins their addresses and checksums.

{models}"""

FIGURES = {
    "compactness": ("Figures 3 and 4: compactness of Bimba's triangles (automatic radius)", ""),
    "clouds": ("Figure 5: original and simplified clouds", ""),
    "surfaces": ("Figure 6: surfaces of the original and simplified clouds", ""),
    "levels": ("Figure 7: levels of detail of Bunny", ""),
    "fig8": (
        "Figure 8: Fandisk under several methods at the same count",
        "The paper sets 9759 points of its own beside 9682 and 9694 of the others, but its 9759 "
        "are the points removed. With as many points kept, and the error of every original point "
        "in colour:",
    ),
    "error": (
        "Figure 9: error in colour",
        "The original surface of Bunny, each point in the colour of its distance to the surface "
        "rebuilt without the deleted clusters.",
    ),
    "entropy": (
        "Clusters and entropy of Bunny",
        "A cluster of m points has an entropy of at most ln m, so that it says above all how many "
        "points a cluster has: the rank correlation of the two is {correlation:.2f}. What goes are "
        "small clusters, not those that the shape needs least.",
    ),
}


def write(results: Results, images: dict[str, str], *, seeds: int, version: str) -> str:
    """Return the document.

    Parameters
    ----------
    results : dict
        By subject: "floor", "runs", and where measured "compared", "shares" and "fig8".
    images : dict
        Path of each picture relative to the document, by its key in ``FIGURES`` or, for the plots,
        the subject's name.
    seeds : int
    version : str
        Of pymeshlab.
    """
    parts = []
    for key, (title, text) in FIGURES.items():
        if key in images:
            if key == "entropy":
                runs = results["bunny"]["neighbours"][None]
                text = text.format(correlation=_mean(runs, lambda run: run["correlation"]))
            extra = f"{text}\n\n" if text else ""
            if key == "fig8":
                extra += fig8(results) + "\n"
            parts.append(f"## {title}\n\n{extra}![{title}]({images[key]})\n")
    compare = [
        f"### {SUBJECTS[name].title}\n\n{compared(results, name)}\n"
        f"![Mean error of all methods on {SUBJECTS[name].title}]({images[name]})\n"
        for name in results
        if "compared" in results[name]
    ]
    absent = [
        name
        for name, method in METHODS.items()
        if not any(name in results[subject].get("compared", {}) for subject in results)
    ]
    if absent:
        compare.append(f"Not run here: {', '.join(absent)}.\n")
    return TEXT.format(
        summary=summary(results),
        seeds=f"the seeds 0 … {seeds - 1}" if seeds > 1 else "the seed 0",
        version=version,
        removed=removed(results),
        neighbours=neighbours(results) if "bunny" in results else "",
        errors_paper=errors(results, "paper"),
        errors_passes=errors(results, "passes"),
        compact=compact(results),
        figures="\n".join(parts),
        verdict=verdict(results),
        comparison="\n".join(compare),
        models=models(results),
    )
