"""The script that reproduces the paper: its tables, and the whole on the smallest model."""

import importlib
import re
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[1] / "scripts"


@pytest.fixture
def module(monkeypatch):
    """Return a function that imports a part of the script."""
    monkeypatch.syspath_prepend(str(SCRIPTS))
    return lambda name: importlib.import_module(f"reproduction.{name}")


@pytest.fixture
def tables(module):
    """Import the module that writes the tables."""
    return module("tables")


def figures(kept, mean, maximum):
    """Return what a measurement returns, with the same errors cut and uncut."""
    error = {"mean": mean, "rms": mean, "max": maximum, "dropped": 3}
    return {"kept": kept, "uncut": error, "cut": {**error, "max": 0.01}, "compact": 0.9}


@pytest.fixture
def results():
    """Return two seeds of the genus: 70 and 74 points removed, errors twice those of chance."""
    runs = [
        {
            "genus": {
                "paper": figures(2496 - gone, 4e-4, 0.03),
                "passes": figures(2496 - gone, 1e-4, 0.02),
                "random": figures(2496 - gone, 2e-4, 0.01),
            },
            "neighbours": {None: {"genus": gone}, 1: {"genus": 60}, 2: {"genus": 61}},
        }
        for gone in (70, 74)
    ]
    floor = {
        "paper": figures(2496, 1e-5, 0.002),
        "passes": figures(2496, 1e-6, 0.001),
        "points": 2496,
    }
    return {"genus": {"floor": floor, "runs": runs}}


def test_spread_is_mean_and_deviation(tables):
    """Two values have a standard deviation of their distance over √2."""
    assert tables.spread([70, 74], "{:.2f}") == "72.00 ± 2.83"


def test_one_value_has_no_deviation(tables):
    """A single seed gives 0."""
    assert tables.spread([5], "{:.0f}") == "5 ± 0"


@pytest.mark.parametrize(
    ("values", "text"),
    [([0.69612], "0.696"), ([1284.4], "1284"), ([8.0, 8.2], "8.10 ± 0.14"), ([0.0], "0.000")],
)
def test_figures_have_three_digits(tables, values, text):
    """As many places as three digits of the mean need, and ± where there are several values."""
    assert tables.figure(values) == text


def test_removed_stands_beside_the_paper(tables, results):
    """The row of the genus has 60 points of the paper and 72 ± 3 of ours."""
    row = tables.removed(results).splitlines()[2]
    assert "| 832 | 30 | 60 | 72 ± 3 | 2.40% | 2.88% |" in row


def test_neighbours_are_counted(tables, results):
    """Only the nearest neighbour's density takes as many points as the paper."""
    rows = tables.neighbours(results).splitlines()
    assert "| rounded root of the cluster's size (default) | 72 ± 3 | 0 of 1 |" in rows
    assert "| k = 1 | 60 ± 0 | 1 of 1 |" in rows
    assert "| k = 2 | 61 ± 0 | 0 of 1 |" in rows


def test_summary_is_computed(module, results):
    """The first lines come from the figures: counts, maxima, their cut, the ratio to chance."""
    text = module("summary").summary(results)
    assert "**Reproduces:** the points removed, with the density of neighbour k = 1." in text
    assert "1 of the 1 rows" in text
    assert "Genus, 30 clusters: 60 ± 0 (60). With the default density, 0 of 1." in text
    assert "above 0.9 % on 1 of 1 models (the paper's on 1 of 1)" in text
    assert "Uncut, the maximum is 3.0 % of the diagonal" in text
    assert "smaller uncut mean error on 1 of 1 models; the rule's is 2 times as large" in text


def test_a_count_that_is_not_met_is_said(module, results):
    """With no neighbour near the paper's count the first line says so."""
    for run in results["genus"]["runs"]:
        run["neighbours"] = {None: {"genus": 70}}
    line = module("summary").summary(results).splitlines()[0]
    assert line.startswith("- **Does not reproduce:** the points removed, with the default density")
    assert "none; not Genus, 30 clusters: 70 ± 0 (60)" in line


def runs_of(*means, missed=0):
    """Return the runs of a method at one count."""
    return [{**figures(500, mean, 0.02), "missed": missed} for mean in means]


@pytest.fixture
def compared(results):
    """Add a comparison at two counts: adaptive wins clearly at the first, loses the second."""
    results["genus"]["shares"] = (0.5, 0.2)
    results["genus"]["compared"] = {
        "adaptive": [runs_of(1e-5, 1.2e-5), runs_of(8e-5, 8e-5)],
        "random": [runs_of(4e-5, 6e-5), runs_of(1e-4)],
        "lee2001": [runs_of(2e-5, missed=-3), runs_of(4e-5)],
        "cluster-entropy": [runs_of(5e-4), runs_of(1e-3, missed=2)],
    }
    return results


def test_comparison_gives_means_and_deviations(tables, compared):
    """Several seeds have ±, one has none; the least mean is bold, what was missed is there."""
    rows = tables.comparison(compared, "genus").splitlines()[4:]
    assert rows == [
        "| lee2001 | 2.00 | **4.00** | 2.00 | 2.00 | -3/0 |",
        "| adaptive | **1.10 ± 0.14** | 8.00 ± 0.00 | 2.00 | 2.00 | exact |",
        "| random | 5.00 ± 1.41 | 10.0 | 2.00 | 2.00 | exact |",
        "| cluster-entropy | 50.0 | 100 | 2.00 | 2.00 | 0/2 |",
    ]


def test_verdict_is_computed(module, compared):
    """Ratios 1.1 / 2 and 8 / 4 have a mean of 1.05; the rule is 10 times chance in both."""
    text = module("summary").verdict(compared)
    assert "`adaptive` has 1.05 times that of the best other method" in text
    assert "the best in 1 of 2, in 1 of them by more than two standard deviations" in text
    assert "it is not on: Genus at 20% (lee2001, 2.00 times)" in text
    assert "The paper's rule has 10 times that of random deletion, 10 times where most" in text


def test_errors_have_a_column_for_chance(tables, results):
    """Random deletion stands beside the paper's surface only."""
    assert "2.0e-04 ± 0.0e+00" in tables.errors(results, "paper")
    assert "random" not in tables.errors(results, "passes")


def test_readings_stand_beside_the_paper(tables):
    """The difference is that of the mean count to the paper's."""
    found = {"method": "shi2011", "reading": "as here", "kept": [9172, 9192]}
    text = tables.readings({"fandisk": {"readings": [found]}})
    assert "| shi2011 | as here | 9182 ± 14 | 9682 | -5.2% |" in text


@pytest.mark.parametrize(("method", "runs"), [("random", 2), ("lee2001", 1)])
def test_only_what_depends_on_the_seed_is_repeated(module, models_dir, method, runs):
    """Random deletion is measured for each seed, a grid once."""
    found = module("measurements").at_count("genus", str(models_dir), method, (600, 300), 2)
    assert [len(one) for one in found] == [runs, runs]
    assert all(abs(run["missed"]) <= 10 for one in found for run in one)


def test_neighbours_share_the_clustering(module, models_dir):
    """By default as many points go as the ranking says, and with k = 1 as in the paper."""
    run = module("measurements").paper_rule("genus", str(models_dir), 1)
    gone = 2496 - run["genus"]["paper"]["kept"]
    assert run["neighbours"][None]["genus"] == gone
    assert run["neighbours"][1]["genus"] == 60


@pytest.mark.slow
def test_smallest_model_from_end_to_end(models_dir, tmp_path, monkeypatch):
    """One model, two seeds and two methods give a document whose pictures exist and are small."""
    pytest.importorskip("matplotlib")
    monkeypatch.syspath_prepend(str(SCRIPTS))
    script = importlib.import_module("reproduce_paper")
    chosen = ["--model", "genus", "--seeds", "2", "--jobs", "1", "--out", str(tmp_path)]
    chosen += ["--models", str(models_dir), "--method", "random", "--method", "cluster-entropy"]
    assert script.main(chosen) == 0
    text = (tmp_path / "REPRODUCTION.md").read_text(encoding="utf-8")
    pictures = re.findall(r"\((images/[^)]*)\)", text)
    assert len(pictures) == 3
    for picture in pictures:
        assert 2_000 < (tmp_path / picture).stat().st_size < 300_000
    assert "Genus" in text
    assert sum(line.startswith("- **") for line in text.splitlines()[:10]) >= 4


def test_missing_models_are_one_sentence(tmp_path, monkeypatch, capsys):
    """A folder without the models ends with a sentence and an exit code."""
    pytest.importorskip("matplotlib")
    monkeypatch.syspath_prepend(str(SCRIPTS))
    script = importlib.import_module("reproduce_paper")
    code = script.main(["--model", "genus", "--models", str(tmp_path), "--out", str(tmp_path)])
    assert code == 4
    assert "genus3.off" in capsys.readouterr().err
