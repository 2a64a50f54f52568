"""Tables of BENCHMARK.md's section on quality, from what benchmark_quality.py measured."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from quality_models import MODELS
from quality_samplers import PEERS, SAMPLERS

BEGIN, END = "<!-- quality:begin -->", "<!-- quality:end -->"
OURS, PAPER, EVEN = "adaptive", "cluster-entropy", "fpsample farthest point"
PAPER_SHARE = 0.91
BUILT = {"fitted": "as `run` builds it", "plain": "as MeshLab builds it"}
Row = dict[str, Any]
Cases = dict[tuple[str, float], dict[str, Row]]


def cases_of(rows: Iterable[Row]) -> Cases:
    """Group rows by model and share: of each case, the row of each sampler."""
    cases: Cases = {}
    for row in rows:
        cases.setdefault((row["model"], row["share"]), {})[row["sampler"]] = row
    order = list(MODELS)
    return dict(sorted(cases.items(), key=lambda item: (order.index(item[0][0]), -item[0][1])))


def geometric_mean(ratios: list[float]) -> float:
    """Return the geometric mean, NaN of nothing."""
    return float(np.exp(np.mean(np.log(ratios)))) if ratios else float("nan")


def best_peer(case: dict[str, Row], figure: str, built: str) -> tuple[str, float]:
    """Return the peer sampler with the least figure of a case, and the figure."""
    peers = ((s, case[s][built][figure]) for s in PEERS if s in case)
    return min(peers, key=lambda pair: pair[1])


def compared(cases: Cases) -> Cases:
    """Leave the cases in which ours and at least one peer were measured."""
    return {
        key: case
        for key, case in cases.items()
        if OURS in case and len(set(case) & set(PEERS)) > 1 and key[1] != PAPER_SHARE
    }


def against_peers(cases: Cases, figure: str, built: str) -> dict[tuple[str, float], float]:
    """Ratio of our figure to that of the best peer of each single case."""
    return {
        key: case[OURS][built][figure] / best_peer(case, figure, built)[1]
        for key, case in cases.items()
    }


def table(head: list[str], lines: Iterable[list[str]]) -> list[str]:
    """Lines of a Markdown table, the first column to the left and the others to the right."""
    rule = "|".join(["---"] + ["---:"] * (len(head) - 1))
    return [f"| {' | '.join(head)} |", f"|{rule}|", *(f"| {' | '.join(x)} |" for x in lines), ""]


def verdict(cases: Cases, everything: Cases) -> list[str]:
    """Set what was measured beside what was aimed at."""
    aims = (("mean", "mean error", "≤ 0.60", 1.0), ("rms", "RMS error", "≤ 0.65", None),
            ("max", "maximum", "≤ 0.85", 2.0))  # fmt: skip
    columns = []
    for built in BUILT:
        cells: list[tuple[str, str, str]] = []
        for figure, name, aim, ceiling in aims:
            ratios = list(against_peers(cases, figure, built).values())
            cells.append((f"{name} / best peer of each case", aim, f"{geometric_mean(ratios):.2f}"))
            if ceiling:
                above = sum(ratio > ceiling for ratio in ratios)
                cells.append((f"{name}: cases above {ceiling:g} × the best peer", "0",
                              f"{above} of {len(ratios)}"))  # fmt: skip
        ours, even = (boundary(cases, sampler, built) for sampler in (OURS, EVEN))
        cells.append(("boundary edges / farthest point's, closed models", "≤ 1.5",
                      f"{ours / max(even, 1):.2f} ({ours} / {even})"))  # fmt: skip
        for sampler, aim in (("surface first", "≤ 1.1"), ("surface first, moved", "")):
            first = [c[OURS][built]["mean"] / c[sampler][built]["mean"]
                     for c in cases.values() if sampler in c]  # fmt: skip
            moved = "moved" if "moved" in sampler else "original"
            cells.append((f"mean error / surface first with {moved} points", aim,
                          f"{geometric_mean(first):.2f} ({len(first)} cases)"))  # fmt: skip
        paper = [c[PAPER][built]["mean"] / c[OURS][built]["mean"]
                 for (_, share), c in everything.items()
                 if share == PAPER_SHARE and PAPER in c and OURS in c]  # fmt: skip
        cells.append((f"the paper's rule's mean error / ours at {PAPER_SHARE:.0%}", "≥ 10",
                      f"{geometric_mean(paper):.1f}"))  # fmt: skip
        columns.append(cells)
    lines = [[name, aim, *(column[row][2] for column in columns)]
             for row, (name, aim, _) in enumerate(columns[0])]  # fmt: skip
    return table(["figure (geometric mean)", "aim", *BUILT.values()], lines)


def boundary(cases: Cases, sampler: str, built: str) -> int:
    """Sum the boundary edges over the cases of closed models."""
    return sum(
        case[sampler][built]["boundary_edges"]
        for (model, _), case in cases.items()
        if MODELS[model].closed and sampler in case and EVEN in case
    )


def by_case(cases: Cases, figure: str, built: str, write: Callable[[float], str]) -> list[str]:
    """One line a case, one column a sampler; the best peer in bold."""
    samplers = [s for s in SAMPLERS if any(s in case for case in cases.values())]
    lines = []
    for (model, share), case in cases.items():
        best, _ = best_peer(case, figure, built)
        cells = [write(case[s][built][figure]) if s in case else "–" for s in samplers]
        cells = [f"**{c}**" if s == best else c for s, c in zip(samplers, cells)]
        lines.append([f"{model} {share:.0%}", *cells])
    return table(["case", *samplers], lines)


def over_cases(cases: Cases, built: str) -> list[str]:
    """One line a sampler: figures relative to ours on the geometric mean, sums of defects."""
    lines = []
    for sampler in SAMPLERS:
        both = [c for c in cases.values() if sampler in c and OURS in c]
        if not both:
            continue
        cells = [
            f"{geometric_mean([c[sampler][built][f] / c[OURS][built][f] for c in both]):.2f}"
            for f in ("mean", "rms", "p99", "max")
            if min(c[sampler][built][f] for c in both) > 0
        ]
        cells += ["–"] * (4 - len(cells))
        cells += [
            f"{geometric_mean([c[sampler][f] / c[OURS][f] for c in both]):.2f}"
            for f in ("covering", "plane")
        ]
        seconds = geometric_mean([max(c[sampler]["seconds"], 1e-4) for c in both])
        memory = max(c[sampler]["bytes_per_point"] for c in both)
        cells += [str(sum(c[sampler][built][f] for c in both))
                  for f in ("boundary_edges", "nonmanifold_edges", "without_face")]  # fmt: skip
        over = max(c[sampler]["count"] / c[sampler]["asked"] - 1 for c in both)
        cells += [f"{seconds:.2f}", f"{memory:.0f}", f"{max(over, 0):.1%}", str(len(both))]
        lines.append([sampler, *cells])
    head = ["sampler", "mean", "RMS", "p99", "max", "covering radius", "plane fit",
            "boundary edges", "non-manifold", "points without a face", "seconds", "bytes / point",
            "most points too many", "cases"]  # fmt: skip
    return table(head, lines)


def losses(cases: Cases, built: str) -> list[str]:
    """Name the cases in which a peer is better."""
    lines = []
    for figure, name in (("mean", "mean"), ("rms", "RMS"), ("max", "maximum")):
        worse = {k: r for k, r in against_peers(cases, figure, built).items() if r > 1}
        listed = ", ".join(
            f"{model} {share:.0%} ({ratio:.2f} ×, "
            f"{best_peer(cases[model, share], figure, built)[0]})"
            for (model, share), ratio in sorted(worse.items(), key=lambda pair: -pair[1])
        )
        lines.append(f"- {name}: {len(worse)} of {len(cases)} cases. {listed}".rstrip() + "\n")
    for sampler in (s for s in SAMPLERS if s not in PEERS and s != OURS):
        ratios = {
            key: case[OURS][built]["mean"] / case[sampler][built]["mean"]
            for key, case in cases.items()
            if sampler in case
        }
        worse = {key: ratio for key, ratio in ratios.items() if ratio > 1}
        if worse:
            listed = ", ".join(
                f"{model} {share:.0%} ({ratio:.2f} ×)"
                for (model, share), ratio in sorted(worse.items(), key=lambda pair: -pair[1])
            )
            lines.append(
                f"- mean, {sampler} (not counted among the peers): {len(worse)} of "
                f"{len(ratios)} cases. {listed}\n"
            )
    return lines


def plot(cases: Cases, output: Path) -> None:
    """Draw the mean error of the fitted surface over the share, a panel for each model."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    models = list(dict.fromkeys(model for model, _ in cases))
    shown = [s for s in SAMPLERS if s not in (PAPER, "CGAL WLOP")]
    figure, axes = pyplot.subplots(3, 4, figsize=(15, 10.5), sharex=True, layout="constrained")
    colours = dict(zip(shown, matplotlib.colormaps["tab20"].colors))
    for panel, model in zip(axes.flat, models):
        for sampler in shown:
            line = sorted((share, case[sampler]["fitted"]["mean"])
                          for (name, share), case in cases.items()
                          if name == model and sampler in case)  # fmt: skip
            if line:
                panel.loglog(*np.array(line).T, marker="o", markersize=3,
                             label=sampler, color="black" if sampler == OURS else colours[sampler],
                             linewidth=2.2 if sampler == OURS else 1)  # fmt: skip
        panel.set_title(model)
        panel.set_xticks([0.05, 0.1, 0.2, 0.5], ["5 %", "10 %", "20 %", "50 %"])
        panel.minorticks_off()
        panel.grid(alpha=0.3)
    for panel in axes.flat[len(models) :]:
        panel.axis("off")
    legend: dict[str, Any] = {}
    for panel in axes.flat:
        legend |= dict(zip(*panel.get_legend_handles_labels()[::-1]))
    axes.flat[-1].legend(legend.values(), legend.keys(), loc="center", fontsize=9)
    figure.supxlabel("share of the points that stays")
    figure.supylabel("mean error of all original points / bounding-box diagonal, uncut")
    figure.savefig(output, dpi=80)
    pyplot.close(figure)


def section(rows: list[Row]) -> str:
    """Return the whole section as Markdown."""
    everything = cases_of(rows)
    cases = compared(everything)
    models = list(dict.fromkeys(model for model, _ in cases))
    tenth = lambda x: f"{x * 1e5:.1f}"  # noqa: E731
    whole = lambda x: f"{x * 1e5:.0f}"  # noqa: E731
    return "\n".join(
        [
            "## Quality at the same count",
            "",
            f"Written by `scripts/benchmark_quality.py` from {len(cases)} cases: "
            f"{', '.join(models)} at the shares below. Every sampler gets the same points and the "
            "same normals (MeshLab's, 12 neighbours) and keeps the same number of points, or more "
            "where its package cannot be asked for a number: then its parameter is searched to "
            "within half a percent from above, which a grid over a regular cloud cannot always "
            "meet. The error is the distance of all originals to the surface, uncut, over the "
            "bounding-box diagonal.",
            "",
            "Every result is reconstructed alike, twice: *as MeshLab builds it*, by ball pivoting "
            "in passes of 1, 1.5, 2.5 and 4 × the median spacing to 6 neighbours, clustering 5 % "
            "(`run --no-fit`); and *as `run` builds it*, which hands MeshLab the outermost points "
            "first and then fits the surface to the original points: parts inside out are turned, "
            "flaps go, holes and seams are closed, points without a face are put in, edges "
            "flipped. Surface first keeps its own triangles in both.",
            "",
            *verdict(cases, everything),
            "![Mean error over the share of points that stays](docs/images/benchmark-quality.png)",
            "",
            "As MeshLab builds it, a surface depends on the order of the points and on single "
            "points: where a ball falls through in one place, a maximum doubles. It does not "
            "depend on normals: MeshLab's ball pivoting never reads them.",
            "",
            "### Over all cases",
            "",
            "Errors, covering radius and distance to a tangent-plane fit relative to ours "
            "(geometric mean; above 1 is worse than ours), sums of edges and of points that were "
            "kept but are not on the surface, geometric mean of the seconds (without the search "
            "for a parameter) and the largest peak of memory. Fewer cases, and a dash below, mean "
            "that a sampler was not run on a model. The seconds compare only roughly.",
            "",
            "As `run` builds it:",
            "",
            *over_cases(cases, "fitted"),
            "As MeshLab builds it:",
            "",
            *over_cases(cases, "plain"),
            "### Where a peer is better",
            "",
            "As `run` builds it:",
            "",
            *losses(cases, "fitted"),
            "As MeshLab builds it:",
            "",
            *losses(cases, "plain"),
            "### Mean error as `run` builds it, 1e-5 of the diagonal",
            "",
            *by_case(cases, "mean", "fitted", tenth),
            "### RMS error as `run` builds it, 1e-5 of the diagonal",
            "",
            *by_case(cases, "rms", "fitted", tenth),
            "### Maximum as `run` builds it, 1e-5 of the diagonal",
            "",
            *by_case(cases, "max", "fitted", whole),
            "### Boundary edges as `run` builds it",
            "",
            *by_case(cases, "boundary_edges", "fitted", str),
            "### Mean error as MeshLab builds it, 1e-5 of the diagonal",
            "",
            *by_case(cases, "mean", "plain", tenth),
            "### Maximum as MeshLab builds it, 1e-5 of the diagonal",
            "",
            *by_case(cases, "max", "plain", whole),
            "### Boundary edges as MeshLab builds it",
            "",
            *by_case(cases, "boundary_edges", "plain", str),
        ]
    )


def write_section(rows: list[Row], output: Path) -> None:
    """Put the section between its markers, or at the end of the file."""
    text = output.read_text(encoding="utf-8") if output.exists() else "# Benchmarks\n"
    made = f"{BEGIN}\n\n{section(rows)}\n{END}"
    if BEGIN in text:
        before, rest = text.split(BEGIN, 1)
        text = before + made + rest.split(END, 1)[1]
    else:
        text = f"{text.rstrip()}\n\n{made}\n"
    output.write_text(text, encoding="utf-8")
    images = output.parent / "docs" / "images"
    if images.is_dir():
        plot(compared(cases_of(rows)), images / "benchmark-quality.png")
