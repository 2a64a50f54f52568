"""Measure every sampler at the same count on the same models and write BENCHMARK.md's section.

Results are kept in a JSON file, so that what is there is not run again and the section can be
written from it alone. Each pair of model and sampler runs in a process of its own: a crash in a
package costs its own row only, and the peak of memory is that sampler's.

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
from quality_samplers import SAMPLERS
from quality_tables import OURS, PAPER, PAPER_SHARE, write_section

from meshlab_filter.bridge.distance import distances
from meshlab_filter.bridge.layer import add_layer
from meshlab_filter.bridge.session import import_pymeshlab
from meshlab_filter.bridge.surface import reconstruct
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
    """Judge a sample: errors of all original points to its surface, and what the surface lacks."""
    from scipy.spatial import cKDTree

    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    meshset = import_pymeshlab().MeshSet(verbose=False)
    if sample.indices is not None:
        kept, directions = points[sample.indices], normals[sample.indices]
    else:
        kept = sample.positions
        directions = normals[cKDTree(points).query(kept, workers=-1)[1]]
    add_layer(meshset, kept, normals=directions, faces=sample.faces)
    if sample.faces is None:
        reconstruct(meshset)
    faces = meshset.current_mesh().face_matrix()
    add_layer(meshset, points)
    found = distances(meshset, 1, 0)
    return {
        "count": len(kept),
        **summarise_errors(found, diagonal=diagonal),
        **edge_defects(faces),
        "faces": len(faces),
        "covering": covering_radius(points, kept) / diagonal,
        "plane": plane_distance(points, normals, kept) / diagonal,
        "seconds": sample.seconds,
    }


def run_case(model: str, sampler: str, shares: list[float], directory: Path) -> None:
    """Run one sampler on one model and print a line of JSON for each share."""
    points, normals = load_model(model, directory)
    # A small run first, so that loading the sampler's libraries counts neither as time nor memory.
    small = slice(None, None, max(len(points) // 500, 1))
    SAMPLERS[sampler](points[small], normals[small], 100)
    for share in shares:
        count = round(share * len(points))
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        sample = SAMPLERS[sampler](points, normals, count)
        peak = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
        row = {"model": model, "points": len(points), "sampler": sampler, "share": share,
               "asked": count, "bytes_per_point": peak / len(points)}  # fmt: skip
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
            command = [sys.executable, __file__, "--models", options.models, "--case", model,
                       sampler, *map(str, missing)]  # fmt: skip
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
    parser.add_argument("--results", type=Path, default=HERE / "benchmark_quality.json")
    parser.add_argument("--output", type=Path, default=HERE.parent / "BENCHMARK.md")
    parser.add_argument("--case", nargs="+", help=argparse.SUPPRESS)
    options = parser.parse_args()
    directory = Path(options.models)
    if options.case:
        model, sampler, *shares = options.case
        run_case(model, sampler, [float(share) for share in shares], directory)
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
