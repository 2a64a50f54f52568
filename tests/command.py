"""Running the command line as users do: as a process."""

import os
import subprocess
import sys
from pathlib import Path

from meshlab_filter.cli.main import invoke

ROOT = Path(__file__).parents[1]


def environment(**more):
    """Return an environment in which the package of this folder is found."""
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), **more}


def command(*arguments):
    """Return the command with its arguments."""
    return [sys.executable, "-m", "meshlab_filter", *map(str, arguments)]


def meshlab_filter(*arguments, folder, **options):
    """Run the command in a folder and return the finished process, its outputs as text."""
    return subprocess.run(
        command(*arguments), cwd=folder, env=environment(), text=True, capture_output=True,
        timeout=120, **options,
    )  # fmt: skip


def snapshot(folder):
    """Return every path in a folder, hidden ones included, with the bytes of files."""
    return {
        path.relative_to(folder): path.read_bytes() if path.is_file() else None
        for path in Path(folder).rglob("*")
    }


def check_refused(folder, *arguments, message, code=None, capsys=None):
    """Check that a command ends as users deserve: a sentence, a code, and nothing touched.

    With ``capsys`` the command runs in this process, which takes a tenth of the time.
    """
    before = snapshot(folder)
    if capsys is None:
        done = meshlab_filter(*arguments, folder=folder)
        ended, out, said = done.returncode, done.stdout, done.stderr.strip()
    else:
        ended = invoke([*map(str, arguments)])
        out, said = capsys.readouterr()
        said = said.strip()
    assert "Traceback" not in said, said
    assert 0 < ended < 128
    assert message in said, said
    # click puts the usage before what is wrong with an option.
    sentences = [line for line in said.splitlines() if not line.startswith(("Usage:", "Try "))]
    assert len(list(filter(None, sentences))) == 1, said
    assert code is None or ended == code, said
    assert out == ""
    assert snapshot(folder) == before
