"""Damaged files of every format: each ends in a result or a sentence, soon and within bounds."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from command import environment
from fuzzing import HANG, MEMORY, damaged, whole_files
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from meshlab_filter.cloud import read_cloud
from meshlab_filter.errors import MeshlabFilterError, PresetError
from meshlab_filter.mlx import parse

FORMATS = ("ply", "obj", "off", "stl", "xyz", "pts", "las", "mlx")


def read_damaged(form, count, seed):
    """Let a process of its own read damaged files; return how they ended."""
    if form == "las":
        pytest.importorskip("laspy")
    script = Path(__file__).with_name("fuzzing.py")
    done = subprocess.run(
        [sys.executable, str(script), form, str(count), str(seed)],
        env=environment(), capture_output=True, text=True, timeout=900,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="limits memory as Linux does")
@pytest.mark.parametrize("form", FORMATS)
def test_thousands_of_damaged_files(form):
    """No signal, no hang, no more memory than allowed, no exception but a sentence."""
    ended = read_damaged(form, 2000, seed=20)
    assert ended["result"] + ended["sentence"] >= 2000
    assert ended["result"] > 20
    assert ended["sentence"] > 200
    assert ended["slowest"] < HANG
    assert ended["memory"] < MEMORY


@pytest.mark.skipif(sys.platform != "linux", reason="limits memory as Linux does")
@pytest.mark.parametrize("form", ["ply", "xyz", "las", "mlx"])
def test_some_damaged_files(form):
    """The same with few files, of the formats that take no time."""
    ended = read_damaged(form, 100, seed=21)
    assert ended["result"] + ended["sentence"] >= 100


@settings(max_examples=100, deadline=None,
          suppress_health_check=[HealthCheck.function_scoped_fixture])  # fmt: skip
@given(content=st.binary(max_size=300), suffix=st.sampled_from([".ply", ".xyz", ".csv", ".las"]),
       start=st.sampled_from([b"", b"ply\n", b"ply\nformat ascii 1.0\nelement vertex 2\n",
                              b"LASF", b"2\n", b"1 2 3\n"]))  # fmt: skip
def test_any_bytes(tmp_path, content, suffix, start):
    """Bytes that were never a file of that format."""
    path = tmp_path / f"scan{suffix}"
    path.write_bytes(start + content)
    try:
        cloud = read_cloud(path)
    except MeshlabFilterError as error:
        assert "\n" not in str(error)  # noqa: PT017
    else:
        assert cloud.points.ndim == 2


@settings(max_examples=200, deadline=None)
@given(content=st.one_of(st.text(), st.binary(), st.builds("<FilterScript>{}</FilterScript>".format,
                                                           st.text())))  # fmt: skip
def test_any_script(content):
    """Text that was never a filter script."""
    try:
        script = parse(content)
    except PresetError as error:
        assert "\n" not in str(error)  # noqa: PT017
    else:
        assert len(list(script)) >= 0


def test_damage_is_damage():
    """The fuzzer changes nearly every file, and the same seed gives the same files."""
    import numpy as np

    whole = next(whole_files("off"))
    files = [damaged(whole, np.random.default_rng(seed)) for seed in range(100)]
    assert sum(file != whole for file in files) > 80
    assert files == [damaged(whole, np.random.default_rng(seed)) for seed in range(100)]
