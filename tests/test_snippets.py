"""Every snippet of the documentation is run, in order, beside the bunny as a scan."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
FENCE = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)

#: Commands that set up a machine or are somebody else's: shown, not run.
NOT_OURS = {"python", "apt-get", "git", "cd", "meshlabserver", "xvfb-run", "pip"}

pytestmark = pytest.mark.slow


@dataclass
class Snippet:
    """A fenced block: its language, text and line."""

    language: str
    text: str
    line: int


def snippets(page):
    """Return the blocks of a page that can be run."""
    text = page.read_text(encoding="utf-8")
    return [
        Snippet(found[1], found[2], text.count("\n", 0, found.start()) + 2)
        for found in FENCE.finditer(text)
        if found[1] in ("sh", "python")
    ]


@pytest.fixture(scope="module")
def scans(tmp_path_factory):
    """Write what a reader has: the bunny as scan.ply and big.laz, and two filter scripts."""
    import laspy
    import pymeshlab

    from meshlab_filter.bridge.samples import sample_mesh
    from meshlab_filter.presets import find

    folder = tmp_path_factory.mktemp("scans")
    meshset = pymeshlab.MeshSet(verbose=False)
    meshset.load_new_mesh(str(sample_mesh("bunny.obj")))
    meshset.save_current_mesh(str(folder / "scan.ply"))
    las = laspy.LasData(laspy.LasHeader(point_format=0))
    las.header.scales = [1e-5, 1e-5, 1e-5]
    las.x, las.y, las.z = meshset.current_mesh().vertex_matrix().T
    las.write(str(folder / "big.laz"))
    script = find("bunny").read_text(encoding="utf-8")
    (folder / "my.mlx").write_text(script, encoding="utf-8")
    # MeshLab keeps the filters and drops the rest.
    saved = re.sub(r"<\?meshlab-filter.*?\?>|<!--.*?-->", "", script, flags=re.DOTALL)
    (folder / "saved-by-meshlab.mlx").write_text(saved, encoding="utf-8")
    return folder


def run(command, folder):
    """Run a command that must succeed."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "ignore"}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300,
        check=False,
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


def glob(word, folder):
    """Return the names that a word with a star stands for, as a shell does."""
    return sorted(path.name for path in folder.glob(word)) if word.startswith("*.") else [word]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_snippets_run(page, scans, tmp_path):
    """Each block does what the page says, in a folder that holds the scans and nothing else."""
    shutil.copytree(scans, tmp_path, dirs_exist_ok=True)
    failures = []
    for snippet in snippets(page):
        where = f"{page.name}:{snippet.line}"
        if snippet.language == "python":
            code, output = run([sys.executable, "-c", snippet.text], tmp_path)
            if code:
                failures.append(f"{where}\n{snippet.text}\n{output}")
            continue
        for line in snippet.text.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            # A host that does not exist is shown, not asked.
            if not words or "tcp://host:8786" in words:
                continue
            if words[0] == "meshlab-filter":
                words = [name for word in words for name in glob(word, tmp_path)]
                code, output = run([sys.executable, "-m", "meshlab_filter", *words[1:]], tmp_path)
                if code:
                    failures.append(f"{where}\n{line}\n{output}")
            elif words[0] not in NOT_OURS:
                failures.append(f"{where}\n{line}\nnot known to the tests")
    assert not failures, "\n\n".join(failures)


def test_there_are_snippets():
    """The pages that show how to use it have something to run."""
    for name in ("README.md", "start.md", "pymeshlab.md", "command-line.md"):
        page = next(page for page in PAGES if page.name == name)
        assert snippets(page), name
