"""Where a result comes from: input, parameters, versions."""

from __future__ import annotations

import hashlib
import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ._version import __version__

PAPER = (
    'A. Mahdaoui and E. H. Sbai, "3D Point Cloud Simplification Based on k-Nearest Neighbor and '
    'Clustering", Advances in Multimedia 2020, 8825205, doi 10.1155/2020/8825205'
)


def fingerprint(path: Path) -> dict[str, Any]:
    """Return name, size in bytes and SHA-256 of a file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    dict
        "path" (as given), "bytes" and "sha256".
    """
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return {"path": str(path), "bytes": path.stat().st_size, "sha256": digest.hexdigest()}


def versions() -> dict[str, str]:
    """Return the versions that a result depends on."""
    packages = ("numpy", "scipy", "scikit-learn", "pymeshlab")
    return {
        "meshlab-filter": __version__,
        "python": platform.python_version(),
        **{name: version(name) for name in packages},
    }


def comments(report: dict[str, Any]) -> list[str]:
    """Return the lines of provenance for a file's header; nothing in them changes between runs.

    Parameters
    ----------
    report : dict
        With "input", "parameters" and "versions".

    Returns
    -------
    list of str
    """
    found = report["versions"]
    settings = " ".join(
        f"{name}={value}" for name, value in report["parameters"].items() if value is not None
    )
    return [
        f"meshlab-filter {found['meshlab-filter']}, pymeshlab {found['pymeshlab']}",
        f"input sha256 {report['input']['sha256']}",
        f"parameters {settings}",
        *([PAPER] if report["parameters"].get("method") == "cluster-entropy" else []),
    ]
