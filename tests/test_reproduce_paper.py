"""The script that reproduces the paper: its tables, and the whole on the smallest model."""

import importlib
import re
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[1] / "scripts"


@pytest.fixture
def document(monkeypatch):
    """Import the module that writes the tables."""
    monkeypatch.syspath_prepend(str(SCRIPTS))
    return importlib.import_module("reproduction.document")


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
            }
        }
        for gone in (70, 74)
    ]
    floor = {
        "paper": figures(2496, 1e-5, 0.002),
        "passes": figures(2496, 1e-6, 0.001),
        "points": 2496,
    }
    return {"genus": {"floor": floor, "runs": runs}}


def test_spread_is_mean_and_deviation(document):
    """Two values have a standard deviation of their distance over √2."""
    assert document.spread([70, 74], "{:.2f}") == "72.00 ± 2.83"


def test_one_value_has_no_deviation(document):
    """A single seed gives 0."""
    assert document.spread([5], "{:.0f}") == "5 ± 0"


def test_removed_stands_beside_the_paper(document, results):
    """The row of the genus has 60 points of the paper and 72 ± 3 of ours."""
    row = document.removed(results).splitlines()[2]
    assert "| 832 | 30 | 60 | 72 ± 3 | 2.40% | 2.88% |" in row


def test_summary_is_computed(document, results):
    """The first lines come from the figures: maxima, their cut, and the ratio to chance."""
    text = document.summary(results)
    assert "above 0.9 % on 1 of 1 models" in text
    assert "Uncut, the maximum is 3.0 to 3.0 % of the diagonal" in text
    assert "smaller uncut mean error on 1 of 1 models; the rule's is 2 to 2 times as large" in text


def test_errors_have_a_column_for_chance(document, results):
    """Random deletion stands beside the paper's surface only."""
    assert "2.0e-04 ± 0.0e+00" in document.errors(results, "paper")
    assert "random" not in document.errors(results, "passes")


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
