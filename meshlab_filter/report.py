"""The report of a run, as a file and as a short table."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

#: Rises when a key of the report changes its meaning or goes.
SCHEMA_VERSION = 1


def write_report(report: dict[str, Any], path: Path) -> None:
    """Write the report as JSON (docs/report.md says what each key means).

    Parameters
    ----------
    report : dict
    path : Path
    """
    path.write_text(json.dumps(report, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def error_rows(error: dict[str, Any]) -> list[tuple[str, ...]]:
    """Return the rows of a table of errors, each figure as a share of the diagonal.

    Parameters
    ----------
    error : dict
        Of summaries by :func:`meshlab_filter.quality.summarise_errors`; None entries are left out.

    Returns
    -------
    list of tuple of str
        Name, mean, RMS, 95th and 99th percentile, maximum, samples and samples dropped.

    Examples
    --------
    >>> summary = dict(mean=1e-4, rms=2e-4, p95=4e-4, p99=5e-4, max=1e-2, samples=9, dropped=1)
    >>> error_rows({"cut": summary})
    [('cut at 1 %', '1.00e-04', '2.00e-04', '4.00e-04', '5.00e-04', '1.00e-02', '9', '1')]
    """
    names = {
        "uncut": "uncut",
        "cut": "cut at 1 %",
        "floor": "floor",
        "floor_cut": "floor, cut",
    }
    return [
        (
            names[key],
            *(_share(summary[figure]) for figure in ("mean", "rms", "p95", "p99", "max")),
            str(summary["samples"]),
            str(summary["dropped"]),
        )
        for key, summary in error.items()
        if summary is not None
    ]


def _share(value: float | None) -> str:
    return "-" if value is None else f"{value:.2e}"
