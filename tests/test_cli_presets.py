"""Presets on the command line, run as a process: what holds, and what ends as a sentence."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import plyfile
import pytest

from meshlab_filter.presets import PRESETS, find


def cli(*arguments, **options):
    """Run the command line and return the finished process."""
    command = [sys.executable, "-m", "meshlab_filter", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, **options)


def fails(done, code, *words):
    """Check that the process ended with the code and one sentence that has the words."""
    assert done.returncode == code, done.stdout + done.stderr
    lines = [line for line in done.stderr.splitlines() if line.startswith("Error: ")]
    assert len(lines) == 1, done.stderr
    assert "Traceback" not in done.stderr
    for word in words:
        assert word in lines[0]


def write_cloud(path, points, **columns):
    rows = np.zeros(len(points), [*((a, "f4") for a in "xyz"), *((c, "f4") for c in columns)])
    for column, axis in enumerate("xyz"):
        rows[axis] = points[:, column]
    for name, values in columns.items():
        rows[name] = values
    plyfile.PlyData([plyfile.PlyElement.describe(rows, "vertex")]).write(str(path))
    return path


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    """Write an ellipsoid of 500 points."""
    points = np.random.default_rng(0).normal(size=(500, 3))
    points = points / np.linalg.norm(points, axis=1)[:, None] * [3, 2, 1]
    return write_cloud(tmp_path_factory.mktemp("presets") / "scan.ply", points)


def script(body, head="<!DOCTYPE FilterScript>"):
    return f"{head}\n<FilterScript>\n{body}\n</FilterScript>\n"


DEFAULT = find("default").read_text()
INSTRUCTION = '<?meshlab-filter clusters="25" seed="0"?>\n'
THIN = ('<filter name="Duplicate Current layer"/>\n<filter name="Conditional Vertex Selection">\n'
        '<Param type="RichString" name="condSelect" value="{}"/>\n</filter>\n'
        '<filter name="Delete Selected Vertices"/>\n')  # fmt: skip
BOMB = '<!DOCTYPE FilterScript [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;">]>'
FILE = '<!DOCTYPE FilterScript [<!ENTITY a SYSTEM "file:///etc/hostname">]>'

# What MeshLab answers with a silent stop, a wrong result or a crash.
FAULTS = {
    "empty file": ("", ["line 1", "well-formed"]),
    "not XML": ("ply\nformat ascii 1.0\n", ["line 1", "well-formed"]),
    "cut short": (DEFAULT[: len(DEFAULT) // 2], ["well-formed"]),
    "entity bomb": (script('<filter name="&b;"/>', BOMB), ["entities"]),
    "external entity": (script('<filter name="&a;"/>', FILE), ["entities"]),
    "external DTD": (script("", '<!DOCTYPE FilterScript SYSTEM "file:///x.dtd">'), ["refer"]),
    "another root": ("<MeshLabProject/>", ["root element", "MeshLabProject"]),
    "another element": (script('<xmlfilter name="A"/>'), ["line 3", "<filter>", "xmlfilter"]),
    "no filters": (script(""), ["no filters"]),
    "unknown filter": (
        script('<filter name="Duplicate current layer"/>'),
        ["line 3", "'Duplicate current layer'", "such as 'Duplicate Current layer'"],
    ),
    "unknown parameter": (
        script(INSTRUCTION + THIN.replace("condSelect", "condselect").format("(q &lt; 3)")),
        ["line 6", "'Conditional Vertex Selection'", "such as 'condSelect'"],
    ),
    "wrong type": (DEFAULT.replace('"RichInt" name="K" value="12"',
                                   '"RichInt" name="K" value="twelve"'), ["'K'", "whole number"]),
    "wrong kind": (DEFAULT.replace('type="RichInt" name="K"', 'type="RichString" name="K"'),
                   ["'K'", "RichInt"]),
    "no bounds": (DEFAULT.replace('value="0" min="0" max="100"', 'value="0"'),
                  ["'BallRadius'", "'min'", "Ball Pivoting"]),
    "out of range": (DEFAULT.replace('value="0" min="0" max="100"', 'value="900" min="0" max="9"'),
                     ["'BallRadius'", "from -9 to 18"]),
    "layer that never exists": (DEFAULT.replace('name="TargetMesh" value="1"',
                                                'name="TargetMesh" value="7"'),
                                ["'TargetMesh'", "exists then (0, 1)", "Given: 7"]),
    "expression": (script(INSTRUCTION + THIN.format("(q &lt;")), ["line 6", "Unexpected end"]),
    "assignment": (script(INSTRUCTION + THIN.format("q = 3")), ["single = assigns"]),
    "name in expression": (script(INSTRUCTION + THIN.format("(rank &lt; 3)")), ["Unexpected"]),
    "cut above all": (script(INSTRUCTION + THIN.format("(q &lt; 26)")),
                      ["deletes all 500 vertices", "goes up to 24"]),
    "no quality": (script(THIN.format("(q &lt; 3)")), ["without quality", "annotate"]),
    "instruction": (DEFAULT.replace('seed="0"', 'seed="first"'), ["Invalid seed", "'first'"]),
    "option": (DEFAULT.replace('seed="0"', 'cluster="5"'), ["'cluster'"]),
    "nothing left half way": (
        script(INSTRUCTION + THIN.format("(q &lt; 3)") + THIN.format("(q &lt; 99)")
               + '<filter name="Compute normals for point sets"/>'), ["none by then"]),
    "nothing left at the end": (
        script(INSTRUCTION + THIN.format("(q &lt; 3)") + THIN.format("(q &lt; 99)")),
        ["leaves no vertices"]),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", FAULTS)
def test_faulty_scripts(name, scan, tmp_path):
    """Each fault of a script is one sentence with file and line, exit 5, and nothing is written."""
    text, words = FAULTS[name]
    path = tmp_path / "my.mlx"
    path.write_text(text)
    done = cli("run", scan, "--preset", path, "--out", tmp_path / "out")
    fails(done, 5, "my.mlx", *words)
    assert not (tmp_path / "out").exists()


def test_one_faulty_script(scan, tmp_path):
    """A filter that MeshLab does not know, which crashes its window."""
    path = tmp_path / "my.mlx"
    path.write_text(script('<filter name="Simplify it"/>'))
    done = cli("run", scan, "--preset", path, "--out", tmp_path / "out")
    fails(done, 5, "my.mlx, line 3, filter 'Simplify it'")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "content", "code"),
    [
        ("empty.fbx", b"", 4),
        ("empty.asc", b"", 4),
        ("header.asc", b"\n", 4),
        ("some.fbx", b"x" * 100, 4),
        ("none.ply", b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\n"
         b"property float y\nproperty float z\nend_header\n", 3),
        ("one.xyz", b"0 0 0\n", 3),
        ("same.xyz", b"1 2 3\n" * 50, 3),
    ],
)  # fmt: skip
@pytest.mark.parametrize("command", ["run", "annotate"])
def test_clouds_that_crash_meshlab(command, name, content, code, tmp_path):
    """Files and clouds on which MeshLab ends the process end as a sentence."""
    path = tmp_path / name
    path.write_bytes(content)
    if command == "run":
        done = cli("run", path, "-p", "default", "--out", tmp_path / "out")
    else:
        done = cli("annotate", path, tmp_path / "out.ply")
    fails(done, code)
    assert [entry.name for entry in tmp_path.iterdir()] == [name]


@pytest.mark.slow
def test_custom_attributes_do_not_crash(tmp_path):
    """A file with a property of its own, and a script with a condition on it."""
    points = np.random.default_rng(0).random((300, 3))
    path = write_cloud(tmp_path / "scan.ply", points, height=np.arange(300))
    mine = tmp_path / "my.mlx"
    mine.write_text(script(THIN.format("(z &lt; 0.2)")))
    assert cli("run", path, "-p", mine, "--out", tmp_path / "a").returncode == 0
    assert cli("run", path, "-p", "default", "--out", tmp_path / "b").returncode == 0
    kept = plyfile.PlyData.read(str(tmp_path / "a/simplified.ply"))["vertex"]
    assert (kept["z"] >= 0.2).all()
    assert (kept["height"] == np.flatnonzero(points[:, 2].astype("f4") >= np.float32(0.2))).all()


@pytest.mark.slow
def test_missing_script_and_preset(scan, tmp_path):
    """A file or a name that is not there, with the nearest names."""
    fails(cli("run", scan, "-p", tmp_path / "none.mlx", "-o", tmp_path / "out"), 5, "none.mlx")
    fails(cli("simplify", scan, tmp_path / "thin.ply", "-p", "bunni"), 5, "such as bunny")
    fails(cli("presets", "show", "bunni"), 5, "such as bunny")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_options_that_contradict_a_preset(scan, tmp_path):
    """A preset is edited, not overruled."""
    done = cli("run", scan, "-p", "default", "--delete", "5", "--out", tmp_path / "out")
    assert done.returncode == 2
    assert "--delete cannot go with --preset" in done.stderr
    done = cli("run", scan, "-p", "default", "--set", "evenness=2", "--out", tmp_path / "out")
    assert done.returncode == 2
    assert "--set cannot go with --preset" in done.stderr


def test_annotate_then_run(scan, tmp_path):
    """The way to MeshLab's window: an annotated cloud and a fitted preset."""
    cloud, fitted = tmp_path / "annotated.ply", tmp_path / "annotated.mlx"
    done = cli("annotate", scan, cloud, "--fit", fitted)
    assert done.returncode == 0, done.stderr
    assert "500 points with quality 2 to 98" in done.stdout  # 25 clusters, in per cent
    assert "coloured by entropy" in done.stdout
    assert fitted.read_text().count("Ball Pivoting") == 4
    assert "quality" in plyfile.PlyData.read(str(cloud))["vertex"].data.dtype.names


def test_save_preset_and_run_it(scan, tmp_path):
    """What was written down does the same again."""
    first = cli("simplify", scan, tmp_path / "a.ply", "--keep", "40%", "--save-preset",
                tmp_path / "my.mlx")  # fmt: skip
    again = cli("simplify", scan, tmp_path / "b.ply", "--preset", tmp_path / "my.mlx")
    assert first.returncode == again.returncode == 0, first.stderr + again.stderr
    one, two = (plyfile.PlyData.read(str(tmp_path / n))["vertex"].data for n in ("a.ply", "b.ply"))
    np.testing.assert_array_equal(one, two)


@pytest.mark.slow
def test_presets_list_show_copy(tmp_path):
    """Presets can be listed, read and copied."""
    listed = cli("presets", "list")
    assert all(name in listed.stdout for name in PRESETS)
    shown = cli("presets", "show", "bunny")
    assert "select the vertices with (q < 60)" in shown.stdout
    assert cli("presets", "show", "bunny", "--xml").stdout == find("bunny").read_text()
    assert cli("presets", "copy", "bunny", tmp_path / "mine").returncode == 0
    assert (tmp_path / "mine/bunny.mlx").read_bytes() == find("bunny").read_bytes()
    fails(cli("presets", "copy", "bunny", tmp_path / "mine"), 7, "--overwrite")


@pytest.mark.slow
def test_batch(scan, tmp_path):
    """One bad file does not stop the rest; the table and the exit code say so."""
    bad = tmp_path / "bad.ply"
    bad.write_text("ply\n")
    other = tmp_path / "other.ply"
    other.write_bytes(Path(scan).read_bytes())
    out = tmp_path / "result"
    done = cli("run", scan, bad, other, "-p", "default", "--out", out, "--jobs", "2",
               "--no-floor")  # fmt: skip
    assert done.returncode == 4
    assert "2 of 3 files done" in done.stdout
    assert "failed (exit 4)" in done.stdout
    assert done.stderr.count("Error: ") == 1
    assert "bad.ply" in done.stderr
    assert sorted(path.name for path in out.iterdir()) == ["other", "scan"]
    one, two = (json.loads((out / n / "report.json").read_text()) for n in ("scan", "other"))
    assert one["error"] == two["error"]
    assert one["error"]["floor"] is None
    again = cli("run", scan, other, "--keep", "12.5%", "--out", out, "--json", "--no-floor")
    assert again.returncode == 0
    assert [row["report"]["points"]["simplified"] for row in json.loads(again.stdout)] == [62, 62]
    twice = cli("run", scan, scan, "-p", "default", "--out", out)
    fails(twice, 7, "Two files would write")
