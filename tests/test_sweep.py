"""Error against size: the levels of one ranking are the levels of runs of their own."""

import json
import subprocess
import sys

import numpy as np
import numpy.testing as npt
import pytest
from test_htmlreport import payload_of, write_sphere

import meshlab_filter as mf
from meshlab_filter.errors import InvalidParameterError, OutputError
from meshlab_filter.simplification import simplify
from meshlab_filter.sweep import cut, sweep

SHARES = [0.5, 0.1, 0.25]


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    """Write a sphere of 800 points."""
    return write_sphere(tmp_path_factory.mktemp("sweep") / "scan.ply", 800)


@pytest.mark.parametrize("method", ["adaptive", "cluster-entropy", "random", "lee2001"])
def test_levels_are_those_of_runs_of_their_own(scan, tmp_path, method):
    """Each level has the figures of a run that keeps the same share."""
    found = sweep(scan, keep=SHARES, method=method, seed=2)
    assert [level["keep"] for level in found["levels"]] == [0.5, 0.25, 0.1]
    for level in found["levels"]:
        alone = mf.run(scan, tmp_path, keep=level["keep"], method=method, seed=2)
        assert level["points"] == alone["points"]
        npt.assert_allclose(
            level["error"]["uncut"]["mean"], alone["error"]["uncut"]["mean"], rtol=1e-9
        )
        assert level["surface"]["faces"] == alone["surface"]["faces"]
        assert found["floor"]["uncut"] == alone["error"]["floor"]


def test_a_nested_method_ranks_once(scan, monkeypatch):
    """Levels that nest cost one ranking, others one each."""
    calls = []

    def count(*arguments, **options):
        calls.append(options["method"])
        return simplify(*arguments, **options)

    monkeypatch.setattr("meshlab_filter.sweep.simplify", count)
    sweep(scan, keep=SHARES, floor=False)
    assert calls == ["adaptive"]
    sweep(scan, keep=SHARES, method="lee2001", floor=False)
    assert calls == ["adaptive"] + 3 * ["lee2001"]


def test_representatives_are_chosen_for_each_level(scan):
    """With representatives the ranks depend on the level, so each is ranked by itself."""
    options = {"method": "cluster-entropy", "keep_representative": True, "seed": 0}
    found = sweep(scan, keep=[0.9, 0.6], floor=False, **options)
    points = mf.read_cloud(scan).points
    for level in found["levels"]:
        alone = simplify(points, keep=level["keep"], **options)
        assert level["points"]["simplified"] == len(alone.indices)


def test_error_grows_as_points_go(scan):
    """Fewer points of a sphere, more error."""
    means = [level["error"]["uncut"]["mean"] for level in sweep(scan, keep=SHARES)["levels"]]
    assert means == sorted(means)


@pytest.mark.parametrize(
    ("keep", "options", "message"),
    [
        ([], {}, "different shares"),
        ([0.5, 0.5], {}, "different shares"),
        ([0.5, 0.0], {}, "different shares"),
        ([1.5], {}, "different shares"),
        ([0.5], {"method": "cluster-entropy", "delete": 3}, "Must be left out.*delete"),
        ([0.5], {"method": "no-such"}, "Invalid method"),
    ],
)
def test_wrong_levels_are_refused(scan, keep, options, message):
    """What cannot be swept is said in one sentence."""
    with pytest.raises(InvalidParameterError, match=message):
        sweep(scan, keep=keep, **options)


def test_cut_takes_the_nearest_level_of_ties():
    """Where ranks are shared, the level nearest the count is taken, of two the larger."""
    points = np.random.default_rng(0).random((60, 3))
    result = simplify(points, clusters=6, delete=1)
    sizes = np.bincount(np.unique(result.rank, return_inverse=True)[1])
    left = 60 - np.concatenate([[0], np.cumsum(sizes)[:-1]])
    for count in (1, 20, 45, 60):
        assert len(cut(result, count).indices) == left[np.argmin(np.abs(left - count))]


def test_files_hold_the_levels_and_are_the_same_every_time(scan, tmp_path):
    """sweep.json is what is returned; sweep.html has the curve and the same bytes again."""
    pytest.importorskip("plotly")
    pytest.importorskip("jinja2")
    found = sweep(scan, tmp_path / "a", keep=SHARES, html=True)
    sweep(scan, tmp_path / "b", keep=SHARES, html=True)
    assert json.loads((tmp_path / "a" / "sweep.json").read_text()) == found
    page = (tmp_path / "a" / "sweep.html").read_text(encoding="utf-8")
    assert (tmp_path / "b" / "sweep.html").read_text(encoding="utf-8") == page
    assert payload_of(page)["points"] == [400, 200, 80]
    npt.assert_allclose(payload_of(page)["floor"], found["floor"]["uncut"]["mean"])


def test_the_input_is_never_replaced(tmp_path):
    """A cloud that has the name of an output in the folder of the outputs is refused."""
    (tmp_path / "levels").mkdir()
    scan = write_sphere(tmp_path / "scan.ply", 100)
    (tmp_path / "levels" / "sweep.json").symlink_to(scan)
    with pytest.raises(OutputError, match="would replace the input"):
        sweep(scan, tmp_path / "levels", keep=[0.5])


def run_command(*words):
    """Run the command line in a process of its own."""
    command = [sys.executable, "-m", "meshlab_filter", "sweep", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_command_prints_the_table_and_writes_the_files(scan, tmp_path):
    """The command prints a row for each level and the floor."""
    done = run_command(scan, "--keep", "50%,10%", "-o", tmp_path / "out", "--no-report")
    assert done.returncode == 0, done.stderr
    assert "50 %" in done.stdout
    assert "floor" in done.stdout
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["sweep.json"]


def test_no_page_of_an_earlier_run_stays(scan, tmp_path):
    """Without a page of its own, a run takes away the page that would speak of another cloud."""
    for write, page in ((mf.run, "report.html"), (sweep, "sweep.html")):
        (tmp_path / page).write_text("of another cloud")
        (tmp_path / "notes.txt").write_text("of the user")
        write(scan, tmp_path, keep=0.5 if write is mf.run else [0.5], floor=False)
        assert not (tmp_path / page).exists()
        assert (tmp_path / "notes.txt").read_text() == "of the user"


def test_command_refuses_numbers_of_points(scan, tmp_path):
    """A whole number is no share."""
    done = run_command(scan, "--keep", "50%,100", "-o", tmp_path / "out")
    assert done.returncode == 2
    assert "percentages" in done.stderr
    assert not (tmp_path / "out").exists()
