"""What is imported when: the line between the numpy layer and MeshLab, and light starts."""

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest
from command import ROOT, environment

PACKAGE = ROOT / "meshlab_filter"
HEAVY = {"numpy", "scipy", "sklearn", "pymeshlab", "rich", "laspy", "dask", "matplotlib", "plotly"}


def imported_by(path):
    """Return the top-level packages that a module imports anywhere in it, for types apart."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        # What stands under TYPE_CHECKING is never imported when the program runs.
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            node.body = []
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            names.add(node.module.split(".")[0])
    return names


@pytest.mark.parametrize(
    "path", sorted(PACKAGE.rglob("*.py")), ids=lambda path: str(path.relative_to(PACKAGE))
)
def test_only_the_bridge_imports_pymeshlab(path):
    """Everything else has to go through meshlab_filter.bridge; even there it is imported late."""
    source = path.read_text(encoding="utf-8")
    assert "pymeshlab" not in imported_by(path)
    if 'import_module("pymeshlab' in source:
        assert path == PACKAGE / "bridge" / "session.py"


def modules_after(code):
    """Return which of the heavy packages a fresh interpreter has imported after some code."""
    report = f"{code}\nimport json, sys\nprint()\nprint(json.dumps(list(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", report], env=environment(), capture_output=True, text=True,
        check=True, cwd=Path(sys.prefix),
    )  # fmt: skip
    return HEAVY & set(json.loads(done.stdout.splitlines()[-1]))


def test_import_is_light():
    """The package alone brings no other in."""
    assert modules_after("import meshlab_filter; dir(meshlab_filter)") == set()


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["simplify", "--help"],
                                       ["run", "-h"]], ids=" ".join)  # fmt: skip
def test_help_is_light(arguments):
    """Help comes without numpy, scipy, scikit-learn and MeshLab."""
    code = (
        f"import sys; sys.argv = ['meshlab-filter', *{arguments!r}]\n"
        "from meshlab_filter.__main__ import main\n"
        "try: main()\nexcept SystemExit as error: assert error.code == 0\n"
    )
    assert modules_after(code) == set()


def test_numpy_layer_works_without_pymeshlab():
    """Simplifying arrays needs no MeshLab at all."""
    code = (
        "import sys; sys.modules['pymeshlab'] = None\n"
        "import numpy as np, meshlab_filter as mf\n"
        "points = np.random.default_rng(0).random((200, 3))\n"
        "assert len(mf.simplify(points, clusters=10, delete=2).indices) < 200\n"
        "assert len(mf.simplify(points, count=20).indices) == 20\n"
    )
    assert "numpy" in modules_after(code)
