"""What the figures say: the first lines of the document, and the verdict on the comparison."""

from __future__ import annotations

import math
import statistics

from .subjects import SUBJECTS
from .tables import (
    BIMBA_COMPACT,
    F0,
    FIG8_KEPT,
    Results,
    by_neighbour,
    mean_of,
    published_loss,
    rows_of,
    spread,
    uncut,
    within,
)

#: Points that the paper removes of Fandisk, and sets beside those that the others keep.
FIG8_REMOVED = 9759


def summary(results: Results) -> str:
    """Return the first lines: what reproduces, what does not, and why."""
    rows = rows_of(results)
    main = [row for row in rows if row[1].published.place == "Table 1"]
    lines = [_removed_in_short(results)] if by_neighbour(results) else []
    near = [row for row in main if mean_of(row[2], lambda run: run["paper"]["cut"]["max"]) > 0.009]
    paper = [(preset.published.maximum or 0) > 0.009 for _, preset, _ in main]
    lines.append(
        "- **Reproduces:** the maxima, which are a cut-off. MeshLab's filter drops samples farther "
        f"than its MaxDist; cut at 1 % of the diagonal, our maximum is above 0.9 % on {len(near)} "
        f"of {len(main)} models (the paper's on {sum(paper)} of {len(paper)})."
    )
    worst = [mean_of(row[2], lambda run: run["paper"]["uncut"]["max"]) * 100 for row in main]
    lines.append(
        f"- **Does not:** the errors they hide. Uncut, the maximum is "
        f"{_range(f'{min(worst):.1f}', f'{max(worst):.1f}')} % of the diagonal."
    )
    ratio = {
        SUBJECTS[name].title: mean_of(runs, lambda run: run["paper"]["cut"]["mean"])
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
        f"- **Does not:** the mean errors. Cut like the paper's, ours are "
        f"{_range(f'{ratio[low]:.2g} ({low})', f'{ratio[high]:.2g} ({high})')} times as large. "
        f"Already the floor exceeds the paper's on: {', '.join(above) or 'none'}."
    )
    if "bimba" in results:
        before = results["bimba"]["floor"]["paper"]["compact"] * 100
        after = (
            mean_of(results["bimba"]["runs"], lambda run: run["bimba"]["paper"]["compact"]) * 100
        )
        lines.append(
            f"- **Does not:** the share of compact triangles. Bimba, {before:.1f} → {after:.1f} %; "
            f"the paper has {BIMBA_COMPACT[0]:.1f} → {BIMBA_COMPACT[1]:.1f} %, of another sampling."
        )
    if "fandisk" in results and "fig8" in results["fandisk"]:
        fig8 = results["fandisk"]["fig8"]
        mean = {
            method: mean_of(runs, lambda run: run["uncut"]["mean"]) for method, runs in fig8.items()
        }
        others = " and ".join(
            f"{mean['cluster-entropy'] / mean[method]:.0f} times that of {method}"
            for method in FIG8_KEPT
        )
        lines.append(
            f"- **Does not:** Fig. 8. Its {FIG8_REMOVED} are points *removed*, the other two "
            f"counts points *kept*; with as many kept the rule's mean error is {others}."
        )
    better = [
        mean_of(row[2], lambda run: run["paper"]["uncut"]["mean"])
        / mean_of(row[2], lambda run: run["random"]["uncut"]["mean"])
        for row in main
    ]
    lines.append(
        "- **Why it matters:** deleting whole clusters leaves holes. Deleting as many points at "
        f"random has a smaller uncut mean error on {sum(value > 1 for value in better)} of "
        f"{len(main)} models; the rule's is {_range(f'{min(better):.2g}', f'{max(better):.2g}')} "
        "times as large."
    )
    return "\n".join(lines) + "\n"


def _range(low: str, high: str) -> str:
    """Return "low to high", or one of them where they are the same."""
    return low if low == high else f"{low} to {high}"


def _removed_in_short(results: Results) -> str:
    """Return the line on the points removed, with the neighbour that fits most rows."""
    by = by_neighbour(results)
    fits = {k: sum(within(preset, gone) for _, preset, gone in rows) for k, rows in by.items()}
    best = max(fits, key=lambda k: fits[k])
    parts: dict[bool, list[str]] = {True: [], False: []}
    for name, preset, gone in by[best]:
        parts[within(preset, gone)].append(
            f"{SUBJECTS[name].title}, {preset.recipe.parameters['delete']} clusters: "
            f"{spread(gone, F0)} ({published_loss(preset)})"
        )
    total = len(by[best])
    word = "Reproduces" if fits[best] == total else "Mostly reproduces"
    if fits[best] <= total / 2:
        word = "Hardly reproduces" if fits[best] else "Does not reproduce"
    which = "the default density" if best is None else f"the density of neighbour k = {best}"
    line = (
        f"- **{word}:** the points removed, with {which}. Within two standard deviations are "
        f"{fits[best]} of the {total} rows with the paper's number of points, ours (the paper's): "
        f"{'; '.join(parts[True]) or 'none'}"
    )
    if parts[False]:
        line += f"; not {'; '.join(parts[False])}"
    if best is not None and None in fits:
        line += f". With the default density, {fits[None]} of {total}"
    return line + "."


def verdict(results: Results) -> str:
    """Return what the comparison says: ratios of mean errors over all models and counts."""
    ours, clear, rule, first, lost = [], 0, [], [], []
    for name in results:
        curves = results[name].get("compared", {})
        if {"adaptive", "cluster-entropy", "random"} - curves.keys():
            continue
        for column, share in enumerate(results[name]["shares"]):
            errors = {method: uncut(counts[column]) for method, counts in curves.items()}
            mean = {method: statistics.fmean(values) for method, values in errors.items()}
            best = min((method for method in mean if method != "adaptive"), key=mean.__getitem__)
            ours.append(mean["adaptive"] / mean[best])
            spreads = (
                statistics.stdev(e) for e in (errors["adaptive"], errors[best]) if len(e) > 1
            )
            clear += mean[best] - mean["adaptive"] > 2 * math.hypot(*spreads)
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
        f"and is the best in {won} of {len(ours)}, in {clear} of them by more than two standard "
        f"deviations of the difference; it is not on: {', '.join(lost) or 'none'}. "
        f"The paper's rule has "
        f"{statistics.geometric_mean(rule):.0f} times that of random deletion, "
        f"{statistics.geometric_mean(first):.0f} times where most points are kept.\n"
    )
