"""The report of a run as one HTML file that opens offline."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .colormap import colorscale
from .display import coarsen, pack, thin
from .errors import OutputError
from .meaning import COLUMNS, error_table, figure_groups
from .measure import Outcome, error_scale, worst_near
from .quality import ACCEPTABLE_COMPACTNESS, PAPER_CUT, compactness
from .repeat import command_line, preset_text, python_lines
from .validation import FloatArray, IntArray

if TYPE_CHECKING:
    import jinja2

#: What the pages are made with; the extra ``report`` installs both.
NEEDED = ("jinja2", "plotly")
INSTALL = "pip install 'meshlab-filter[report]'"


def missing() -> list[str]:
    """Return which of the packages that the pages are made with are not installed.

    Examples
    --------
    >>> set(missing()) <= set(NEEDED)
    True
    """
    return [name for name in NEEDED if find_spec(name) is None]


def check_html() -> None:
    """Say how to install what the pages are made with, if it is not.

    Raises
    ------
    OutputError
        If a package is missing.
    """
    if absent := missing():
        raise OutputError(
            f"The HTML report needs {' and '.join(absent)}: {INSTALL} (or leave it out)."
        )


def write_html(path: Path, outcome: Outcome, report: dict[str, Any]) -> None:
    """Write the page: 3D views, histograms, figures, parameters and how to repeat the run.

    The same run gives the same bytes. Nothing in the page is loaded from elsewhere.

    Parameters
    ----------
    path : Path
    outcome : Outcome
    report : dict
        What ``report.json`` holds; the times are not used.
    """
    result = outcome.result
    name = Path(report["input"]["path"]).name
    page = render(
        "report.html",
        payload={
            "views": views(outcome),
            "histograms": histograms(outcome),
            "colorscale": colorscale(),
        },
        title=f"{name}: {report['points']['original']} points, "
        f"{report['points']['simplified']} left",
        name=name,
        report=report,
        columns=COLUMNS,
        errors=error_table(report["error"]),
        groups=figure_groups(report),
        entropy=result.entropy is not None,
        command=command_line(report),
        python=python_lines(report),
        preset=preset_text(report),
    )
    path.write_text(page, encoding="utf-8", errors="backslashreplace")


def render(template: str, *, payload: dict[str, Any], **values: Any) -> str:
    """Fill a template with data, the plotting library and what it names.

    Parameters
    ----------
    template : str
        Name of a file in ``meshlab_filter/templates``; every value put in is escaped.
    payload : dict
        Data for the page's own script, ready for JSON.
    **values
        What the template names.

    Returns
    -------
    str
    """
    import plotly.offline

    # No "<" in the text of a script element, so that nothing in the data can end it.
    data = json.dumps(payload, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
    return _environment().get_template(template).render(
        payload=data, plotly=plotly.offline.get_plotlyjs(), **values
    )  # fmt: skip


def views(outcome: Outcome) -> list[dict[str, Any]]:
    """Return what is drawn: the original, the simplified cloud and, where there is one, a surface.

    Parameters
    ----------
    outcome : Outcome

    Returns
    -------
    list of dict
        Each with "title", "note", packed "x", "y", "z" (the cloud's unit, from the middle of
        its bounding box), "faces" or None, and "values": packed error (shares of the diagonal),
        rank and, where the method has it, entropy (nats), each with its "low" and "high".
    """
    cloud, result, measured = outcome.scan.cloud, outcome.result, outcome.measured
    shares = measured.distances / cloud.diagonal
    top = error_scale(shares)
    rank = result.rank.astype(np.float64)
    own = {"rank": (rank, 0.0, float(rank.max()))}
    if result.entropy is not None and result.labels is not None:
        finite = result.entropy[np.isfinite(result.entropy)]
        low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
        # A cluster of one point has no entropy and ranks above all others.
        entropy = np.where(np.isfinite(result.entropy), result.entropy, high)
        own["entropy"] = (entropy[result.labels], low, high)

    def view(
        title: str, points: FloatArray, error: FloatArray, source: IntArray,
        faces: IntArray | None = None,
    ) -> dict[str, Any]:  # fmt: skip
        names = ["error", *own]
        table = np.column_stack([error, *(values[source] for values, _, _ in own.values())])
        if faces is None:
            drawn = thin(len(points))
            shown, table = points[drawn], table[drawn]
            note = _note(len(shown), len(points), "points", "chosen at random")
        else:
            shown, drawn_faces, table = coarsen(points, faces, table)
            note = _note(len(drawn_faces), len(faces), "triangles", "after merging vertices")
        ends = {"error": (0.0, top), **{name: (low, high) for name, (_, low, high) in own.items()}}
        return {
            "title": title,
            "note": note,
            **{axis: pack(column) for axis, column in zip("xyz", (shown - outcome.scan.origin).T)},
            "faces": None if faces is None else pack(drawn_faces, "i4"),
            "values": {
                name: {"data": pack(column), "low": ends[name][0], "high": ends[name][1]}
                for name, column in zip(names, table.T)
            },
        }

    kept, source = cloud.points[result.indices], result.indices
    if outcome.other is not None:
        kept, source = outcome.other, _nearest(outcome.other, kept, source)
    everything = np.arange(len(cloud.points))
    out = [
        view("Original", cloud.points, shares, everything),
        view("Simplified", kept, worst_near(kept, cloud.points, shares), source),
    ]
    if len(measured.faces):
        worst = worst_near(measured.points, cloud.points, shares)
        source = _nearest(measured.points, kept, source)
        out.append(view("Surface", measured.points, worst, source, measured.faces))
    return out


def _nearest(points: FloatArray, kept: FloatArray, source: IntArray) -> IntArray:
    """Return the index into the cloud of the kept point nearest to each of some points."""
    from scipy.spatial import cKDTree

    _, nearest = cKDTree(kept).query(points, workers=-1)
    found: IntArray = source[nearest]
    return found


def histograms(outcome: Outcome) -> list[dict[str, Any]]:
    """Return the histograms: error, compactness and, for clusters, size and entropy.

    Parameters
    ----------
    outcome : Outcome

    Returns
    -------
    list of dict
        Each with "title", "x" and "y" (axis titles), "log" (whether the counts are drawn on a
        logarithmic scale), "stack", "mark" (a value to draw a line at, or None), its "label", and
        "series": "name", "edges" and "counts".
    """
    cloud, result = outcome.scan.cloud, outcome.result
    measured, base = outcome.measured, outcome.base
    found = {"simplified": measured} | ({} if base is None else {"untouched": base})
    shares = {name: each.distances / cloud.diagonal for name, each in found.items()}
    top = max(float(each.max()) for each in shares.values()) or 1.0
    out = [
        {
            "title": "Error of the original points",
            "x": "error, share of the diagonal",
            "y": "points (logarithmic)",
            "log": True,
            "mark": PAPER_CUT if top > PAPER_CUT else None,
            "label": "cut at 1 %",
            "series": [_series(name, each, 0.0, top, 60) for name, each in shares.items()],
        }
    ]
    if len(measured.faces):
        shapes = {name: compactness(each.points, each.faces) for name, each in found.items()}
        out.append(
            {
                "title": "Compactness of the triangles",
                "x": "compactness, 1: equilateral",
                "y": "triangles, % of all",
                "log": False,
                "mark": ACCEPTABLE_COMPACTNESS,
                "label": "acceptable from here",
                "series": [
                    _series(name, each, 0.0, 1.0, 50, percent=True) for name, each in shapes.items()
                ],
            }
        )
    if result.labels is not None and result.entropy is not None:
        out += _cluster_histograms(result.labels, result.entropy, result.indices)
    return out


def _cluster_histograms(
    labels: IntArray, entropy: FloatArray, indices: IntArray
) -> list[dict[str, Any]]:
    """Return the histograms of size and entropy, of the clusters left and of those deleted."""
    size = np.bincount(labels, minlength=len(entropy))
    kept = np.zeros(len(size), dtype=bool)
    kept[labels[indices]] = True
    finite = np.isfinite(entropy)
    # Bins of whole sizes, so that none is wider than its neighbours.
    step = -(-int(np.ptp(size) + 1) // 40)
    low = float(size.min()) - 0.5
    bins = int(np.ptp(size)) // step + 1
    spread = entropy[finite] if finite.any() else np.zeros(1)
    edges = {
        "Size of the clusters": (low, low + step * bins, bins),
        "Entropy of the clusters": (float(spread.min()), float(spread.max()), 40),
    }
    values = {"Size of the clusters": size.astype(np.float64), "Entropy of the clusters": entropy}
    axes = {
        "Size of the clusters": "points in a cluster",
        "Entropy of the clusters": "entropy, nats",
    }
    return [
        {
            "title": title,
            "x": axes[title],
            "y": "clusters",
            "log": False,
            "stack": True,
            "mark": None,
            "label": "",
            "series": [
                _series(name, each[np.isfinite(each) & which], *edges[title])
                for name, which in (("left", kept), ("deleted", ~kept))
            ],
        }
        for title, each in values.items()
    ]


def _series(
    name: str, values: FloatArray, low: float, high: float, bins: int, *, percent: bool = False
) -> dict[str, Any]:
    """Count values in bins of equal width."""
    span = (low, high) if high > low else (low - 0.5, low + 0.5)
    counts, edges = np.histogram(values, bins=bins, range=span)
    heights = counts * (100 / max(len(values), 1)) if percent else counts
    return {"name": name, "edges": edges.tolist(), "counts": heights.tolist()}


def _note(drawn: int, total: int, things: str, how: str) -> str:
    if drawn == total:
        return f"{total} {things}"
    return f"{total} {things}, of which {drawn} are drawn, {how}; every figure counts all"


def _environment() -> jinja2.Environment:
    import jinja2

    return jinja2.Environment(
        loader=jinja2.PackageLoader("meshlab_filter"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
