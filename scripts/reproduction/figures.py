"""The pictures of the reproduction, drawn without a display."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from rendering import View, render_mesh, render_points

from meshlab_filter.colormap import colorize

from .subjects import SUBJECTS, Cloud

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullLocator

GREY = np.array([0.72, 0.74, 0.78])
DARK = np.array([0.16, 0.25, 0.45])
_UNSEEN = 8  # of 255: differences of a colour that nobody sees
CIVIDIS = ListedColormap(colorize(np.linspace(0, 1, 256), low=0, high=1))


def view_of(name: str, cloud: Cloud, *, width: int = 420, height: int = 420) -> View:
    """Return the view that all pictures of a model share."""
    subject = SUBJECTS[name]
    return View.of(
        cloud.points,
        azimuth=subject.azimuth,
        elevation=subject.elevation,
        up=subject.up,
        width=width,
        height=height,
    )


def _save(figure: plt.Figure, path: Path) -> None:
    figure.savefig(path, dpi=100, bbox_inches="tight", pad_inches=0.08)
    plt.close(figure)
    from PIL import Image, ImageChops

    # 256 colours are enough for shaded grey and one colour map, and a quarter of the size.
    picture = Image.open(path).convert("RGB")
    small = picture.quantize(256, method=Image.Quantize.MAXCOVERAGE)
    difference = ImageChops.difference(picture, small.convert("RGB"))
    close = max(high for _, high in difference.getextrema()) <= _UNSEEN
    (small if close else picture).save(path, optimize=True)


def _show(axes: plt.Axes, picture: np.ndarray, title: str) -> None:
    axes.imshow(picture, interpolation="lanczos")
    axes.set_title(title, fontsize=10)
    axes.axis("off")


def compactness_histograms(before: np.ndarray, after: np.ndarray, path: Path) -> None:
    """Draw Figs 3 and 4: compactness of Bimba's triangles, before and after."""
    figure, panels = plt.subplots(1, 2, figsize=(9, 3.4), sharey=True, layout="constrained")
    for axes, values, title in zip(panels, (before, after), ("original", "simplified")):
        share = np.ones(len(values)) / len(values) * 100
        axes.hist(values, bins=50, range=(0, 1), weights=share, color=DARK)
        axes.axvline(0.6, color="black", linestyle="--", linewidth=1)
        good = (values >= 0.6).mean() * 100
        axes.set_title(f"{title}: {good:.2f} % at 0.6 and above", fontsize=10)
        axes.set_xlabel("compactness of a triangle")
    panels[0].set_ylabel("share of triangles in %")
    _save(figure, path)


def side_by_side(scenes: dict[str, dict[str, Any]], path: Path, *, surfaces: bool) -> None:
    """Draw Figs 5 and 6: each model's cloud or surface, original above and simplified below."""
    figure, panels = plt.subplots(
        2, len(scenes), figsize=(2.4 * len(scenes), 5.4), squeeze=False, layout="constrained"
    )
    for column, (name, scene) in zip(panels.T, scenes.items()):
        cloud = scene["cloud"]
        view = view_of(name, cloud, width=300, height=300)
        for axes, part in zip(column, ("original", "simplified")):
            kept, faces = scene[part]["kept"], scene[part]["faces"]
            points = cloud.points[kept]
            if surfaces:
                picture = render_mesh(points, faces, GREY, view)
            else:
                picture = render_points(points, _shade(cloud.normals[kept], view), view, radius=0.5)
            title = SUBJECTS[name].title + "\n" if part == "original" else ""
            _show(axes, picture, f"{title}{part}, {len(kept)} points")
    _save(figure, path)


def _shade(normals: np.ndarray, view: View) -> np.ndarray:
    """Return a dark colour for each point, lighter where its normal looks at the viewer."""
    facing = np.abs(normals @ view.rotation[2])[:, None]
    return DARK * 0.6 + (0.75 - DARK * 0.6) * facing**2


def levels_of_detail(cloud: Cloud, scenes: dict[str, dict[str, Any]], path: Path) -> None:
    """Draw Fig. 7: the bunny's surface, untouched and with 30, 40 and 60 clusters deleted."""
    figure, panels = plt.subplots(
        1, len(scenes), figsize=(3 * len(scenes), 3.4), squeeze=False, layout="constrained"
    )
    view = view_of("bunny", cloud, width=380, height=380)
    for axes, (title, scene) in zip(panels[0], scenes.items()):
        picture = render_mesh(cloud.points[scene["kept"]], scene["faces"], GREY, view)
        _show(axes, picture, f"{title}\n{len(scene['kept'])} points")
    _save(figure, path)


def errors_in_colour(
    name: str,
    cloud: Cloud,
    faces: np.ndarray,
    scenes: dict[str, dict[str, Any]],
    path: Path,
    *,
    top: float,
) -> None:
    """Draw the original surface with the error of each of its points, on one scale.

    ``faces`` are those of the untouched cloud's surface; ``top`` is where the scale ends, as a
    share of the diagonal.
    """
    columns = 4 if len(scenes) == 4 else min(len(scenes), 3)
    rows = -(-len(scenes) // columns)
    figure, panels = plt.subplots(
        rows,
        columns,
        figsize=(2.9 * columns + 0.8, 3.3 * rows),
        squeeze=False,
        layout="constrained",
    )
    view = view_of(name, cloud, width=380, height=380)
    for axes in panels.flat:
        axes.axis("off")
    for axes, (title, scene) in zip(panels.flat, scenes.items()):
        colors = colorize(scene["distances"] / cloud.diagonal, low=0, high=top)[:, :3]
        _show(axes, render_mesh(cloud.points, faces, colors, view), title)
    scale = mpl.cm.ScalarMappable(mpl.colors.Normalize(0, top * 100), CIVIDIS)
    bar = figure.colorbar(scale, ax=panels, shrink=0.8, extend="max")
    bar.set_label("error of the original points,\n% of the diagonal")
    _save(figure, path)


def clusters_and_entropy(
    cloud: Cloud,
    faces: np.ndarray,
    labels: np.ndarray,
    entropy: np.ndarray,
    deleted: int,
    path: Path,
) -> None:
    """Draw the bunny's clusters, their entropy and which of them go, on the original surface."""
    figure, panels = plt.subplots(1, 3, figsize=(10.4, 3.6), layout="constrained")
    view = view_of("bunny", cloud, width=420, height=420)
    shuffled = np.random.default_rng(0).permutation(len(entropy))[labels] / len(entropy)
    colors = plt.get_cmap("turbo")(shuffled)[:, :3]
    _show(panels[0], render_mesh(cloud.points, faces, colors, view), f"{len(entropy)} clusters")
    low, high = np.nanpercentile(entropy, [2, 98])
    colors = colorize(entropy[labels], low=low, high=high)[:, :3]
    _show(panels[1], render_mesh(cloud.points, faces, colors, view), "entropy in nats")
    scale = mpl.cm.ScalarMappable(mpl.colors.Normalize(low, high), CIVIDIS)
    figure.colorbar(scale, ax=panels[1], shrink=0.8, extend="both")
    order = np.argsort(np.where(np.isnan(entropy), np.inf, entropy), kind="stable")
    going = np.isin(labels, order[:deleted])
    colors = np.where(going[:, None], [0.85, 0.37, 0.0], GREY)
    _show(
        panels[2],
        render_mesh(cloud.points, faces, colors, view),
        f"the {deleted} of lowest entropy, deleted",
    )
    _save(figure, path)


#: Line style of each method in the plots: ours and the paper's stand out.
HIGHLIGHTED = {"adaptive": ("#0072b2", 2.5), "cluster-entropy": ("#d55e00", 2.5)}
#: Colours that colour-blind people can tell apart (Okabe and Ito), for the others.
COLORS = ("#000000", "#56b4e9", "#009e73", "#cc79a7", "#e69f00")
MARKERS = "osv^D<>Pp*hX"


def comparison(
    name: str, curves: dict[str, list[list[dict[str, Any]]]], total: int, path: Path
) -> None:
    """Plot mean error against the share of points kept, one line a method, and bars of ± 1 sd.

    To the right the same errors as multiples of random deletion's, which sets apart what runs
    together to the left. The legend is in the order of the errors where fewest points are kept.
    """
    means = {
        method: np.array([np.mean([run["uncut"]["mean"] for run in runs]) for runs in counts])
        for method, counts in curves.items()
    }
    widths = [5.0, 5.0] if "random" in curves else [7.0]
    figure, panels = plt.subplots(
        1, len(widths), figsize=(sum(widths) + 1.6, 4.6), squeeze=False, layout="constrained"
    )
    handles = {}
    for number, (method, counts) in enumerate(curves.items()):
        color, width = HIGHLIGHTED.get(method, (COLORS[number % len(COLORS)], 1.0))
        style = "-" if method in HIGHLIGHTED or number % 2 else "--"
        share = [np.mean([run["kept"] for run in runs]) / total * 100 for runs in counts]
        deviation = np.array(
            [np.std([run["uncut"]["mean"] for run in runs], ddof=len(runs) > 1) for runs in counts]
        )
        look = {"color": color, "linestyle": style, "marker": MARKERS[number % 12], "lw": width}
        for axes, unit in zip(panels[0], (1.0, means.get("random"))):
            axes.errorbar(
                share, means[method] / unit, deviation / unit, markersize=4, elinewidth=1, **look
            )
        handles[method] = Line2D([], [], label=method, markersize=4, **look)
    for axes, label in zip(
        panels[0], ("mean error, share of the diagonal", "mean error over that of random deletion")
    ):
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xticks([5, 10, 20, 50, 91], ["5", "10", "20", "50", "91"])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel("points kept, %")
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
    if len(widths) > 1:
        panels[0, 1].yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        panels[0, 1].yaxis.set_major_formatter("{x:g}")
    figure.suptitle(f"{SUBJECTS[name].title}: all methods at the same count", fontsize=10)
    order = sorted(handles, key=lambda method: -means[method][-1])
    legend = {"loc": "outside right upper", "fontsize": 8, "frameon": False}
    figure.legend(handles=[handles[method] for method in order], **legend)
    _save(figure, path)
