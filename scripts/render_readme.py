"""Render the README's first picture from real runs: docs/images/overview.png.

Original, the paper's rule and ours at the same number of points; the surface that MeshLab rebuilds
through each, coloured by the distance of the original points, one scale for all.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np
import plyfile
from rendering import View, render_mesh

import meshlab_filter as mf
from meshlab_filter.bridge.samples import sample_mesh
from meshlab_filter.colormap import colorize

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.colors import ListedColormap

#: Share of the points that stay, and of the diagonal at which the colour scale ends.
KEEP, TOP = 0.2, 0.004


def surface(folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Read points, faces and the error near each vertex of a run's surface."""
    data = plyfile.PlyData.read(str(folder / "surface.ply"))
    points = np.column_stack([data["vertex"][axis] for axis in "xyz"]).astype(float)
    return points, np.vstack(data["face"]["vertex_indices"]), data["vertex"]["quality"]


def main() -> None:
    """Run the chain three times and draw it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/images/overview.png"))
    arguments = parser.parse_args()
    bunny = sample_mesh("bunny.obj")
    cloud = mf.read_cloud(bunny)
    view = View.of(cloud.points, azimuth=0, elevation=10, width=520, height=500)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        runs = {
            "paper": mf.run(
                bunny, folder / "paper", method="cluster-entropy", keep=KEEP, floor=False
            )
        }
        count = runs["paper"]["points"]["simplified"]
        runs["ours"] = mf.run(bunny, folder / "ours", count=count, floor=False)
        runs["original"] = mf.run(
            bunny, folder / "original", method="random", keep=1.0, floor=False
        )
        titles = {
            "original": f"original scan\n{len(cloud.points)} points",
            "paper": f"cluster-entropy (the paper)\n{count} points",
            "ours": f"adaptive (ours)\n{count} points",
        }
        figure, axes = plt.subplots(1, 3, figsize=(12, 4.6), dpi=100)
        for axis, (name, title) in zip(axes, titles.items()):
            points, faces, quality = surface(folder / name)
            colors = colorize(quality / cloud.diagonal, low=0, high=TOP)
            axis.imshow(render_mesh(points, faces, colors, view), interpolation="antialiased")
            axis.set_axis_off()
            mean = runs[name]["error"]["uncut"]["mean"]
            axis.set_title(f"{title}, mean error {mean:.1e}", fontsize=11)
    shades = ListedColormap(colorize(np.linspace(0, 1, 256), low=0, high=1))
    scale = plt.cm.ScalarMappable(plt.Normalize(0, TOP * 100), shades)
    bar = figure.colorbar(scale, ax=axes, orientation="horizontal", fraction=0.05, pad=0.02,
                          aspect=60, extend="max")  # fmt: skip
    bar.set_label("distance of the original points to the surface, % of the bounding-box diagonal")
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(arguments.out, bbox_inches="tight", facecolor="white")


if __name__ == "__main__":
    main()
