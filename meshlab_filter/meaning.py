"""The figures of a report with what they mean, for people."""

from __future__ import annotations

from typing import Any

from .report import error_rows

#: Row of the table of errors → what it means.
ERRORS = {
    "uncut": "Every original point counts, however far from the surface it is. Judge a result by "
    "this row: a hole shows in it.",
    "cut at 1 %": "Points farther from the surface than 1 % of the diagonal are dropped before "
    "the mean and the maximum are taken, as in the paper's tables. A hole hides behind this: look "
    "at how many points were dropped.",
    "floor": "The surface that MeshLab rebuilds through the untouched cloud. Rebuilding has an "
    "error of its own, even when no point is taken away; what is above the floor is due to the "
    "simplification.",
    "floor, cut": "The floor, with points beyond 1 % of the diagonal dropped.",
}

#: Columns of the table of errors.
COLUMNS = ("", "mean", "RMS", "95 %", "99 %", "max", "points", "dropped")

Row = tuple[str, str, str]


def error_table(error: dict[str, Any]) -> list[tuple[tuple[str, ...], str]]:
    """Return the rows of the table of errors, each with what it means.

    Parameters
    ----------
    error : dict
        The report's "error".

    Returns
    -------
    list of (tuple of str, str)
    """
    return [(row, ERRORS[row[0]]) for row in error_rows(error)]


def figure_groups(report: dict[str, Any]) -> list[tuple[str, list[Row]]]:
    """Return the other figures in groups: name, value and meaning.

    Parameters
    ----------
    report : dict
        What :func:`meshlab_filter.run` returns.

    Returns
    -------
    list of (str, list of tuple of str)
    """
    groups = [("Points", _points(report))]
    if report["clusters"]["total"] is not None:
        groups.append(("Clusters", _clusters(report)))
    if report["surface"]["surface"] != "none":
        groups.append(("Surface", _surface(report)))
    return groups


def _points(report: dict[str, Any]) -> list[Row]:
    points, given = report["points"], report["input"]
    share = points["simplified"] / points["original"]
    rows = [
        ("original", str(points["original"]), "points of the input"),
        ("simplified", f"{points['simplified']} ({share:.2%})", "points that stay, unchanged"),
        ("removed", str(points["removed"]), "points taken away"),
    ]
    if report["parameters"]["asked"] is not None:
        rows.append(("missed", f"{points['missed']:+d}", "points kept beyond the number asked for"))
    rows.append(
        (
            "covering radius", f"{points['covering_radius']:.2e}",
            "share of the diagonal: how far the worst original point is from the nearest one left",
        )
    )  # fmt: skip
    rows.append(
        ("diagonal", f"{report['diagonal']:.6g}",
         "of the original's bounding box, in the file's unit: errors are shares of it")
    )  # fmt: skip
    if given["dropped"]:
        rows.append(("left out", str(given["dropped"]), "records that were not finite"))
    if given["faces"]:
        rows.append(("faces of the input", str(given["faces"]), "not used: the cloud counts"))
    return rows


def _clusters(report: dict[str, Any]) -> list[Row]:
    clusters = report["clusters"]
    return [
        ("clusters", str(clusters["total"]), "that k-means made"),
        ("deleted", str(clusters["deleted"]), "clusters of lowest entropy, taken away whole"),
    ]


def _surface(report: dict[str, Any]) -> list[Row]:
    surface = report["surface"]
    rows = [
        ("kind", surface["surface"], "how MeshLab rebuilt the surface"),
        ("vertices", str(surface["vertices"]), ""),
        ("faces", str(surface["faces"]), "a closed surface has about two per vertex"),
        ("holes", str(surface["holes"]), "connected groups of edges with a single face"),
        ("boundary edges", str(surface["boundary_edges"]), "edges with a single face"),
        ("non-manifold edges", str(surface["nonmanifold_edges"]), "edges with three or more faces"),
        (
            "compact triangles", f"{surface['compactness']:.2%}",
            "triangles of compactness 0.6 and above, acceptable in the paper's sense",
        ),
    ]  # fmt: skip
    if surface["compactness_before"] is not None:
        rows.append(
            ("compact before", f"{surface['compactness_before']:.2%}",
             "the same for the surface through the untouched cloud")
        )  # fmt: skip
    return rows
