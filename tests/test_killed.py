"""Ended at any moment: no half of an output under its name, and a rerun succeeds."""

import os
import signal
import subprocess
import time

import numpy as np
import pytest
from command import command, environment, meshlab_filter, snapshot

from meshlab_filter.cli import main

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(os.name != "posix", reason="signals are of POSIX systems"),
]

COMMANDS = {
    "simplify": ["simplify", "scan.ply", "thin.ply", "--count", "2000"],
    "run": ["run", "scan.ply", "--out", "result", "--keep", "20%"],
}


@pytest.fixture(scope="module")
def scan():
    """Return the bytes of a scan that keeps the commands busy for a second or more."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(12_000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    header = "ply\nformat binary_little_endian 1.0\nelement vertex 12000\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz") + "end_header\n"
    return header.encode() + points.tobytes()


@pytest.fixture(scope="module")
def undisturbed(scan, tmp_path_factory):
    """Return, for each command, what it writes when nothing disturbs it, and its seconds."""
    expected = {}
    for verb, arguments in COMMANDS.items():
        folder = tmp_path_factory.mktemp(verb)
        (folder / "scan.ply").write_bytes(scan)
        begun = time.monotonic()
        done = meshlab_filter(*arguments, folder=folder)
        assert done.returncode == 0, done.stderr
        expected[verb] = whole_outputs(folder), time.monotonic() - begun
    return expected


def whole_outputs(folder):
    """Return the outputs that must be the same every time, and the names of those with times."""
    return {
        path: content if path.suffix not in (".json", ".html") else None
        for path, content in snapshot(folder).items()
        if ".partial" not in str(path)
    }


def child_of(process):
    """Return the process that does the work, as soon as there is one."""
    path = f"/proc/{process.pid}/task/{process.pid}/children"
    while process.poll() is None:
        with open(path) as file:
            children = file.read().split()
        if children:
            return int(children[0])
        time.sleep(0.002)
    return None


def alive(pid):
    """Tell whether a process still does anything."""
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rsplit(")", 1)[1].split()[0] not in "ZX"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize("round_", range(2))
@pytest.mark.parametrize("receiver", ["parent", "child", "group"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
@pytest.mark.parametrize("verb", COMMANDS)
def test_killed(tmp_path, scan, undisturbed, verb, number, receiver, round_):
    """Every file under a final name is whole; what was read is as it was; a rerun succeeds."""
    expected, seconds = undisturbed[verb]
    (tmp_path / "scan.ply").write_bytes(scan)
    delay = np.random.default_rng([round_, number, len(receiver), len(verb)]).uniform(0, seconds)
    process = subprocess.Popen(
        command(*COMMANDS[verb]), cwd=tmp_path, env=environment(), start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    child = child_of(process)
    time.sleep(delay)
    if receiver == "parent":
        process.send_signal(number)
    elif receiver == "child" and child is not None and alive(child):
        os.kill(child, number)
    elif receiver == "group" and process.poll() is None:
        os.killpg(process.pid, number)
    _, said = process.communicate(timeout=60)
    # An orphan notices that it is one, and ends.
    deadline = time.monotonic() + 30
    while child is not None and alive(child) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert child is None or not alive(child)

    assert "Traceback" not in said
    assert process.returncode in (0, 6, 130, 128 + number, -number), said
    found = whole_outputs(tmp_path)
    for path, content in found.items():
        assert content == expected[path], f"{path} is not whole"
    if number != signal.SIGKILL or receiver == "child":
        assert not [path for path in snapshot(tmp_path) if ".partial" in str(path)]
    again = meshlab_filter(*COMMANDS[verb], folder=tmp_path)
    assert again.returncode == 0, again.stderr
    assert whole_outputs(tmp_path) == expected
    assert not [path for path in snapshot(tmp_path) if ".partial" in str(path)]


@pytest.mark.parametrize("kind", [RuntimeError, AssertionError])
def test_an_interrupt_that_ends_in_another_error(monkeypatch, capsys, kind):
    """What fails in the midst of an interrupt is the interrupt; the same failure alone is not."""

    def join(**_):
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt:
            raise kind("release unlocked lock")  # noqa: B904 (as Thread.join does)

    monkeypatch.setattr(main.cli, "main", join)
    assert main.invoke(["simplify"]) == 130
    assert capsys.readouterr().err == "Interrupted; nothing was left half-written.\n"

    def fail(**_):
        raise kind("of its own")

    monkeypatch.setattr(main.cli, "main", fail)
    with pytest.raises(kind, match="of its own"):
        main.invoke(["simplify"])
