"""The HTML report: what it holds, and that it is the same every time."""

import base64
import json
import re
from pathlib import Path

import numpy as np
import numpy.testing as npt
import plyfile
import pytest

import meshlab_filter as mf
from meshlab_filter.chain import FILES
from meshlab_filter.cli.options import method_arguments, method_options
from meshlab_filter.cli.run import command as run_command
from meshlab_filter.display import coarsen, pack, thin
from meshlab_filter.errors import OutputError
from meshlab_filter.quality import edge_defects
from meshlab_filter.repeat import command_line, python_lines

pytest.importorskip("plotly")
pytest.importorskip("jinja2")


def write_sphere(path: Path, count: int = 1200) -> Path:
    """Write points spread evenly over the unit sphere (a Fibonacci lattice)."""
    index = np.arange(count) + 0.5
    height = 1 - 2 * index / count
    angle = np.pi * (1 + 5**0.5) * index
    radius = np.sqrt(1 - height**2)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    rows = np.empty(count, dtype=[("x", "f4"), ("y", "f4"), ("z", "f4")])
    rows["x"], rows["y"], rows["z"] = points.T
    plyfile.PlyData([plyfile.PlyElement.describe(rows, "vertex")], byte_order="<").write(str(path))
    return path


def payload_of(page: str) -> dict:
    """Return the data in a page."""
    found = re.search(r'<script type="application/json" id="payload">(.*?)</script>', page, re.S)
    return json.loads(found[1])


def unpack(spec: dict) -> np.ndarray:
    """Read a packed array as the page's script does."""
    return np.frombuffer(base64.b64decode(spec["data"]), dtype="<" + spec["kind"])


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """Run the chain with the paper's rule on a file of an unfriendly name."""
    folder = tmp_path_factory.mktemp("report")
    source = write_sphere(folder / "<b onclick=alert(1)>scan&'.ply")
    report = mf.run(source, folder / "out", delete=10, seed=3, html=True)
    return folder, source, report, (folder / "out" / "report.html").read_text(encoding="utf-8")


def test_views_hold_the_clouds(result):
    """The packed points are the clouds', from the middle of the box, and errors go with them."""
    _folder, source, report, page = result
    original, simplified, surface = payload_of(page)["views"]
    rows = plyfile.PlyData.read(str(source))["vertex"].data
    points = np.column_stack([rows["x"], rows["y"], rows["z"]]).astype(float)
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    shown = np.column_stack([unpack(original[axis]) for axis in "xyz"])
    npt.assert_allclose(shown, points - centre, atol=1e-6)
    error = unpack(original["values"]["error"]["data"])
    npt.assert_allclose(error.mean(), report["error"]["uncut"]["mean"], rtol=1e-5)
    assert len(unpack(simplified["x"])) == report["points"]["simplified"]
    assert len(unpack(surface["faces"])) == 3 * report["surface"]["faces"]
    assert simplified["note"] == f"{report['points']['simplified']} points"


def test_views_have_every_colouring(result):
    """Error, rank and entropy are there for every point, finite and on one scale."""
    _, _, _, page = result
    for view in payload_of(page)["views"]:
        assert list(view["values"]) == ["error", "rank", "entropy"]
        for values in view["values"].values():
            found = unpack(values["data"])
            assert len(found) == len(unpack(view["x"]))
            assert np.isfinite(found).all()
            assert values["low"] <= values["high"]


def test_histograms_count_everything(result):
    """Every point, triangle and cluster is in a bin."""
    _, _, report, page = result
    error, compactness, size, entropy = payload_of(page)["histograms"]
    for series in error["series"]:
        assert sum(series["counts"]) == report["points"]["original"]
    for series in compactness["series"]:
        npt.assert_allclose(sum(series["counts"]), 100)
    for spec in (size, entropy):
        left, deleted = (sum(series["counts"]) for series in spec["series"])
        assert deleted == 10
        assert left + deleted == report["clusters"]["total"]
    assert [series["name"] for series in error["series"]] == ["simplified", "untouched"]


def test_names_are_escaped(result):
    """A file's name never becomes markup."""
    _, _, _, page = result
    head = page[: page.index('id="payload"')]
    assert "<b onclick" not in page
    assert "&lt;b onclick=alert(1)&gt;scan&amp;&#39;.ply" in head


def test_figures_and_meanings_are_there(result):
    """The page states figures, what they mean and how to repeat the run."""
    _, _, report, page = result
    for text in (
        f"{report['error']['uncut']['mean']:.2e}",
        "a hole shows in it",
        "due to the simplification",
        report["input"]["sha256"],
        "--delete 10",
    ):
        assert text in page


def test_page_is_the_same_every_time(result, tmp_path):
    """Same input and parameters, same bytes: no times, no random names."""
    _folder, source, _, page = result
    mf.run(source, tmp_path / "again", delete=10, seed=3, html=True)
    assert (tmp_path / "again" / "report.html").read_text(encoding="utf-8") == page


def test_nothing_is_loaded(result):
    """The page forbids loading anything and has no address outside the plotting library."""
    _, _, _, page = result
    assert "default-src 'none'" in page
    start, end = page.index("* plotly.js"), page.rindex("<script>")
    assert not re.search(r"(?:src|href)=|https?://", page[:start] + page[end:])


def test_run_writes_no_page_unless_asked(tmp_path):
    """From Python the page is written on request only."""
    mf.run(write_sphere(tmp_path / "scan.ply", 300), tmp_path / "out", count=100, floor=False)
    assert {file.name for file in (tmp_path / "out").iterdir()} == set(FILES)


def test_without_surface_there_are_two_views(tmp_path):
    """With no surface the page has the two clouds and no histogram of triangles."""
    source = write_sphere(tmp_path / "scan.ply", 300)
    mf.run(source, tmp_path / "out", count=100, surface="none", html=True)
    payload = payload_of((tmp_path / "out" / "report.html").read_text(encoding="utf-8"))
    assert [view["title"] for view in payload["views"]] == ["Original", "Simplified"]
    assert [spec["title"] for spec in payload["histograms"]] == ["Error of the original points"]


def test_page_names_the_missing_package(tmp_path, monkeypatch):
    """Without plotly a page asked for is refused before any work, with how to install it."""
    monkeypatch.setattr("meshlab_filter.htmlreport.missing", lambda: ["plotly"])
    with pytest.raises(OutputError, match=r"needs plotly: pip install 'meshlab-filter\[report\]'"):
        mf.run(tmp_path / "scan.ply", tmp_path / "out", html=True)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        {"method": "cluster-entropy", "delete": 0.074, "k": 4, "init": "k-means++"},
        {"method": "cluster-entropy", "clusters": 40, "delete": 7, "keep_representative": True},
        {"method": "cluster-entropy", "delete": 3, "definition": "raw", "tol": 1e-3},
        {"method": "adaptive", "count": 77, "evenness": 0.25, "noisy": True},
        {"method": "random", "count": 30, "seed": 9},
    ],
)
def test_command_and_lines_repeat_the_run(arguments, tmp_path, monkeypatch):
    """The command and the Python lines stand for the parameters they were made from."""
    monkeypatch.chdir(tmp_path)
    source = write_sphere(tmp_path / "my scan.ply", 300)
    found = mf.simplify(mf.read_cloud(source).points, **arguments)
    parameters = {"method": found.method, "asked": found.asked, **found.parameters}
    parameters |= {"surface": "none", "drop_invalid": True}
    report = {"input": {"path": source.name}, "parameters": parameters}

    import shlex

    words = shlex.split(command_line(report))
    assert words[:3] == ["meshlab-filter", "run", source.name]
    given = run_command.make_context("run", words[2:]).params
    assert given["surface"] == "none"
    assert given["drop_invalid"]
    options = {
        name: given[name]
        for name in (option.name for option in method_options(lambda: None).__click_params__)
        if name not in ("drop_invalid", "quiet", "seed")
    }
    again = mf.simplify(
        mf.read_cloud(source).points, seed=given["seed"], **method_arguments(**options)
    )
    npt.assert_array_equal(again.indices, found.indices)

    namespace: dict = {}
    exec(python_lines(report), namespace)
    repeated = namespace["report"]["parameters"]
    assert {key: repeated[key] for key in parameters} == parameters


def test_thin_keeps_all_of_a_small_cloud_and_the_same_of_a_large_one():
    """Up to the limit all points are drawn; above it a fixed subset without repeats."""
    npt.assert_array_equal(thin(5, most=5), np.arange(5))
    chosen = thin(1000, most=100)
    npt.assert_array_equal(chosen, thin(1000, most=100))
    assert len(np.unique(chosen)) == 100


def test_coarsen_keeps_a_surface_closed():
    """A closed grid surface stays within its box and below the limit, without a new hole."""
    side = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    u, v = (grid.ravel() for grid in np.meshgrid(side, side, indexing="ij"))
    points = np.column_stack([(3 + np.cos(v)) * np.cos(u), (3 + np.cos(v)) * np.sin(u), np.sin(v)])
    a = np.arange(3600).reshape(60, 60)
    b, c, d = np.roll(a, -1, 0), np.roll(a, -1, 1), np.roll(np.roll(a, -1, 0), -1, 1)
    faces = np.concatenate(
        [np.stack([a, b, d], -1).reshape(-1, 3), np.stack([a, d, c], -1).reshape(-1, 3)]
    )
    values = np.random.default_rng(0).random((3600, 2))
    merged, left, highest = coarsen(points, faces, values, most=2000)
    assert 500 < len(left) <= 2000
    assert left.max() < len(merged) == len(highest)
    assert edge_defects(left)["boundary_edges"] == 0
    assert (merged >= points.min(axis=0)).all()
    assert (merged <= points.max(axis=0)).all()
    npt.assert_allclose(highest.max(axis=0), values.max(axis=0))


def test_views_say_when_they_are_thinned(tmp_path, monkeypatch):
    """Above the limits the notes say how much is drawn, and that the figures count all."""
    monkeypatch.setattr("meshlab_filter.display.thin.__kwdefaults__", {"most": 150})
    monkeypatch.setattr("meshlab_filter.display.coarsen.__kwdefaults__", {"most": 200})
    source = write_sphere(tmp_path / "scan.ply", 600)
    mf.run(source, tmp_path / "out", count=300, html=True, floor=False)
    views = payload_of((tmp_path / "out" / "report.html").read_text(encoding="utf-8"))["views"]
    assert views[0]["note"] == (
        "600 points, of which 150 are drawn, chosen at random; every figure counts all"
    )
    assert len(unpack(views[1]["x"])) == 150
    assert len(unpack(views[2]["faces"])) <= 600
    assert "triangles, of which" in views[2]["note"]


def test_pack_is_little_endian():
    """Arrays of any layout are packed as the page's script reads them."""
    array = np.arange(6.0).reshape(2, 3)
    npt.assert_array_equal(unpack(pack(array.T)), array.T.ravel())
    npt.assert_array_equal(unpack(pack([1, 2, 70000], "i4")), [1, 2, 70000])


def test_page_of_a_preset(tmp_path):
    """A preset's page has its views and repeats itself by its name."""
    from meshlab_filter.scripted import run_preset

    source = write_sphere(tmp_path / "scan.ply", 600)
    report = run_preset(source, tmp_path / "out", "default", html=True)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert command_line(report).endswith("scan.ply --preset default --seed 0")
    assert "&#39;default&#39;" in page
    simplified = payload_of(page)["views"][1]
    assert len(unpack(simplified["x"])) == report["points"]["simplified"]
    namespace: dict = {}
    exec(python_lines(report).replace("'result'", repr(str(tmp_path / "again"))), namespace)
    assert namespace["report"]["points"] == report["points"]


def test_page_offers_the_run_as_a_preset(result, tmp_path):
    """The filter script in the page gives the same cloud and the same error."""
    from html import unescape

    from meshlab_filter.scripted import run_preset

    _, source, report, page = result
    text = unescape(re.search(r"(&lt;!DOCTYPE FilterScript.*?)</pre>", page, re.S)[1])
    (tmp_path / "repeat.mlx").write_text(text, encoding="utf-8")
    again = run_preset(source, tmp_path / "out", tmp_path / "repeat.mlx")
    assert again["points"]["simplified"] == report["points"]["simplified"]
    npt.assert_allclose(
        again["error"]["uncut"]["mean"], report["error"]["uncut"]["mean"], rtol=1e-6
    )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"order": "surface-first", "count": 200}, "--count 200 --order surface-first"),
        ({"order": "surface-first", "count": 90, "move": True}, "--order surface-first --move"),
        ({"count": 200, "fit": False}, "--count 200 --seed 0 --no-fit"),
        ({"count": 200, "surface": "ball-pivoting-auto"}, "--surface ball-pivoting-auto"),
    ],
)
def test_every_kind_of_run_repeats_itself(options, words, tmp_path):
    """Orders, moved points and surfaces are in the command, and the Python lines repeat them."""
    source = write_sphere(tmp_path / "scan.ply", 500)
    report = mf.run(source, tmp_path / "out", html=True, floor=False, **options)
    assert words in command_line(report)
    namespace: dict = {}
    exec(python_lines(report).replace("'result'", repr(str(tmp_path / "again"))), namespace)
    again = namespace["report"]
    assert again["parameters"] == report["parameters"]
    assert again["error"]["uncut"] == report["error"]["uncut"]
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    simplified = payload_of(page)["views"][1]
    assert len(unpack(simplified["x"])) == report["points"]["simplified"]
