"""Outputs that cannot be written: a sentence, and what was there stays as it was."""

import os
import subprocess
from contextlib import contextmanager

import numpy as np
import pytest
from command import check_refused, command, environment, meshlab_filter, snapshot

from meshlab_filter.errors import OutputError
from meshlab_filter.outputs import writing, writing_folder


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder with a scan of 300 points, which is the current one."""
    np.savetxt(tmp_path / "scan.xyz", np.random.default_rng(0).random((300, 3)))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@contextmanager
def small_disk(path, *, size="64k", options=""):
    """Mount a file system of that size, or skip where this user may not."""
    path.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}{options}", "tmpfs", str(path)]
    if os.name != "posix" or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("needs to mount a file system")
    try:
        yield path
    finally:
        subprocess.run(["umount", "--lazy", str(path)], check=True)


SIMPLIFY = ["simplify", "scan.xyz", "--count", "100"]
RUN = ["run", "scan.xyz", "--count", "100", "--surface", "none"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([*SIMPLIFY, "missing/thin.ply"], "folder does not exist"),
        ([*SIMPLIFY, "scan.xyz/thin.ply"], "folder does not exist"),
        ([*SIMPLIFY, "taken.ply"], "is a folder"),
        ([*SIMPLIFY, "thin.foo"], "Unknown output extension"),
        ([*SIMPLIFY, "thin"], "Unknown output extension"),
        ([*SIMPLIFY, "scan.xyz"], "The output is the input"),
        ([*SIMPLIFY, "link.xyz"], "The output is the input"),
        ([*SIMPLIFY, "hard.xyz"], "The output is the input"),
        ([*RUN, "--out", "scan.xyz"], "is a file"),
        ([*RUN, "--out", "scan.xyz/result"], "Not a directory"),
        (["run", "old/simplified.ply", "--count", "4", "--out", "old"], "would replace the input"),
    ],
    ids=lambda value: value[-1] if isinstance(value, list) else "",
)
def test_refused(folder, capsys, arguments, message):
    """No folder, a folder in the way, an unknown format, the input itself."""
    (folder / "taken.ply").mkdir()
    (folder / "link.xyz").symlink_to("scan.xyz")
    os.link("scan.xyz", "hard.xyz")
    (folder / "old").mkdir()
    (folder / "old" / "simplified.ply").write_bytes((folder / "scan.xyz").read_bytes())
    check_refused(folder, *arguments, message=message, code=7, capsys=capsys)


def test_overwrite_replaces_the_input_on_request(folder):
    """--overwrite thins a file in its place."""
    done = meshlab_filter(*SIMPLIFY, "scan.xyz", "--overwrite", folder=folder)
    assert done.returncode == 0, done.stderr
    assert len((folder / "scan.xyz").read_bytes().splitlines()) == 100


def test_a_link_to_the_output_stays_a_link(folder):
    """What the link leads to is written."""
    (folder / "far").mkdir()
    (folder / "thin.xyz").symlink_to("far/thin.xyz")
    with writing("thin.xyz") as partial:
        partial.write_text("1 2 3\n")
    assert (folder / "thin.xyz").is_symlink()
    assert (folder / "far" / "thin.xyz").read_text() == "1 2 3\n"


@pytest.mark.parametrize("arguments", [[*SIMPLIFY, "disk/thin.ply"], [*RUN, "--out", "disk/new"]])
def test_disk_that_may_not_be_written(folder, arguments):
    """A read-only file system."""
    with small_disk(folder / "disk", options=",ro"):
        check_refused(folder, *arguments, message="Read-only file system", code=7)


def test_full_disk(folder):
    """What does not fit is not there at all; what was there before stays; a rerun succeeds."""
    points = np.random.default_rng(1).random((3000, 3))
    np.savetxt(folder / "large.xyz", points)
    with small_disk(folder / "disk") as disk:
        (disk / "thin.xyz").write_text("as it was\n")
        for arguments in (
            ["simplify", "large.xyz", "disk/thin.xyz", "--count", "2500"],
            ["run", "large.xyz", "--out", "disk", "--count", "2500", "--surface", "none"],
            ["run", "large.xyz", "--out", "disk/new", "--count", "2500", "--surface", "none"],
        ):
            check_refused(folder, *arguments, message="No space left on device", code=7)
        done = meshlab_filter(
            "simplify", "large.xyz", "disk/thin.xyz", "--count", "100", folder=folder
        )
        assert done.returncode == 0, done.stderr
        assert len((disk / "thin.xyz").read_bytes().splitlines()) == 100


@pytest.mark.parametrize("arguments", [["--help"], ["methods"], [*SIMPLIFY, "thin.ply"]])
def test_standard_output_that_fails(folder, arguments):
    """A reader that has gone ends the command quietly; a full disk behind it in a sentence."""
    reader, writer = os.pipe()
    os.close(reader)
    gone = subprocess.run(
        command(*arguments), stdout=writer, stderr=subprocess.PIPE, env=environment(), text=True
    )
    os.close(writer)
    assert (gone.returncode, gone.stderr) == (141, "")
    if os.path.exists("/dev/full"):
        with open("/dev/full", "w") as full:
            done = subprocess.run(
                command(*arguments), stdout=full, stderr=subprocess.PIPE, env=environment(),
                text=True,
            )  # fmt: skip
        assert (done.returncode, done.stderr) == (7, "Error: No space left on device.\n")


@pytest.mark.skipif(os.name != "posix", reason="closes streams as a POSIX shell does")
@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_closed_streams(folder, closed):
    """Standard streams that came closed do not matter, and no output file takes their number."""
    line = " ".join([*command(*SIMPLIFY, "thin.xyz"), closed])
    done = subprocess.run(["sh", "-c", line], env=environment(), capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert len((folder / "thin.xyz").read_bytes().splitlines()) == 100


def test_an_error_on_the_way_leaves_the_old_file(tmp_path):
    """Whatever ends the writing, the file of that name is the old one or the new one."""
    (tmp_path / "a.txt").write_text("old")
    with pytest.raises(ZeroDivisionError), writing(tmp_path / "a.txt") as partial:  # noqa: PT012
        partial.write_text("ne")
        raise ZeroDivisionError
    with pytest.raises(ZeroDivisionError), writing_folder(tmp_path / "b" / "c") as staging:  # noqa: PT012
        (staging / "d.txt").write_text("ne")
        raise ZeroDivisionError
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "old"


def test_a_folder_in_the_place_of_one_output_stops_all(tmp_path):
    """No file of a result is replaced if one cannot be."""
    (tmp_path / "z.txt").mkdir()
    (tmp_path / "a.txt").write_text("old")
    with (  # noqa: PT012
        pytest.raises(OutputError, match="An output is a folder"),
        writing_folder(tmp_path) as staging,
    ):
        (staging / "a.txt").write_text("new")
        (staging / "z.txt").write_text("new")
    assert (tmp_path / "a.txt").read_text() == "old"


@pytest.mark.skipif(os.name != "posix", reason="locks are of POSIX systems")
def test_only_what_nobody_writes_any_more_is_cleared_away(tmp_path):
    """Leftovers of a killed process go with the next run; a file in the making stays."""
    (tmp_path / ".a.0123abcd.partial.txt").write_text("left over")
    (tmp_path / ".b.0123abcd.partial.txt").write_text("of another file")
    (tmp_path / ".a.notes.partial.txt").write_text("not ours")
    (tmp_path / ".0123abcd.partial").mkdir()
    with writing(tmp_path / "a.txt") as first, writing(tmp_path / "a.txt") as second:
        assert first.exists()
        assert second.exists()
        second.write_text("2")
    with writing_folder(tmp_path) as one, writing_folder(tmp_path) as two:
        assert one.exists()
        assert two.exists()
    assert {str(path) for path in snapshot(tmp_path)} == {
        "a.txt", ".b.0123abcd.partial.txt", ".a.notes.partial.txt",
    }  # fmt: skip
