"""Simplify in the middle of a pymeshlab script of your own.

The mesh keeps its normals, colours and whatever else its vertices carry, and the filters that come
after work on what is left::

    python scripts/example_middle_of_script.py [scan] [surface.ply]
"""

from __future__ import annotations

import sys

import pymeshlab

import meshlab_filter as mf
from meshlab_filter.bridge.samples import sample_mesh


def main(scan: str, target: str) -> dict[str, float]:
    """Clean a scan, thin it to a tenth, rebuild its surface and smooth that."""
    ms = pymeshlab.MeshSet(verbose=False)
    ms.load_new_mesh(scan)
    ms.meshing_remove_duplicate_vertices()

    # One line in between: the current layer keeps the tenth of its points that tell most.
    figures = mf.meshing_decimation_adaptive(ms, keep=0.1)

    ms.compute_normal_for_point_clouds(k=12)
    ms.generate_surface_reconstruction_ball_pivoting()
    ms.apply_coord_taubin_smoothing(stepsmoothnum=2)
    ms.save_current_mesh(target)
    figures["faces"] = ms.current_mesh().face_number()
    return figures


if __name__ == "__main__":
    arguments = sys.argv[1:] or [str(sample_mesh("bunny.obj")), "surface.ply"]
    for name, value in main(*arguments).items():
        print(f"{name}: {value}")
