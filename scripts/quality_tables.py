"""Tables of BENCHMARK.md's section on quality, from what benchmark_quality.py measured."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from quality_models import MODELS
from quality_samplers import PEERS, SAMPLERS, SURFACE_FIRST

BEGIN, END = "<!-- quality:begin -->", "<!-- quality:end -->"
OURS, PAPER, EVEN = "adaptive", "cluster-entropy", "fpsample farthest point"
PAPER_SHARE = 0.91
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


def best_peer(case: dict[str, Row], figure: str) -> tuple[str, float]:
    """Return the peer sampler with the least figure of a case, and the figure."""
    return min(((s, case[s][figure]) for s in PEERS if s in case), key=lambda pair: pair[1])


def compared(cases: Cases) -> Cases:
    """Leave the cases in which ours and at least one peer were measured."""
    return {
        key: case
        for key, case in cases.items()
        if OURS in case and len(set(case) & set(PEERS)) > 1 and key[1] != PAPER_SHARE
    }


def against_peers(cases: Cases, figure: str) -> dict[tuple[str, float], float]:
    """Ratio of our figure to that of the best peer of each single case."""
    return {key: case[OURS][figure] / best_peer(case, figure)[1] for key, case in cases.items()}


def table(head: list[str], lines: Iterable[list[str]]) -> list[str]:
    """Lines of a Markdown table, the first column to the left and the others to the right."""
    rule = "|".join(["---"] + ["---:"] * (len(head) - 1))
    return [f"| {' | '.join(head)} |", f"|{rule}|", *(f"| {' | '.join(x)} |" for x in lines), ""]


def verdict(cases: Cases, everything: Cases) -> list[str]:
    """Set what was measured beside what was aimed at."""
    lines = []
    for figure, name, aim, ceiling in (
        ("mean", "mean error", "≤ 0.60", 1.0),
        ("rms", "RMS error", "≤ 0.65", None),
        ("max", "maximum", "≤ 0.85", 2.0),
    ):
        ratios = list(against_peers(cases, figure).values())
        lines.append([f"{name} / best peer of each case", aim, f"{geometric_mean(ratios):.2f}"])
        if ceiling:
            above = sum(ratio > ceiling for ratio in ratios)
            lines.append(
                [
                    f"{name}: cases above {ceiling:g} × the best peer",
                    "0",
                    f"{above} of {len(ratios)}",
                ]
            )
    closed = [c for (model, _), c in cases.items() if MODELS[model].closed and EVEN in c]
    ours, even = (sum(c[s]["boundary_edges"] for c in closed) for s in (OURS, EVEN))
    lines.append(
        ["boundary edges / farthest point's, closed models", "≤ 1.5", f"{ours / max(even, 1):.1f}"]
    )
    first = [c[OURS]["mean"] / c[s]["mean"] for c in cases.values() for s in SURFACE_FIRST
             if s == "surface first" and s in c]  # fmt: skip
    lines.append(
        ["mean error / surface first with original points", "≤ 1.1", f"{geometric_mean(first):.2f}"]
    )
    paper = [c[PAPER]["mean"] / c[OURS]["mean"] for (_, share), c in everything.items()
             if share == PAPER_SHARE and PAPER in c and OURS in c]  # fmt: skip
    if paper:
        lines.append(
            [
                f"the paper's rule's mean error / ours at {PAPER_SHARE:.0%}",
                "≥ 10",
                f"{geometric_mean(paper):.1f}",
            ]
        )
    return table(["figure (geometric mean)", "aim", "measured"], lines)


def by_case(cases: Cases, figure: str, write: Callable[[float], str]) -> list[str]:
    """One line a case, one column a sampler; the best peer in bold."""
    samplers = [s for s in SAMPLERS if any(s in case for case in cases.values())]
    lines = []
    for (model, share), case in cases.items():
        best, _ = best_peer(case, figure)
        cells = [write(case[s][figure]) if s in case else "–" for s in samplers]
        cells = [f"**{c}**" if s == best else c for s, c in zip(samplers, cells)]
        lines.append([f"{model} {share:.0%}", *cells])
    return table(["case", *samplers], lines)


def over_cases(cases: Cases) -> list[str]:
    """One line a sampler: figures relative to ours on the geometric mean, sums of defects."""
    lines = []
    for sampler in SAMPLERS:
        both = [c for c in cases.values() if sampler in c and OURS in c]
        if not both:
            continue
        cells = [
            f"{geometric_mean([c[sampler][f] / c[OURS][f] for c in both]):.2f}"
            for f in ("mean", "rms", "p99", "max", "covering", "plane")
        ]
        seconds = geometric_mean([max(c[sampler]["seconds"], 1e-4) for c in both])
        memory = max(c[sampler]["bytes_per_point"] for c in both)
        cells += [
            str(sum(c[sampler]["boundary_edges"] for c in both)),
            str(sum(c[sampler]["nonmanifold_edges"] for c in both)),
            f"{seconds:.2f}", f"{memory:.0f}", str(len(both)),
        ]  # fmt: skip
        lines.append([sampler, *cells])
    head = ["sampler", "mean", "RMS", "p99", "max", "covering radius", "plane fit",
            "boundary edges", "non-manifold", "seconds", "bytes / point", "cases"]  # fmt: skip
    return table(head, lines)


def losses(cases: Cases) -> list[str]:
    """Name the cases in which a peer is better."""
    lines = []
    for figure, name in (("mean", "mean"), ("rms", "RMS"), ("max", "maximum")):
        worse = {k: r for k, r in against_peers(cases, figure).items() if r > 1}
        listed = ", ".join(
            f"{model} {share:.0%} ({ratio:.2f} ×, {best_peer(cases[model, share], figure)[0]})"
            for (model, share), ratio in sorted(worse.items(), key=lambda pair: -pair[1])
        )
        lines.append(f"- {name}: {len(worse)} of {len(cases)} cases. {listed}".rstrip() + "\n")
    return lines


def section(rows: list[Row]) -> str:
    """Return the whole section as Markdown."""
    everything = cases_of(rows)
    cases = compared(everything)
    models = list(dict.fromkeys(model for model, _ in cases))
    share = "{:.1f}".format
    return "\n".join(
        [
            "## Quality at the same count",
            "",
            f"Written by `scripts/benchmark_quality.py` from {len(cases)} cases: "
            f"{', '.join(models)} at the shares below. Every sampler gets the same points and the "
            "same normals (MeshLab's, 12 neighbours) and keeps the same number of points, or up to "
            "half a percent more where its package cannot be asked for a number and its parameter "
            "can be searched so far. Every result is reconstructed alike: ball pivoting in "
            "passes of 1, 1.5, 2.5 and 4 × the median spacing to 6 neighbours, clustering 5 %. "
            "Surface first keeps its own triangles. The error is the distance of all originals "
            "to the surface, uncut, over the bounding-box diagonal.",
            "",
            *verdict(cases, everything),
            "Ball pivoting depends on the order of the points and on single points: where it fails "
            "in one place, a maximum doubles. Its result does not depend on normals: MeshLab's "
            "filter never reads them.",
            "",
            "### Over all cases",
            "",
            "Errors, covering radius and distance to a tangent-plane fit relative to ours "
            "(geometric mean; above 1 is worse than ours), sums of edges, geometric mean of the "
            "seconds (without the search for a parameter) and the largest peak of memory. Fewer "
            "cases, and a dash below, mean that a sampler was not run on a model. The seconds are "
            "from a two-core machine with other work on it: they compare only roughly.",
            "",
            *over_cases(cases),
            "### Where a peer is better",
            "",
            *losses(cases),
            "### Mean error, 1e-5 of the diagonal",
            "",
            *by_case(cases, "mean", lambda x: share(x * 1e5)),
            "### RMS error, 1e-5 of the diagonal",
            "",
            *by_case(cases, "rms", lambda x: share(x * 1e5)),
            "### Maximum, 1e-5 of the diagonal",
            "",
            *by_case(cases, "max", lambda x: f"{x * 1e5:.0f}"),
            "### Boundary edges",
            "",
            *by_case(cases, "boundary_edges", str),
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
