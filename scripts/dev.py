"""Set up and run everything with Python alone: ``python scripts/dev.py demo``, ``… test``.

The first call makes a virtual environment in ``.venv`` and installs the project into it; later
calls use it as it is, until ``pyproject.toml`` changes. Nothing outside the folder is touched.

    python scripts/dev.py demo          run the demo
    python scripts/dev.py test          the quick tests and the doctests (under three minutes)
    python scripts/dev.py test --slow   the slow ones, which the quick tests leave out
    python scripts/dev.py check         lint, format, types, security
    python scripts/dev.py run CMD …     any command inside the environment
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ENVIRONMENT = ROOT / ".venv"
BIN = ENVIRONMENT / ("Scripts" if os.name == "nt" else "bin")
PYTHON = BIN / ("python.exe" if os.name == "nt" else "python")
#: What is installed for the one who only wants to try it, and for the one who works on it.
EXTRAS = {"demo": "report", "develop": "dev"}


def install(purpose: str) -> None:
    """Make the environment and install the project with the extras for the purpose."""
    wanted = hashlib.sha256((ROOT / "pyproject.toml").read_bytes()).hexdigest()
    stamp = ENVIRONMENT / f"installed-{purpose}"
    if PYTHON.exists() and stamp.exists() and stamp.read_text() == wanted:
        return
    if not PYTHON.exists():
        print(f"Making the virtual environment {ENVIRONMENT} …", flush=True)
        try:
            venv.create(ENVIRONMENT, with_pip=True)
        except subprocess.CalledProcessError:
            sys.exit(
                "This Python cannot make virtual environments; on Debian and Ubuntu run: "
                "apt-get install python3-venv"
            )
    print("Installing the project (the only step that needs the network) …", flush=True)
    pip = [str(PYTHON), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    run([*pip, "--editable", f".[{EXTRAS[purpose]}]"])
    stamp.write_text(wanted)


def run(command: list[str]) -> None:
    """Run a command in the project's folder; end with its exit code if that is not 0."""
    path = f"{BIN}{os.pathsep}{os.environ.get('PATH', '')}"
    code = subprocess.call(command, cwd=ROOT, env={**os.environ, "PATH": path})
    if code:
        sys.exit(code)


def main(arguments: list[str]) -> None:
    """Do what the arguments say."""
    task, rest = (arguments or ["--help"])[0], arguments[1:]
    python = str(PYTHON)
    if task == "demo":
        install("demo")
        run([python, "-m", "meshlab_filter", "demo", *rest])
    elif task == "test":
        install("develop")
        marked = ["-m", "slow"] if "--slow" in rest else []
        rest = [word for word in rest if word != "--slow"]
        run([python, "-m", "pytest", "-n", "2", "--dist", "worksteal", *marked, *rest])
    elif task == "check":
        install("develop")
        run([python, "-m", "ruff", "check", "."])
        run([python, "-m", "ruff", "format", "--check", "."])
        run([python, "-m", "mypy"])
        run([python, "-m", "bandit", "--quiet", "-c", "pyproject.toml", "-r", "meshlab_filter"])
    elif task == "run" and rest:
        install("develop")
        run(rest)
    else:
        print(__doc__)
        sys.exit(0 if task in ("-h", "--help") else 2)


if __name__ == "__main__":
    main(sys.argv[1:])
