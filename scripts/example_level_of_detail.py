"""Every level of detail from one annotation.

Ranking the cloud is the work; a level of detail is then a condition on the quality, which MeshLab
evaluates at once::

    python scripts/example_level_of_detail.py [scan]
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import pymeshlab

from meshlab_filter.annotation import annotate_file
from meshlab_filter.bridge.samples import sample_mesh
from meshlab_filter.mlx import FilterScript
from meshlab_filter.presets import PRESETS
from meshlab_filter.steps import ball_pivoting, hausdorff, point_normals, thinning

#: Per cent of the points that go.
CUTS = (50, 80, 90, 95)


def main(scan: str) -> list[dict[str, float]]:
    """Return points, faces and errors of each level, finest first."""
    import meshlab_filter as mf

    levels = []
    with tempfile.TemporaryDirectory() as folder:
        annotated = Path(folder) / "annotated.ply"
        annotate_file(scan, annotated, preset=PRESETS["adaptive"].script())
        for cut in CUTS:
            ms = pymeshlab.MeshSet(verbose=False)
            ms.load_new_mesh(str(annotated))
            # Without the instruction nothing is ranked again: the quality in the file counts.
            steps = (*thinning(cut), point_normals(), ball_pivoting(), hausdorff())
            levels.append(mf.apply_preset(ms, FilterScript(steps)))
    return levels


if __name__ == "__main__":
    source = sys.argv[1] if len(sys.argv) > 1 else str(sample_mesh("bunny.obj"))
    print("points   faces    mean error (share of the diagonal)")
    for level in main(source):
        share = level["mean"] / level["diag_mesh_0"]
        print(f"{level['vertices_after']:<8} {level['faces']:<8} {share:.3e}")
