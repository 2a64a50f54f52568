"""MeshLab's window, driven as a user does."""

import re
import shutil
import sys
from pathlib import Path

import pytest

from meshlab_filter.annotation import annotate_file
from meshlab_filter.bridge.samples import sample_mesh
from meshlab_filter.presets import PRESETS
from meshlab_filter.steps import cut_of, record

NEEDED = ("meshlab", "Xvfb", "xdotool", "import")


@pytest.mark.slow
@pytest.mark.skipif(
    not all(map(shutil.which, NEEDED)),
    reason=f"needs {', '.join(NEEDED)} (.ci/debian-packages.txt)",
)
def test_apply_edit_and_apply_again(tmp_path):
    """The window deletes what ranks below 60, and after the edit what ranks below 30."""
    sys.path.insert(0, str(Path(__file__).parents[1] / "scripts"))
    try:
        import meshlab_window
    finally:
        sys.path.pop(0)
    scan = sample_mesh("bunny.obj")
    log = meshlab_window.tour(scan, tmp_path)
    expected = []
    for cut in (60, 30):
        script = record(PRESETS["bunny"].recipe, threshold=cut)
        assert cut_of(script) == cut
        done = annotate_file(scan, tmp_path / f"{cut}.ply", preset=script)
        expected.append(str(done.points - done.left))
    assert re.findall(r"Deleted (\d+) vertices", log) == expected
    assert len(re.findall(r"Hausdorff Distance computed", log)) == 2
    pictures = sorted(tmp_path.glob("*.png"))
    assert len(pictures) == 5
    assert all(10_000 < picture.stat().st_size < 300_000 for picture in pictures)
