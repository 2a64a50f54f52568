"""Whatever is wrong with an input: one sentence, an exit code, nothing left behind."""

import os
import struct
import subprocess
import sys

import numpy as np
import pytest
from command import check_refused, environment, meshlab_filter, snapshot

RNG = np.random.default_rng(0)
CLOUD = RNG.random((300, 3))
PLY = b"ply\nformat %s 1.0\nelement vertex %d\n" + b"".join(
    b"property float %c\n" % axis for axis in b"xyz"
) + b"end_header\n"  # fmt: skip


def lines(points):
    """Return points as text."""
    return "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in np.asarray(points).tolist()).encode()


def obj(points):
    """Return points as vertices of an OBJ file."""
    return b"".join(b"v %r %r %r\n" % tuple(point) for point in np.asarray(points).tolist())


NO_NUMBER = np.vstack([CLOUD, [[np.nan, 0, 0]], [[0, np.inf, 0]]])
BAD_FILES = {
    "empty.ply": (b"", "is empty", 4),
    "empty.xyz": (b"", "is empty", 4),
    "empty.obj": (b"", "is empty", 4),
    "cut.ply": (PLY % (b"binary_little_endian", 9) + bytes(50), "cut short", 4),
    "cut_ascii.ply": (PLY % (b"ascii", 9) + b"0 0 0\n1 1 1\n", "cut short", 4),
    "huge.ply": (PLY % (b"binary_little_endian", 10**15) + bytes(50), "cut short", 4),
    "huge_ascii.ply": (PLY % (b"ascii", 10**15) + b"0 0 0\n", "cut short", 4),
    "negative.ply": (PLY % (b"ascii", -9) + b"0 0 0\n", "not PLY", 4),
    "text.ply": (b"These are not the points you are looking for.\n", "does not begin with", 4),
    "binary.xyz": (bytes(range(256)), "Not a text file", 4),
    "words.xyz": (b"1 2 3\nfour five six\n", "Not lines of numbers", 4),
    "unknown.foo": (b"1 2 3\n", "Unknown extension", 4),
    "two_numbers.obj": (b"v 1 2\n", "MeshLab cannot read the file", 4),
    "huge.off": (b"OFF\n1000000000000 0 0\n1 2 3\n", "MeshLab cannot read the file", 4),
    "huge.stl": (bytes(80) + b"\xff\xff\xff\xff" + bytes(100), "cut short", 4),
    "word.stl": (b"solid\nnonsense\n", "MeshLab cannot read the file", 4),
    "none.ply": (PLY % (b"ascii", 0), "no points", 3),
    "one.xyz": (lines(CLOUD[:1]), "at least 3. Given: 1", 3),
    "two.xyz": (lines(CLOUD[:2]), "at least 3. Given: 2", 3),
    "equal.xyz": (lines(np.ones((90, 3))), "All points are in one place", 3),
    "invalid.xyz": (lines(NO_NUMBER), "2 of 302 points are NaN or infinite", 3),
    "invalid.obj": (obj(NO_NUMBER), "2 of 302 points are NaN or infinite", 3),
    "all_nan.xyz": (lines(np.full((9, 3), np.nan)), "9 of 9 points are NaN or infinite", 3),
}


SLOW = pytest.mark.slow


@pytest.mark.parametrize(
    ("verb", "process"),
    [("simplify", False), *(pytest.param(verb, True, marks=SLOW)
                            for verb in ("simplify", "run", "compare"))],
)  # fmt: skip
@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_file(tmp_path, monkeypatch, capsys, name, verb, process):
    """Each damaged or unusable file is refused by every command, in one sentence."""
    if verb == "compare" and name in ("one.xyz", "two.xyz"):
        pytest.skip("distances from one point are defined")
    content, message, code = BAD_FILES[name]
    if verb == "compare" and name == "equal.xyz":
        message, code = "All points are in one place", 3
    (tmp_path / name).write_bytes(content)
    arguments = {
        "simplify": ["simplify", name, "thin.ply", "--keep", "50%"],
        "run": ["run", name, "--out", "result/deep", "--keep", "50%"],
        "compare": ["compare", name, name, "--json"],
    }[verb]
    monkeypatch.chdir(tmp_path)
    check_refused(
        tmp_path, *arguments, message=message, code=code, capsys=None if process else capsys
    )


@pytest.mark.parametrize("verb", [["simplify", "x.ply", "y.ply"], ["run", "x.ply"],
                                  ["compare", "x.ply", "x.ply"]])  # fmt: skip
def test_missing_file_and_folder(tmp_path, verb):
    """A file that is not there, and a folder in its place."""
    check_refused(tmp_path, *verb, message="No such file. Given: x.ply.", code=4)
    (tmp_path / "x.ply").mkdir()
    check_refused(tmp_path, *verb, message="Not a file but a folder. Given: x.ply.", code=4)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--clusters", "0"], "clusters"),
        (["--clusters", "-5"], "clusters"),
        (["--clusters", "20", "--delete", "20"], "delete"),
        (["--clusters", "20", "--delete", "21"], "delete"),
        (["--delete", "100%"], "delete"),
        (["--delete", "-3"], "delete"),
        (["--delete", "-3%"], "delete"),
        (["--delete", "nan%"], "delete"),
        (["--delete", "many"], "delete"),
        (["--count", "0"], "count"),
        (["--count", "-1"], "count"),
        (["--count", "301"], "count"),
        (["--count", "1e3"], "count"),
        (["--count", "10", "--keep", "10%"], "count and keep"),
        (["--keep", "0%"], "keep"),
        (["--keep", "101%"], "keep"),
        (["--keep", "10"], "percentage"),
        (["-k", "0"], "k"),
        (["-k", "-2"], "k"),
        (["--init", "magic"], "init"),
        (["--method", "magic"], "magic"),
        (["--method", "adaptive", "--set", "evenness=-1", "--count", "9"], "evenness"),
        (["--method", "adaptive", "--set", "evenness", "--count", "9"], "evenness"),
        (["--method", "adaptive", "--set", "magic=1", "--count", "9"], "magic"),
        (["--seed", "-1"], "seed"),
        (["--seed", "1.5"], "seed"),
        (["--no-such-option"], "No such option"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)  # fmt: skip
@pytest.mark.parametrize("process", [False, pytest.param(True, marks=SLOW)], ids=["", "process"])
@pytest.mark.parametrize("verb", ["simplify", "run"])
def test_bad_parameter(tmp_path, monkeypatch, capsys, options, message, verb, process):
    """Numbers out of range, of the wrong kind, or against each other."""
    (tmp_path / "scan.xyz").write_bytes(lines(CLOUD))
    monkeypatch.chdir(tmp_path)
    target = ["thin.ply"] if verb == "simplify" else ["--out", "result"]
    check_refused(
        tmp_path, verb, "scan.xyz", *target, *options,
        message=message, code=2, capsys=None if process else capsys,
    )  # fmt: skip


def test_more_clusters_than_points(tmp_path, monkeypatch, capsys):
    """The cloud is what does not fit, and is named."""
    (tmp_path / "scan.xyz").write_bytes(lines(CLOUD))
    monkeypatch.chdir(tmp_path)
    check_refused(
        tmp_path, "simplify", "scan.xyz", "thin.ply", "--clusters", 301,
        message="at least one for each of 301 clusters. Given: 300.", code=3, capsys=capsys,
    )  # fmt: skip


def test_invalid_points_are_dropped_on_request_and_counted(tmp_path):
    """--drop-invalid says how many points it left out; the others stay as they were written."""
    for name, content in (("a.xyz", lines(NO_NUMBER[::-1])), ("a.obj", obj(NO_NUMBER))):
        (tmp_path / name).write_bytes(content)
        done = meshlab_filter(
            "simplify", name, "thin.xyz", "--count", 300, "--drop-invalid", folder=tmp_path
        )
        assert done.returncode == 0, done.stderr
        assert "Left out 2 points with NaN or infinite coordinates." in done.stdout
    assert (tmp_path / "thin.xyz").read_bytes() == lines(CLOUD)
    done = meshlab_filter(
        "run", "a.obj", "--count", 100, "--drop-invalid", "--no-floor", folder=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert "Left out: 2 points that were not finite" in done.stdout


def test_invalid_vertices_of_stl_are_not_dropped_silently(tmp_path):
    """MeshLab removes them while it reads; they are counted all the same."""
    corners = RNG.random((50, 3, 3)).astype("f4")
    corners[3, 1, 0] = np.nan
    (tmp_path / "a.stl").write_bytes(
        bytes(80) + struct.pack("<I", 50)
        + b"".join(struct.pack("<12fH", 0, 0, 1, *corner.ravel(), 0) for corner in corners)
    )  # fmt: skip
    check_refused(
        tmp_path, "simplify", "a.stl", "b.ply", "--count", 9, message="1 of 150 points", code=3
    )


@SLOW
def test_points_on_a_line(tmp_path):
    """A line can be thinned; no surface goes through it."""
    line = np.linspace([0, 1, 5], [3, 1, 7], 200)
    (tmp_path / "line.xyz").write_bytes(lines(line))
    for options in (["--count", "50"], ["--clusters", "20", "--delete", "5"]):
        done = meshlab_filter("simplify", "line.xyz", "thin.xyz", *options, folder=tmp_path)
        assert done.returncode == 0, done.stderr
        (tmp_path / "thin.xyz").unlink()
        check_refused(tmp_path, "run", "line.xyz", *options, message="on a line")


@SLOW
def test_points_on_a_plane(tmp_path):
    """A plane is a surface like any other."""
    flat = np.column_stack([RNG.random((400, 2)), np.full(400, 7.0)])
    (tmp_path / "flat.xyz").write_bytes(lines(flat))
    for options in (["--count", "100"], ["--clusters", "20", "--delete", "5"]):
        done = meshlab_filter("run", "flat.xyz", *options, "--quiet", folder=tmp_path)
        assert done.returncode == 0, done.stderr
        assert done.stdout == done.stderr == ""


def test_three_points(tmp_path):
    """The smallest cloud there is."""
    (tmp_path / "three.xyz").write_bytes(lines(CLOUD[:3]))
    done = meshlab_filter("simplify", "three.xyz", "two.xyz", "--count", "2", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert len((tmp_path / "two.xyz").read_bytes().splitlines()) == 2


def test_a_module_beside_the_scan_is_not_imported(tmp_path):
    """A folder with a numpy.py in it is a place to work in like any other."""
    (tmp_path / "scan.xyz").write_bytes(lines(CLOUD))
    for name in ("numpy", "random", "report", "json"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('the wrong module')\n")
    entry = "import sys; del sys.path[0]; from meshlab_filter.__main__ import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", entry, "simplify", "scan.xyz", "thin.xyz", "--count", "9"],
        cwd=tmp_path, env=environment(), capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def test_file_name_that_is_not_unicode(tmp_path):
    """A result or a sentence, whatever bytes the name has."""
    for suffix, content in ((b".xyz", lines(CLOUD)), (b".obj", obj(CLOUD))):
        name = os.fsdecode(b"sc\xe9n" + suffix)
        (tmp_path / name).write_bytes(content)
        done = meshlab_filter("simplify", name, "thin.ply", "--count", "9", folder=tmp_path)
        assert done.returncode in (0, 4), done.stderr
        assert "Traceback" not in done.stderr


def test_nothing_is_left_beside_a_result(tmp_path):
    """Only the files that were asked for, with the rights of any other new file."""
    (tmp_path / "scan.xyz").write_bytes(lines(CLOUD))
    assert meshlab_filter("simplify", "scan.xyz", "thin.ply", folder=tmp_path).returncode == 0
    assert set(snapshot(tmp_path)) == {path.relative_to(tmp_path) for path in tmp_path.iterdir()}
    assert {path.name for path in tmp_path.iterdir()} == {"scan.xyz", "thin.ply"}
    assert (tmp_path / "thin.ply").stat().st_mode == (tmp_path / "scan.xyz").stat().st_mode
