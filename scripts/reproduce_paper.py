"""Reproduce the paper: every row of Table 1, Figures 3 to 9, and the comparison it lacks.

    python scripts/reproduce_paper.py --models ../shared/models      everything, into docs/
    python scripts/reproduce_paper.py --model bunny --out /tmp/bunny  one model
    python scripts/reproduce_paper.py --quick --out /tmp/quick        two small models, few seeds

In an environment without the project: python scripts/dev.py run python scripts/reproduce_paper.py.
Without --models (or MESHLAB_FILTER_MODELS) the models are downloaded once with pooch. Work is
shared out to processes; with --cache DIR what was measured is kept there and not measured again.
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
import time
from pathlib import Path
from typing import Any

import joblib
from reproduction import document, figures, measurements
from reproduction.subjects import SUBJECTS, load
from reproduction.tables import FIG8_KEPT

from meshlab_filter.bridge.session import version
from meshlab_filter.errors import MeshlabFilterError
from meshlab_filter.methods.registry import METHODS

QUICK = {"models": ["genus", "bunny"], "seeds": 3, "shares": (0.91, 0.2)}
#: Shares of the points that all methods keep.
SHARES = (0.91, 0.5, 0.2, 0.1, 0.05)
#: Seeds of each method in the comparison, where they matter.
COMPARED = 3
#: How much work a model is: the largest go first.
WEIGHT = ("fandisk", "bimba", "max_planck", "david", "bunny", "genus")


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--models", metavar="DIR", help="folder of models at hand; no network")
    parser.add_argument("--model", action="append", choices=SUBJECTS, help="only this, repeatable")
    parser.add_argument("--method", action="append", choices=METHODS, help="compare only these")
    parser.add_argument("--seeds", type=int, help="how many seeds (10)")
    parser.add_argument("--quick", action="store_true", help="two models, three seeds, two counts")
    parser.add_argument("--out", type=Path, default=Path("docs"), help="where to write (docs)")
    parser.add_argument("--jobs", type=int, default=2, help="processes at a time (2)")
    parser.add_argument("--cache", metavar="DIR", help="keep what was measured here")
    options = parser.parse_args(arguments)
    options.model = options.model or (QUICK["models"] if options.quick else list(SUBJECTS))
    options.seeds = options.seeds or (QUICK["seeds"] if options.quick else 10)
    options.shares = QUICK["shares"] if options.quick else SHARES
    options.method = options.method or [
        name
        for name, method in METHODS.items()
        if importlib.util.find_spec(method.module, "meshlab_filter.methods")
    ]
    if options.seeds < 1:
        parser.error("--seeds must be at least 1")
    options.compared = min(options.seeds, COMPARED)
    return options


def plan(options: argparse.Namespace) -> list[tuple[str, Any, tuple[Any, ...]]]:
    """Return the tasks: model, key of the result, function and its arguments."""
    tasks = []
    for name in sorted(options.model, key=WEIGHT.index):
        size = len(load(name, options.models).points)
        tasks.append((name, "floor", (measurements.floor, name, options.models)))
        counts = tuple(round(share * size) for share in options.shares)
        for method in options.method:
            call = (measurements.at_count, name, options.models, method, counts, options.compared)
            tasks.append((name, ("compared", method), call))
        if name == "fandisk":
            for method in (*FIG8_KEPT, "cluster-entropy", "random", "adaptive"):
                count = (FIG8_KEPT.get(method, min(FIG8_KEPT.values())),)
                task = (name, options.models, method, count, options.compared, True)
                tasks.append((name, ("fig8", method), (measurements.at_count, *task)))
            call = (measurements.readings, name, options.models, options.compared)
            tasks.append((name, "readings", call))
        for seed in range(options.seeds):
            call = (measurements.paper_rule, name, options.models, seed)
            tasks.append((name, ("runs", seed), call))
    return tasks


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Do all tasks and return their results by model."""
    memory = joblib.Memory(options.cache, verbose=0)
    tasks = plan(options)
    begin = time.perf_counter()
    jobs = (joblib.delayed(_call)(memory, *call) for _, _, call in tasks)
    done = joblib.Parallel(n_jobs=options.jobs, return_as="generator")(jobs)
    results: dict[str, Any] = {name: {} for name in SUBJECTS if name in options.model}
    for number, ((name, key, _), value) in enumerate(zip(tasks, done), start=1):
        if isinstance(key, str):
            results[name][key] = value
        elif key[0] == "runs":
            results[name].setdefault("runs", []).append(value)
        else:
            row = value[0] if key[0] == "fig8" else value
            results[name].setdefault(key[0], {})[key[1]] = row
        results[name]["shares"] = options.shares
        if sys.stderr.isatty() or number % 20 == 0 or number == len(tasks):
            spent = time.perf_counter() - begin
            print(f"{number} of {len(tasks)} done after {spent:.0f} s", file=sys.stderr)
    return results


def _call(memory: joblib.Memory, function: Any, *arguments: Any) -> Any:
    return memory.cache(function)(*arguments)


def draw(results: dict[str, Any], options: argparse.Namespace) -> dict[str, str]:
    """Draw the pictures and return their paths relative to the document."""
    folder = options.out / "images"
    folder.mkdir(parents=True, exist_ok=True)
    images: dict[str, str] = {}

    def path(key: str) -> Path:
        images[key] = f"images/reproduction-{key}.png"
        return options.out / images[key]

    scenes = {}
    for name, result in results.items():
        cloud = load(name, options.models)
        first = result["runs"][0][SUBJECTS[name].presets[0]]
        scenes[name] = {
            "cloud": cloud,
            "original": result["floor"]["passes"]["scene"],
            "simplified": first["passes"]["scene"],
        }
        figures.comparison(name, result["compared"], len(cloud.points), path(name))
    figures.side_by_side(scenes, path("clouds"), surfaces=False)
    figures.side_by_side(scenes, path("surfaces"), surfaces=True)
    if "bimba" in results:
        before = results["bimba"]["floor"]["paper"]["scene"]["compact"]
        after = results["bimba"]["runs"][0]["bimba"]["paper"]["scene"]["compact"]
        figures.compactness_histograms(before, after, path("compactness"))
    if "bunny" in results:
        cloud, first = scenes["bunny"]["cloud"], results["bunny"]["runs"][0]
        levels = {"original": scenes["bunny"]["original"]}
        for preset in reversed(SUBJECTS["bunny"].rows()):
            deleted = preset.recipe.parameters["delete"]
            levels[f"{deleted} clusters deleted"] = first[preset.name]["passes"]["scene"]
        figures.levels_of_detail(cloud, levels, path("levels"))
        faces = scenes["bunny"]["original"]["faces"]
        figures.clusters_and_entropy(
            cloud, faces, first["labels"], first["entropy"], 60, path("entropy")
        )
        figures.errors_in_colour("bunny", cloud, faces, levels, path("error"), top=0.02)
    if "fandisk" in results:
        panels = {
            f"{method}, {runs[0]['kept']} points\nmean {runs[0]['uncut']['mean']:.1e}": (
                runs[0]["scene"]
            )
            for method, runs in results["fandisk"]["fig8"].items()
        }
        cloud, faces = scenes["fandisk"]["cloud"], scenes["fandisk"]["original"]["faces"]
        figures.errors_in_colour("fandisk", cloud, faces, panels, path("fig8"), top=0.005)
    return images


def main(arguments: list[str] | None = None) -> int:
    """Measure, draw and write; return the exit code."""
    options = parse(arguments)
    try:
        results = run(options)
        images = draw(results, options)
    except MeshlabFilterError as error:
        print(f"reproduce_paper.py: {error}", file=sys.stderr)
        return error.exit_code
    seeds = {"seeds": options.seeds, "compared": options.compared}
    text = document.write(results, images, **seeds, version=version())
    target = options.out / "REPRODUCTION.md"
    target.write_text(text, encoding="utf-8")
    print(f"Written: {target} and {len(images)} pictures in {options.out / 'images'}.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
