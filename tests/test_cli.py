"""The command line as users run it: as a process."""

import json
import subprocess
import sys

import numpy as np
import plyfile
import pytest

from meshlab_filter.bridge.samples import sample_mesh


def cli(*arguments, **options):
    """Run the command line and return the finished process."""
    command = [sys.executable, "-m", "meshlab_filter", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, **options)


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    """Write a wavy sheet as text."""
    path = tmp_path_factory.mktemp("cli") / "scan.xyz"
    xy = np.random.default_rng(0).random((500, 2))
    np.savetxt(path, np.column_stack([xy, 0.1 * np.sin(9 * xy[:, 0])]), fmt="%.6f")
    return path


def test_help_lists_commands_and_exit_codes():
    """The page a newcomer sees first."""
    done = cli("--help")
    assert done.returncode == 0
    for word in ("demo", "simplify", "run", "compare", "methods", "Exit codes", "8825205"):
        assert word in done.stdout


def test_no_arguments_shows_help():
    """Without a command: the help page, and an exit code for scripts."""
    done = cli()
    assert "Usage" in done.stdout + done.stderr
    assert done.returncode == 2


def test_version():
    """The version is the package's."""
    from meshlab_filter import __version__

    assert cli("--version").stdout.split()[-1] == __version__


@pytest.mark.parametrize("command", ["demo", "simplify", "run", "compare", "methods"])
def test_every_command_has_help(command):
    """Each says what it does."""
    done = cli(command, "--help")
    assert done.returncode == 0
    assert "Usage: meshlab-filter " + command in done.stdout
    assert "\\b" not in done.stdout


def test_simplify_keeps_the_count_and_the_lines(scan, tmp_path):
    """The lines that stay are lines of the input."""
    done = cli("simplify", scan, tmp_path / "thin.xyz", "--keep", "10%")
    assert (done.returncode, done.stderr) == (0, "")
    assert "kept 50 of 500 points (10.00%)" in done.stdout
    lines = scan.read_text().splitlines()
    kept = (tmp_path / "thin.xyz").read_text().splitlines()
    assert len(kept) == 50
    places = [lines.index(line) for line in kept]
    assert places == sorted(places)


def test_simplify_by_the_paper(scan, tmp_path):
    """Clusters to delete as a number and as a share; quiet prints nothing."""
    done = cli("simplify", scan, tmp_path / "a.ply", "--clusters", 25, "--delete", 3, "--seed", 1)
    assert "Deleted 3 of 25 clusters." in done.stdout
    quiet = cli(
        "simplify", scan, tmp_path / "b.ply", "--clusters", 25, "--delete", "12%", "--seed", 1, "-q"
    )
    assert (quiet.returncode, quiet.stdout, quiet.stderr) == (0, "", "")
    data, same = (plyfile.PlyData.read(str(tmp_path / name)) for name in ("a.ply", "b.ply"))
    np.testing.assert_array_equal(data["vertex"].data, same["vertex"].data)
    assert any("seed=1" in line for line in data.comments)


def test_run_prints_a_table_and_writes_a_report(scan, tmp_path):
    """Figures on the terminal and in the folder."""
    done = cli("run", scan, "--keep", "20%", "--out", tmp_path / "result")
    assert done.returncode == 0, done.stderr
    assert "Points: 500 -> 100 (20.00%)" in done.stdout
    for word in ("uncut", "cut at 1 %", "floor"):
        assert word in done.stdout
    report = json.loads((tmp_path / "result" / "report.json").read_text())
    assert report["points"]["simplified"] == 100


def test_run_as_json(scan, tmp_path):
    """The same report on stdout, for scripts."""
    done = cli("run", scan, "--count", 100, "--out", tmp_path, "--json", "--no-floor")
    assert json.loads(done.stdout)["points"]["simplified"] == 100


@pytest.mark.parametrize("move", [[], ["--move"]])
def test_run_surface_first(scan, tmp_path, move):
    """The surface of the whole cloud, collapsed to the count."""
    done = cli("run", scan, "--count", 100, "--out", tmp_path, "--order", "surface-first", *move)
    assert done.returncode == 0, done.stderr
    assert "surface first" in done.stdout
    points = plyfile.PlyData.read(str(tmp_path / "simplified.ply"))["vertex"].data
    assert len(points) == 100
    known = set(map(tuple, np.loadtxt(scan)))
    inside = [(row["x"], row["y"], row["z"]) in known for row in points]
    assert all(inside) == (not move)


def test_compare_as_json(scan, tmp_path):
    """Errors and counts of two files."""
    cli("simplify", scan, tmp_path / "thin.xyz", "--count", 50)
    done = cli("compare", scan, tmp_path / "thin.xyz", "--json")
    figures = json.loads(done.stdout)
    assert figures["other"]["points"] == 50
    assert figures["backward"]["uncut"]["max"] == 0


def test_methods_are_listed_and_described():
    """Each with its source; one with its parameters."""
    assert "8825205" in cli("methods").stdout
    assert "--set evenness=" in cli("methods", "adaptive").stdout


def test_any_method_runs_by_name(scan, tmp_path):
    """A rival by name, with a parameter of its own."""
    done = cli(
        "simplify", scan, tmp_path / "thin.ply", "--method", "shi2011",
        "--set", "normal_threshold=0.2",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "method shi2011" in done.stdout


def test_annotate_by_method(scan, tmp_path):
    """Ranks of the adaptive method: each point its own; the two ways to say it contradict."""
    target = tmp_path / "annotated.ply"
    done = cli("annotate", scan, target, "--method", "adaptive")
    assert done.returncode == 0, done.stderr
    quality = plyfile.PlyData.read(str(target))["vertex"]["quality"]
    assert len(np.unique(quality)) == 500
    assert cli("annotate", scan, target, "--method", "adaptive", "-p", "bunny").returncode == 2


def test_tiles_of_a_las_file(scan, tmp_path):
    """Tile by tile to an exact count; options that need tiles say so."""
    source, target = tmp_path / "scan.las", tmp_path / "thin.las"
    laspy = pytest.importorskip("laspy")
    cloud = laspy.create(point_format=6)
    cloud.header.scales = [1e-6] * 3
    cloud.x, cloud.y, cloud.z = np.loadtxt(scan).T
    cloud.write(str(source))
    done = cli("simplify", source, target, "--count", 100, "--tiles", 3)
    assert done.returncode == 0, done.stderr
    assert "kept 100 of 500 points" in done.stdout
    assert "3 tiles" in done.stdout
    assert len(laspy.read(str(target)).points) == 100
    for wrong in (["--tiles", "x"], ["--workers", "2"], ["--tiles", "2", "--drop-invalid"]):
        done = cli("simplify", source, target, "--count", 100, *wrong)
        assert done.returncode == 2
        assert "--" in done.stderr


@pytest.mark.slow
def test_demo_goes_all_the_way(tmp_path):
    """28088 points, no file and no network."""
    done = cli("demo", "--out", tmp_path / "demo")
    assert done.returncode == 0, done.stderr
    assert "28088 ->" in done.stdout
    assert sample_mesh("bunny.obj").exists()
    for folder in ("paper", "adaptive"):
        report = json.loads((tmp_path / "demo" / folder / "report.json").read_text())
        assert report["points"]["original"] == 28088
