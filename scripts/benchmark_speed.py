"""Measure time and memory against peers in the same run; write them to BENCHMARK.md.

Every measurement has a process of its own, so that none warms up or fattens another. Seconds by
the clock depend on what else the machine does, those of the processor, summed over all cores, much
less. The ratios are what to look at.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

MARKS = ("<!-- speed:begin -->", "<!-- speed:end -->")
SIZES = (100_000, 300_000, 1_000_000, 3_000_000)
SURFACE_SIZE = 100_000


def synthetic(size: int) -> np.ndarray:
    """Return irregular points on a closed surface that is curved everywhere: a bumpy torus."""
    a, b = 2 * np.pi * np.random.default_rng(0).random((2, size))
    radius = 0.35 + 0.05 * np.sin(5 * a) * np.cos(3 * b)
    ring = 1 + radius * np.cos(b)
    return np.column_stack([ring * np.cos(a), ring * np.sin(a), radius * np.sin(b)])


def tiled(size: int) -> np.ndarray:
    """Return copies of the bunny in pymeshlab's wheel, side by side, cut to size."""
    from meshlab_filter import read_cloud
    from meshlab_filter.bridge.samples import sample_mesh

    bunny = read_cloud(sample_mesh("bunny.obj")).points
    copies = -(-size // len(bunny))
    side = int(np.ceil(np.sqrt(copies)))
    cells = np.array([[i % side, i // side, 0] for i in range(copies)])
    step = 1.1 * np.ptp(bunny, axis=0).max()
    points = (bunny[None] + step * cells[:, None]).reshape(-1, 3)
    return points[np.random.default_rng(0).permutation(len(points))[:size]]


def peak_bytes() -> int:
    """Return the most memory this process has had resident."""
    status = Path("/proc/self/status")
    if status.exists():
        # The other figure, on Linux, begins at what the parent process had.
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) * 1024
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


class Timer:
    """Seconds since it was made, by the clock and of the processor."""

    def __init__(self) -> None:
        self.clock, self.processor = time.perf_counter(), time.process_time()

    def figures(self) -> dict[str, float]:
        """Return both."""
        return {
            "seconds": time.perf_counter() - self.clock,
            "cpu": time.process_time() - self.processor,
        }


def rank_cloud(points: np.ndarray) -> dict[str, float]:
    """Rank by cluster entropy, default options."""
    from meshlab_filter.methods.cluster_entropy import rank

    rank(points[:2000], delete=0.074)
    before = peak_bytes()
    timer = Timer()
    rank(points, delete=0.074)
    return {**timer.figures(), "bytes": peak_bytes() - before}


def rank_adaptively(points: np.ndarray) -> dict[str, float]:
    """Rank by the adaptive method down to 10 %, default options, normals estimated."""
    from meshlab_filter.methods.adaptive import rank

    rank(points[:2000], count=200)
    before = peak_bytes()
    timer = Timer()
    rank(points, count=len(points) // 10)
    return {**timer.figures(), "bytes": peak_bytes() - before}


def query_itself(points: np.ndarray) -> dict[str, float]:
    """Ask scipy for the 16 nearest neighbours of every point, default options."""
    from scipy.spatial import cKDTree

    timer = Timer()
    cKDTree(points).query(points, k=16)
    return timer.figures()


def cluster(points: np.ndarray) -> dict[str, float]:
    """Cluster with our k-means from a spread start, to convergence."""
    from meshlab_filter.clustering import kmeans

    kmeans(points[:2000], 100, init="spread")
    timer = Timer()
    result = kmeans(points, len(points) // 20, init="spread", max_iter=300)
    return {**timer.figures(), "inertia": result.inertia}


def cluster_sklearn(points: np.ndarray) -> dict[str, float]:
    """Cluster with scikit-learn, to convergence."""
    from sklearn.cluster import KMeans

    timer = Timer()
    result = KMeans(
        len(points) // 20, init="k-means++", n_init=1, max_iter=300, random_state=0
    ).fit(points)
    return {**timer.figures(), "inertia": result.inertia_}


def run_passes(points: np.ndarray) -> dict[str, float]:
    """Run the chain on all points, ball pivoting in passes."""
    return _run(points, "ball-pivoting")


def run_automatic(points: np.ndarray) -> dict[str, float]:
    """Run the chain on all points, ball pivoting with MeshLab's automatic radius."""
    return _run(points, "ball-pivoting-auto")


def _time_filters(used: list[tuple[str, float]]) -> None:
    """Have every filter of MeshLab noted with the processor time it takes."""
    import pymeshlab

    apply = pymeshlab.MeshSet.apply_filter

    def timed(meshset: pymeshlab.MeshSet, name: str, **options: object) -> object:
        begin = time.process_time()
        result = apply(meshset, name, **options)
        used.append((name, time.process_time() - begin))
        return result

    pymeshlab.MeshSet.apply_filter = timed


def _run(points: np.ndarray, surface: str) -> dict[str, float]:
    import meshlab_filter as mf
    from meshlab_filter.cloud import Cloud, write_cloud

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cloud.ply"
        write_cloud(Cloud(points=points), path)
        used: list[tuple[str, float]] = []
        timer = Timer()
        _time_filters(used)
        report = mf.run(
            path, Path(folder) / "out", method="random", keep=1.0, floor=False, fit=False,
            surface=surface,
        )  # fmt: skip
        figures = timer.figures()
    return {**figures, "faces": report["surface"]["faces"], **{
        f"filter {place} {name}": value for place, (name, value) in enumerate(used, 1)
    }}  # fmt: skip


MEASUREMENTS = {
    function.__name__: function
    for function in (
        rank_cloud, rank_adaptively, query_itself, cluster, cluster_sklearn, run_passes,
        run_automatic,
    )
}  # fmt: skip


def measure(name: str, path: Path) -> dict[str, float]:
    """Take one measurement in a fresh process."""
    command = [sys.executable, __file__, "--measure", name, str(path)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    output = subprocess.run(command, check=True, stdout=subprocess.PIPE, env=environment).stdout
    figures: dict[str, float] = json.loads(output.splitlines()[-1])
    print(f"  {name}: " + ", ".join(f"{key} {value:.4g}" for key, value in figures.items()))
    sys.stdout.flush()
    return figures


def start_up() -> dict[str, float]:
    """Return by how much ``--help`` outlasts an empty program, medians of nine."""
    import resource

    def used(*arguments: str) -> tuple[float, float]:
        clock, processor = [], []
        for _ in range(9):
            before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
            subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)
            clock.append(time.perf_counter() - begin)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            processor.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        return statistics.median(clock), statistics.median(processor)

    ours, empty = used("-m", "meshlab_filter", "--help"), used("-c", "pass")
    return {"seconds": ours[0] - empty[0], "cpu": ours[1] - empty[1]}


def versions() -> str:
    """Say what was measured on what."""
    from importlib.metadata import version

    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "scikit-learn"))
    machine = f"{os.cpu_count()} cores, {platform.machine()}"
    return f"{machine}, Python {platform.python_version()}, {packages}"


def measure_all(folder: Path, sizes: list[int]) -> str:
    """Take every measurement and return the section."""
    rows, adaptive, ranking = [], [], {}
    for cloud in (synthetic, tiled):
        for size in sizes:
            path = folder / f"{cloud.__name__}{size}.npy"
            np.save(path, cloud(size))
            print(f"{cloud.__name__}, {size} points")
            peer = measure("query_itself", path)
            for name, table in (("rank_cloud", rows), ("rank_adaptively", adaptive)):
                ours = ranking[name, cloud.__name__, size] = measure(name, path)
                table.append(
                    f"| {cloud.__name__} | {size} | {ours['seconds']:.2f} "
                    f"| {peer['seconds']:.2f} | {ours['seconds'] / peer['seconds']:.2f} "
                    f"| {ours['cpu'] / peer['cpu']:.2f} | {ours['bytes'] / size:.0f} |"
                )
    path = folder / "surface.npy"
    np.save(path, synthetic(SURFACE_SIZE))
    print(f"synthetic, {SURFACE_SIZE} points")
    passes, automatic = measure("run_passes", path), measure("run_automatic", path)
    ours, theirs = measure("cluster", path), measure("cluster_sklearn", path)
    filters = [(n.split()[2], s) for n, s in passes.items() if n.startswith("filter ")]
    theirs_of_run = sum(seconds for _, seconds in filters)
    start = start_up()

    def faster(slow: dict[str, float], fast: dict[str, float]) -> str:
        return f"{slow['seconds'] / fast['seconds']:.2f} × | {slow['cpu'] / fast['cpu']:.2f} ×"

    figures = [
        f"k-means, scikit-learn's time over ours | {faster(theirs, ours)} | ≥ 30 ×",
        f"k-means, our inertia over scikit-learn's | {ours['inertia'] / theirs['inertia']:.3f} × "
        "| | ≤ 1.02 ×",
        *(
            f"ranking {how}, {cloud.__name__}, {said} points "
            f"| {faster(ranking[name, cloud.__name__, more], ranking[name, cloud.__name__, less])} "
            f"| ≤ {limit} ×"
            for name, how, more, less, said, limit in (
                ("rank_cloud", "by cluster entropy", 3_000_000, 1_000_000, "3 M over 1 M", 3.6),
                ("rank_adaptively", "adaptively", 1_000_000, 100_000, "1 M over 100 k", 11),
            )
            for cloud in (synthetic, tiled)
            if {more, less} <= set(sizes)
        ),
        f"`run`, automatic radius over passes | {faster(automatic, passes)} | ≥ 4 ×",
        "`run`, faces of the 2 n of a closed surface, passes "
        f"| {passes['faces'] / (2 * SURFACE_SIZE):.1%} | | ≥ 98 %",
        "`run`, faces of the 2 n of a closed surface, automatic radius "
        f"| {automatic['faces'] / (2 * SURFACE_SIZE):.1%} | | about three quarters",
        "start of the command line above `python -c pass` "
        f"| {start['seconds']:.2f} s | {start['cpu']:.2f} s | ≤ 0.3 s",
    ]
    times = ", ".join(f"`{name}` {seconds:.2f}" for name, seconds in filters if seconds >= 0.01)
    return "\n".join(
        [
            MARKS[0],
            "## Speed and memory",
            "",
            f"`python scripts/benchmark_speed.py`; {versions()}. Load of the machine at the end: "
            f"{os.getloadavg()[1]:.0f} processes.",
            "",
            "Ranking by cluster entropy (N/20 clusters, default options) against one self-query of "
            "scipy's cKDTree for 16 neighbours (default options: one core). To show: ratio ≤ 4 at "
            "1 M points, ≤ 400 bytes a point above the points themselves. Processor time is "
            "summed over cores.",
            "",
            "| cloud | points | ranking (s) | self-query (s) | ratio | of processor time "
            "| bytes a point |",
            "|---|---|---|---|---|---|---|",
            *rows,
            "",
            "Ranking adaptively down to 10 %, normals estimated, default options, against the same "
            "self-query. To show: ratio ≤ 10 at 100 k points, ≤ 1000 bytes a point.",
            "",
            "| cloud | points | ranking (s) | self-query (s) | ratio | of processor time "
            "| bytes a point |",
            "|---|---|---|---|---|---|---|",
            *adaptive,
            "",
            f"Clustering {SURFACE_SIZE} points into {SURFACE_SIZE // 20} clusters against "
            'scikit-learn\'s `KMeans(init="k-means++", n_init=1)`, both to convergence, and `run` '
            f"on {SURFACE_SIZE} irregular points, all kept and no edge fitted, with ball pivoting "
            "in passes and with MeshLab's automatic radius:",
            "",
            "| figure | by the clock | processor time | to show |",
            "|---|---|---|---|",
            *(f"| {line} |" for line in figures),
            "",
            f"Of the {passes['cpu']:.1f} s of processor time that this `run` in passes took, "
            f"{theirs_of_run / passes['cpu']:.0%} were in MeshLab's filters, in this order (s): "
            f"{times}. The rest goes to imports, reading, searching neighbours, figures and "
            "writing.",
            MARKS[1],
        ]
    )


def write_section(path: Path, section: str, marks: tuple[str, str]) -> None:
    """Put the section between its marks, or at the end of the file."""
    text = path.read_text(encoding="utf-8") if path.exists() else "# Benchmarks\n"
    begin, end = marks
    if begin in text:
        text = text[: text.index(begin)] + section + text[text.index(end) + len(end) :]
    else:
        text = f"{text.rstrip()}\n\n{section}\n"
    path.write_text(text, encoding="utf-8")


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=list(SIZES))
    parser.add_argument("--out", type=Path, default=Path("BENCHMARK.md"))
    parser.add_argument("--measure", nargs=2, metavar=("NAME", "FILE"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.measure:
        name, file = arguments.measure
        print(json.dumps(MEASUREMENTS[name](np.load(file))))
        return
    with tempfile.TemporaryDirectory() as folder:
        section = measure_all(Path(folder), arguments.sizes)
    print(section)
    write_section(arguments.out, section, MARKS)


if __name__ == "__main__":
    main()
