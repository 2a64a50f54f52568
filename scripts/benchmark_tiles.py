"""Measure what tiling costs and what it changes; write it to BENCHMARK.md.

A cloud of many copies of one model is simplified tile by tile in one process, by cluster entropy
and by the adaptive method, and the peak memory of each is taken; and a smaller one is simplified
whole and in tiles, next to whole from another seed, which is how far two runs of the same method
are apart anyway.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import laspy
import numpy as np
from benchmark_speed import peak_bytes, tiled, versions, write_section
from scipy.spatial import cKDTree
from scipy.stats import spearmanr

from meshlab_filter.clustering import kmeans
from meshlab_filter.distributed import simplify_tiles
from meshlab_filter.entropy import cluster_entropy
from meshlab_filter.tiles import locate, median_cuts
from meshlab_filter.tiletasks import tile_seed

MARKS = ("<!-- tiles:begin -->", "<!-- tiles:end -->")
COPY = 500_000
DELETE = 0.074
#: What each method is asked for.
ASKED = {"cluster-entropy": {"delete": DELETE}, "adaptive": {"keep": 0.1}}


def write_las(path: Path, size: int) -> None:
    """Write copies of a cloud side by side, a copy at a time."""
    model = tiled(min(size, COPY))
    model -= model.min(axis=0)
    edge = 1.05 * model.max()
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales = np.full(3, 10.0 ** np.floor(np.log10(edge * 1e-6)))
    header.offsets = np.array([500_000.0, 5_400_000.0, 0.0])
    side = int(np.ceil(np.sqrt(-(-size // len(model)))))
    with laspy.open(path, mode="w", header=header) as writer:
        for begin in range(0, size, len(model)):
            copy = begin // len(model)
            part = model[: size - begin] + edge * np.array([copy % side, copy // side, 0])
            rows = laspy.ScaleAwarePointRecord.zeros(len(part), header=header)
            rows["x"], rows["y"], rows["z"] = (part + header.offsets).T
            writer.write_points(rows)


def run_tiles(path: str, method: str) -> dict[str, float]:
    """Simplify a file in this process."""
    before, begin, processor = peak_bytes(), time.perf_counter(), time.process_time()
    report = simplify_tiles(
        path, f"{path}.out.laz", method=method, scheduler="threads", **ASKED[method],
        progress=lambda stage, share: print(stage, share, file=sys.stderr),
    )  # fmt: skip
    return {
        "seconds": time.perf_counter() - begin,
        "cpu": time.process_time() - processor,
        "peak": peak_bytes(),
        "before": before,
        "tiles": report["tiles"],
        "kept": report["points"]["simplified"],
    }


def rank_in_tiles(points: np.ndarray, tiles: int, seed: int) -> dict[str, np.ndarray]:
    """Cluster and rank as the tiles' tasks do: entropy of each point's cluster, who goes."""
    cells = np.rint((points - points.min(axis=0)) * (1e9 / np.ptp(points))).astype("i4")
    home = locate(median_cuts(cells, np.ones(3), tiles), cells)
    labels, entropy, inertia = np.empty(len(points), dtype=np.int64), [], 0.0
    for tile in range(tiles):
        rows = np.flatnonzero(home == tile)
        result = kmeans(points[rows], round(len(rows) / 20), seed=tile_seed(seed, tile))
        labels[rows] = result.labels + sum(map(len, entropy))
        entropy.append(cluster_entropy(points[rows], result.labels))
        inertia += result.inertia
    every = np.concatenate(entropy)
    deleted = np.argsort(every, kind="stable")[: round(DELETE * len(every))]
    gone = np.isin(labels, deleted)
    gaps = cKDTree(points[~gone]).query(points[gone])[0]
    return {"inertia": inertia, "entropy": every[labels], "gone": gone, "gaps": gaps}


def compare(size: int) -> list[str]:
    """Return a row for each way to run, against the whole cloud with seed 0."""
    points = tiled(size)
    diagonal = np.linalg.norm(np.ptp(points, axis=0))
    whole = rank_in_tiles(points, 1, 0)
    rows = []
    for name, tiles, seed in (
        ("whole", 1, 0), ("whole, another seed", 1, 1),
        ("4 tiles", 4, 0), ("16 tiles", 16, 0), ("64 tiles", 64, 0),
    ):  # fmt: skip
        this = whole if (tiles, seed) == (1, 0) else rank_in_tiles(points, tiles, seed)
        both = (this["gone"] & whole["gone"]).sum() / whole["gone"].sum()
        rows.append(
            f"| {name} | {this['inertia'] / whole['inertia']:.4f} | "
            f"{spearmanr(this['entropy'], whole['entropy'])[0]:.3f} | {this['gone'].sum()} | "
            f"{both:.1%} | {this['gaps'].sum() / size / diagonal:.3g} | "
            f"{this['gaps'].max() / diagonal:.3g} |"
        )
        print(rows[-1], flush=True)
    return rows


def measure(path: Path, size: int, method: str) -> str:
    """Take the figures of one method in a fresh process and return them as a row."""
    write_las(path, size)
    command = [sys.executable, __file__, "--measure", str(path), method]
    output = subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout
    found = json.loads(output.splitlines()[-1])
    millions = size / 1e6
    row = (
        f"| {method} | {size} | {found['tiles']} | {found['kept']} "
        f"| {found['before'] / 2**30:.2f} | {found['peak'] / 2**30:.2f} "
        f"| {found['seconds'] / millions:.1f} | {found['cpu'] / millions:.1f} |"
    )
    print(row, flush=True)
    return row


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, default=20_000_000, help="by cluster entropy")
    parser.add_argument("--adaptive-size", type=int, default=5_000_000)
    parser.add_argument("--compare-size", type=int, default=200_000)
    parser.add_argument("--folder", type=Path, help="where the large files go for the while")
    parser.add_argument("--out", type=Path, default=Path("BENCHMARK.md"))
    parser.add_argument("--measure", nargs=2, metavar=("FILE", "METHOD"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.measure:
        print(json.dumps(run_tiles(*arguments.measure)))
        return
    sizes = {"cluster-entropy": arguments.size, "adaptive": arguments.adaptive_size}
    with tempfile.TemporaryDirectory(dir=arguments.folder) as folder:
        path = Path(folder) / "cloud.las"
        large = [measure(path, size, method) for method, size in sizes.items()]
    section = "\n".join(
        [
            MARKS[0],
            "## Tiles",
            "",
            f"`python scripts/benchmark_tiles.py`; {versions()}. Load of the machine at the end: "
            f"{os.getloadavg()[1]:.0f} processes.",
            "",
            f"Tiled models, tile by tile on threads of one process; cluster-entropy deletes "
            f"{ASKED['cluster-entropy']['delete']:.1%} of the clusters, adaptive keeps "
            f"{ASKED['adaptive']['keep']:.0%} of the points. Memory is resident, before the first "
            "point is read and at the peak; processor time is summed over cores.",
            "",
            "| method | points | tiles | points that stay | before (GB) | peak (GB) "
            "| s a million points | of the processor |",
            "|---|---|---|---|---|---|---|---|",
            *large,
            "",
            f"How far tiles are from the whole cloud, {arguments.compare_size} points, "
            f"{DELETE:.1%} of the clusters deleted. Entropy order is Spearman's correlation of the "
            "entropies of the points' clusters; gaps are distances of the points removed to the "
            "nearest that stay, over the diagonal, the mean over all points.",
            "",
            "| run | inertia | entropy order | removed | the same | mean gap | largest gap |",
            "|---|---|---|---|---|---|---|",
            *compare(arguments.compare_size),
            MARKS[1],
        ]
    )
    print(section)
    write_section(arguments.out, section, MARKS)


if __name__ == "__main__":
    main()
