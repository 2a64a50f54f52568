"""Measure every sampler at the same count on the same models and write BENCHMARK.md's section.

Samples are kept in a folder and judged from there, and results in a JSON file, so that what is
there is not run again and the section can be written from it alone. Each pair of model and sampler
runs in a process of its own: a crash in a package costs its own row only, and the peak of memory is
that sampler's.

    python scripts/benchmark_quality.py --models ../shared/models
    python scripts/benchmark_quality.py --quick
    python scripts/benchmark_quality.py --render
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
from quality_models import MODELS, load_model, path_of
from quality_samplers import SAMPLERS, Sample
from quality_tables import OURS, PAPER, PAPER_SHARE, write_section

from meshlab_filter.bridge.surface import PASSES
from meshlab_filter.measure import distances_to, rebuild
from meshlab_filter.quality import covering_radius, edge_defects, summarise_errors

HERE = Path(__file__).resolve().parent
SHARES = (0.5, 0.2, 0.1, 0.05)
QUICK_SHARES = (0.2, 0.1)
# Neighbours and width of the tangent-plane fit, which judges a cloud without any surface.
PLANE_NEIGHBOURS = 6


def plane_distance(points: np.ndarray, normals: np.ndarray, kept: np.ndarray) -> float:
    """Mean distance of the points, along their normals, to the mean of the nearest kept ones.

    The mean is Gaussian in the distance, as wide as the sixth neighbour is far.
    """
    from scipy.spatial import cKDTree

    far, near = cKDTree(kept).query(points, PLANE_NEIGHBOURS, workers=-1)
    weight = np.exp(-((far / np.maximum(far[:, -1:], np.finfo(float).tiny)) ** 2))
    heights = np.einsum("nkj,nj->nk", kept[near] - points[:, None], normals)
    return float(np.abs((weight * heights).sum(axis=1) / weight.sum(axis=1)).mean())


def figures(points, normals, sample) -> dict[str, object]:
    """Judge a sample: errors of all originals to its surface, as built and as fitted by `run`."""
    from scipy.spatial import cKDTree

    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    if sample.indices is not None:
        kept, directions = points[sample.indices], normals[sample.indices]
    else:
        kept = sample.positions
        directions = normals[cKDTree(points).query(kept, workers=-1)[1]]
    judged = {
        "count": len(kept),
        "covering": covering_radius(points, kept) / diagonal,
        "plane": plane_distance(points, normals, kept) / diagonal,
        "seconds": sample.seconds,
    }
    for name, fit in (("plain", False), ("fitted", True)):
        faces = sample.faces  # what comes with triangles of its own keeps them
        if faces is None:
            faces = rebuild(kept, directions, points, passes=PASSES, fit=fit)[1]
        found = distances_to(kept, faces, points)
        judged[name] = {
            **summarise_errors(found, diagonal=diagonal),
            **edge_defects(faces),
            "faces": len(faces),
            "without_face": len(kept) - len(np.unique(faces)),
        }
    return judged


def taken(
    model: str, sampler: str, share: float, cloud: tuple[np.ndarray, np.ndarray], samples: Path
) -> tuple[Sample, float]:
    """Return a sample and the peak of memory it took in bytes, from its file if there is one."""
    points, normals = cloud
    count = round(share * len(points))
    file = samples / f"{model} {sampler} {count}.npz"
    if not file.exists():
        # A small run first, so that loading the sampler's libraries counts neither as time nor as
        # memory.
        small = slice(None, None, max(len(points) // 500, 1))
        SAMPLERS[sampler](points[small], normals[small], 100)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        sample = SAMPLERS[sampler](points, normals, count)
        peak = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
        samples.mkdir(parents=True, exist_ok=True)
        made = {name: value for name, value in vars(sample).items() if value is not None}
        np.savez(file.with_suffix(".partial.npz"), peak=peak, **made)
        file.with_suffix(".partial.npz").rename(file)
    with np.load(file) as made:
        values = {name: made[name] for name in made.files}
    peak = float(values.pop("peak"))
    return Sample(**{**values, "seconds": float(values["seconds"])}), peak


def run_case(model: str, sampler: str, shares: list[float], options: argparse.Namespace) -> None:
    """Run one sampler on one model and print a line of JSON for each share."""
    points, normals = load_model(model, Path(options.models))
    for share in shares:
        sample, peak = taken(model, sampler, share, (points, normals), options.samples)
        row = {
            "model": model,
            "points": len(points),
            "sampler": sampler,
            "share": share,
            "asked": round(share * len(points)),
            "bytes_per_point": peak / len(points),
        }
        print(json.dumps(row | figures(points, normals, sample)), flush=True)


def measure(options: argparse.Namespace, models: list[str], shares: tuple[float, ...]) -> None:
    """Run what is missing in the results, a process for each pair of model and sampler."""
    rows = json.loads(options.results.read_text()) if options.results.exists() else []
    rows = [row for row in rows if row["sampler"] not in options.again]
    done = {(row["model"], row["sampler"], row["share"]) for row in rows}
    for model in models:
        for sampler in options.samplers or SAMPLERS:
            wanted = shares + ((PAPER_SHARE,) if sampler in (OURS, PAPER, "random") else ())
            missing = [share for share in wanted if (model, sampler, share) not in done]
            if not missing:
                continue
            if sampler in options.again:
                for file in options.samples.glob(f"{model} {sampler} *.npz"):
                    file.unlink()
            command = [sys.executable, __file__, "--models", options.models,
                       "--samples", str(options.samples),
                       "--case", model, sampler, *map(str, missing)]  # fmt: skip
            ended = subprocess.run(command, capture_output=True, text=True, check=False)
            lines = [line for line in ended.stdout.splitlines() if line.startswith('{"model"')]
            rows += [json.loads(line) for line in lines]
            state = "" if len(lines) == len(missing) else f" FAILED ({ended.returncode}): " + (
                ended.stderr.strip().splitlines() or ["no message"]
            )[-1]  # fmt: skip
            print(f"{model}: {sampler}{state}", file=sys.stderr, flush=True)
            options.results.write_text("[\n" + ",\n".join(map(json.dumps, rows)) + "\n]\n")


def main() -> None:
    """Parse the command line and do what it asks."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--models", default="../shared/models", help="directory of the models")
    parser.add_argument("--quick", action="store_true", help="four models, two shares")
    parser.add_argument("--only", nargs="+", choices=MODELS, help="these models only")
    parser.add_argument("--samplers", nargs="+", choices=SAMPLERS, help="these samplers only")
    parser.add_argument("--again", nargs="+", default=[], help="run these samplers again")
    parser.add_argument("--render", action="store_true", help="write the section, run nothing")
    parser.add_argument("--samples", type=Path, default=HERE.parent / "build" / "samples")
    parser.add_argument("--results", type=Path, default=HERE / "benchmark_quality.json")
    parser.add_argument("--output", type=Path, default=HERE.parent / "BENCHMARK.md")
    parser.add_argument("--case", nargs="+", help=argparse.SUPPRESS)
    options = parser.parse_args()
    directory = Path(options.models)
    if options.case:
        model, sampler, *shares = options.case
        run_case(model, sampler, [float(share) for share in shares], options)
        return
    if not options.render:
        wanted = options.only or [m for m in MODELS if MODELS[m].quick or not options.quick]
        there = [model for model in wanted if path_of(model, directory).exists()]
        for model in sorted(set(wanted) - set(there)):
            print(f"{model}: no file {path_of(model, directory)}", file=sys.stderr)
        measure(options, there, QUICK_SHARES if options.quick else SHARES)
    write_section(json.loads(options.results.read_text()), options.output)


if __name__ == "__main__":
    main()
