"""docs/METHODS.md against the registry."""

import re
from pathlib import Path

import pytest

from meshlab_filter.methods.registry import METHODS

TEXT = (Path(__file__).parents[1] / "docs" / "METHODS.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", METHODS)
def test_row_says_what_the_registry_says(name):
    """Each method's row of the table is that of the registry."""
    method = METHODS[name]
    row = next(line for line in TEXT.splitlines() if line.startswith(f"| `{name}` |"))
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[1:] == [
        method.keeps,
        "yes" if method.exact_count else "–",
        "yes" if method.total_order else "–",
        "used" if method.uses_normals else "–",
        "yes" if method.seeded else "no",
    ]


@pytest.mark.parametrize("name", METHODS)
def test_every_source_is_cited(name):
    """Each identifier of a publication in the registry stands in the document, too."""
    for identifier in re.findall(r"doi:[^\s;]+", METHODS[name].source):
        assert identifier in TEXT
