"""The examples in scripts/ do what they say."""

import sys
from pathlib import Path

import numpy as np
import pytest

import meshlab_filter as mf

SCRIPTS = Path(__file__).parents[1] / "scripts"


@pytest.fixture(autouse=True)
def scripts_importable(monkeypatch):
    """Import from the folder of scripts."""
    monkeypatch.setattr(sys, "path", [str(SCRIPTS), *sys.path])


@pytest.fixture
def scan(tmp_path):
    """Write an ellipsoid of 2000 points."""
    points = np.random.default_rng(0).normal(size=(2000, 3))
    points = points / np.linalg.norm(points, axis=1)[:, None] * [3, 2, 1]
    mf.write_cloud(mf.Cloud(points=points), tmp_path / "scan.ply")
    return tmp_path / "scan.ply"


def test_middle_of_a_script(scan, tmp_path):
    """A tenth of the points, a surface, a file."""
    import example_middle_of_script

    figures = example_middle_of_script.main(str(scan), str(tmp_path / "surface.ply"))
    assert figures["vertices_after"] == 200
    assert mf.read_cloud(tmp_path / "surface.ply").faces == figures["faces"] > 200


def test_level_of_detail(scan):
    """Fewer points, larger errors."""
    import example_level_of_detail

    levels = example_level_of_detail.main(str(scan))
    assert [level["vertices_after"] for level in levels] == [1000, 400, 200, 100]
    errors = [level["mean"] for level in levels]
    assert errors == sorted(errors)


def test_folder_of_scans(scan, tmp_path):
    """Each scan has its folder; the bad one has a sentence."""
    import example_folder_of_scans

    (tmp_path / "bad.ply").write_text("ply\n")
    lines = example_folder_of_scans.main(str(tmp_path), str(tmp_path / "result"))
    assert list(lines) == ["bad.ply", "scan.ply"]
    assert "PLY" in lines["bad.ply"]
    assert lines["scan.ply"].startswith("2000 -> ")
    assert (tmp_path / "result" / "scan" / "report.json").exists()
