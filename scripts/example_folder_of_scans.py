"""A folder of scans, each with its report; a bad file does not stop the rest.

On the command line the same is ``meshlab-filter run *.ply --preset default --out result/``::

    python scripts/example_folder_of_scans.py [folder] [results]
"""

from __future__ import annotations

import sys
from pathlib import Path

import meshlab_filter as mf
from meshlab_filter.bridge.samples import sample_mesh
from meshlab_filter.errors import MeshlabFilterError


def main(folder: str, out: str, preset: str = "default") -> dict[str, str]:
    """Run a preset on every scan of a folder; return a line about each."""
    lines = {}
    for scan in sorted(Path(folder).glob("*.ply")):
        try:
            report = mf.run_preset(scan, Path(out) / scan.stem, preset, floor=False)
        except MeshlabFilterError as error:
            lines[scan.name] = str(error)
            continue
        points, error = report["points"], report["error"]["uncut"]
        lines[scan.name] = (
            f"{points['original']} -> {points['simplified']} points, mean error "
            f"{error['mean']:.2e} of the diagonal"
        )
    return lines


if __name__ == "__main__":
    arguments = sys.argv[1:] or [str(sample_mesh("rangemaps/face000.ply").parent), "result"]
    for name, line in main(*arguments).items():
        print(f"{name}: {line}")
