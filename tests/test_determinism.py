"""The same input, parameters and seed give the same bytes, however many threads there are."""

import json
import os
import shutil
import subprocess

import numpy as np
import pytest
from command import command, environment

pytestmark = pytest.mark.slow

CASES = {
    "adaptive": ["--keep", "20%"],
    "cluster-entropy": ["--clusters", "150", "--delete", "20", "--seed", "3"],
}


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    """Return a scan of a torus with some noise."""
    rng = np.random.default_rng(0)
    u, v = rng.uniform(0, 2 * np.pi, (2, 3000))
    points = np.column_stack(
        [(2 + np.cos(v)) * np.cos(u), (2 + np.cos(v)) * np.sin(u), np.sin(v)]
    ) + rng.normal(scale=0.002, size=(3000, 3))
    path = tmp_path_factory.mktemp("scan") / "scan.xyz"
    np.savetxt(path, points)
    return path


def outputs(folder, scan, arguments, threads):
    """Run a command on so many threads and cores; return its files, times and paths left out."""
    folder.mkdir()
    shutil.copy(scan, folder / "scan.xyz")
    more = {f"{name}_NUM_THREADS": str(threads) for name in ("OMP", "OPENBLAS", "MKL")}
    pinned = []
    if shutil.which("taskset") and (os.cpu_count() or 1) > 1:
        pinned = ["taskset", "-c", "0" if threads == 1 else "0,1"]
    subprocess.run(
        [*pinned, *command(*arguments)], cwd=folder, env=environment(**more), check=True,
        capture_output=True, timeout=300,
    )  # fmt: skip
    files = {}
    for path in sorted(folder.rglob("*")):
        if path.name == "report.json":
            report = json.loads(path.read_text())
            assert report.pop("times")
            files[path.name] = report
        elif path.is_file() and path.name != "report.html":
            files[path.name] = path.read_bytes()
    return files


@pytest.mark.parametrize("verb", ["simplify", "run"])
@pytest.mark.parametrize("case", CASES)
def test_same_bytes(tmp_path, scan, verb, case):
    """Twice on two threads and once on one: every file is the same but for the times."""
    target = ["thin.xyz"] if verb == "simplify" else ["--out", "result"]
    arguments = [verb, "scan.xyz", *target, *CASES[case]]
    first = outputs(tmp_path / "first", scan, arguments, 2)
    assert len(first) == (2 if verb == "simplify" else 6)
    assert outputs(tmp_path / "second", scan, arguments, 2) == first
    assert outputs(tmp_path / "third", scan, arguments, 1) == first


def test_the_page_differs_in_times_only(tmp_path, scan):
    """Two reports for the browser are as long, up to the digits of the times, and as rich."""
    pages = []
    for name in ("first", "second"):
        outputs(tmp_path / name, scan, ["run", "scan.xyz", "--out", "result", "--keep", "20%"], 2)
        page = tmp_path / name / "result" / "report.html"
        if not page.exists():
            pytest.skip("no report.html from run")
        pages.append(page.read_text(encoding="utf-8"))
    assert abs(len(pages[0]) - len(pages[1])) < 200
