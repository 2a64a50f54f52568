"""Build the wheel and try it in clean environments, as users get it.

    python scripts/check_wheel.py                      this Python, newest dependencies
    python scripts/check_wheel.py --oldest             this Python, the versions in constraints/
    python scripts/check_wheel.py python3.10 python3.13   other Pythons, as far as they are here

In each environment: ``pip check``, the presets and the mark of type information, an import and a
whole run on a cloud of a few hundred points, far from the folder of the project.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
OLDEST = ROOT / "constraints" / "oldest.txt"
PIP = ["-m", "pip", "--quiet", "--disable-pip-version-check"]


def run(command: list[str | Path], **options: object) -> str:
    """Run a command and return what it prints; end with what it said if it fails."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, env=environment, **options
    )  # type: ignore[call-overload]
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return str(done.stdout)


def build(folder: Path) -> Path:
    """Build the wheel and check what it holds."""
    run([sys.executable, *PIP, "wheel", "--no-deps", "--wheel-dir", folder, ROOT])
    (wheel,) = folder.glob("*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    presets = {f"meshlab_filter/mlx_presets/{path.name}" for path in ROOT.glob("mlx_presets/*")}
    modules = {
        path.relative_to(ROOT).as_posix() for path in (ROOT / "meshlab_filter").rglob("*.py")
    }
    wanted = presets | modules | {"meshlab_filter/py.typed"}
    if not presets or wanted - names:
        sys.exit(f"The wheel lacks {sorted(wanted - names) or 'presets'}.")
    return wheel


def sphere(path: Path, count: int = 600) -> None:
    """Write points of a sphere, on a spiral."""
    with open(path, "w") as file:
        for index in range(count):
            z = 1 - (2 * index + 1) / count
            angle, radius = index * math.pi * (3 - math.sqrt(5)), math.sqrt(1 - z * z)
            file.write(f"{radius * math.cos(angle)} {radius * math.sin(angle)} {z}\n")


def check(wheel: Path, python: str, folder: Path, *, oldest: bool) -> str:
    """Install the wheel for one Python and use it; return the versions it was used with."""
    environment = folder / "environment"
    run([python, "-m", "venv", environment])
    binaries = environment / ("Scripts" if os.name == "nt" else "bin")
    inside = binaries / "python"
    constraints = ["--constraint", OLDEST] if oldest else []
    run([inside, *PIP, "install", wheel, *constraints])
    run([inside, *PIP, "check"])
    command = binaries / "meshlab-filter"
    sphere(folder / "sphere.xyz")
    run([command, "simplify", "sphere.xyz", "thin.ply", "--keep", "25%"], cwd=folder)
    run([command, "run", "sphere.xyz", "--out", "all", "--clusters", "30", "--delete", "5",
         "--quiet"], cwd=folder)  # fmt: skip
    report = json.loads((folder / "all" / "report.json").read_text(encoding="utf-8"))
    if not (report["surface"]["faces"] > 500 and report["error"]["uncut"]["max"] < 0.1):
        sys.exit(f"The run came out wrong: {report['surface']}, {report['error']['uncut']}")
    run([command, "compare", "sphere.xyz", "all/surface.ply", "--json"], cwd=folder)
    presets = "from meshlab_filter.presets import folder; print(len(list(folder().glob('*.mlx'))))"
    if int(run([inside, "-c", presets], cwd=folder)) < 2:
        sys.exit("The installed package does not find its presets.")
    return ", ".join(f"{name} {version}" for name, version in report["versions"].items())


def main() -> None:
    """Build once, then try every Python asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("python", nargs="*", default=[sys.executable])
    parser.add_argument("--oldest", action="store_true", help=f"with {OLDEST.name}")
    asked = parser.parse_args()
    failed = False
    with tempfile.TemporaryDirectory() as name:
        wheel = build(Path(name))
        print(f"{wheel.name}: {wheel.stat().st_size / 1024:.0f} kB", flush=True)
        for python in asked.python:
            if shutil.which(python) is None:
                print(f"{python}: not here, left out", flush=True)
                continue
            with tempfile.TemporaryDirectory() as folder:
                try:
                    versions = check(wheel, python, Path(folder), oldest=asked.oldest)
                except SystemExit as error:
                    print(f"{python}: FAILED\n{error}", flush=True)
                    failed = True
                else:
                    print(f"{python}: {versions}", flush=True)
    sys.exit(failed)


if __name__ == "__main__":
    main()
