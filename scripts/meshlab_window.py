"""Drive MeshLab's window as a user does, and take the pictures of docs/in-meshlab.md.

Open an annotated cloud, open and apply bunny.mlx, change 60 to 30, apply again. Needs MeshLab
2020.09, Xvfb, xdotool and ImageMagick (.ci/debian-packages.txt)::

    python scripts/meshlab_window.py scan.ply docs/images
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from meshlab_filter.annotation import annotate_file
from meshlab_filter.presets import copy

SIZE = 1280, 800
# Where the menu is, the buttons of the script window (727 × 404) and those of the
# parameter window.
FILE, FILTERS = (36, 11), (121, 11)
OPEN_SCRIPT, APPLY_SCRIPT = (141, 377), (468, 377)
SECOND_FILTER, EDIT_PARAMETERS = (103, 37), (659, 116)
FIELD, OK = (236, 32), (136, 72)


class Window:
    """MeshLab's window on a screen of its own."""

    def __init__(self, display: str, log: Path) -> None:
        self.log = log
        self.environment = {
            **os.environ,
            "DISPLAY": display,
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "HOME": str(log.parent),
            "XDG_RUNTIME_DIR": str(log.parent),
        }

    def tool(self, *arguments: object) -> str:
        """Run xdotool."""
        command = ["xdotool", *map(str, arguments)]
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True)
        return done.stdout.strip()

    def wait(self, pattern: str, times: int = 1) -> None:
        """Wait until MeshLab's log says something that often."""
        deadline = time.monotonic() + 120
        while len(re.findall(pattern, self.log.read_text(errors="replace"))) < times:
            if time.monotonic() > deadline:
                raise TimeoutError(f"MeshLab did not say {pattern!r}:\n{self.log.read_text()}")
            time.sleep(0.2)
        time.sleep(1.5)

    def window(self, name: str, *, besides: str = "") -> str:
        """Wait for a window of this name and return its number."""
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            for found in self.tool("search", "--onlyvisible", "--name", name).split():
                if found != besides:
                    time.sleep(0.7)
                    return found
            time.sleep(0.2)
        raise TimeoutError(f"No window {name!r}.")

    def click(self, window: str, place: tuple[int, int]) -> None:
        """Click somewhere in a window."""
        self.tool("mousemove", "--window", window, *place, "click", 1)
        time.sleep(0.7)

    def type(self, text: str) -> None:
        """Type text."""
        self.tool("type", "--delay", 20, text)
        time.sleep(0.3)

    def key(self, *keys: str) -> None:
        """Press keys."""
        for key in keys:
            self.tool("key", key)
            time.sleep(0.5)

    def picture(self, path: Path) -> None:
        """Take a picture of the screen, with few enough colours to be small."""
        command = ["import", "-window", "root", "-colors", "200", "-strip", f"png8:{path}"]
        subprocess.run(command, check=True, env=self.environment)


@contextmanager
def meshlab(cloud: Path, folder: Path) -> Iterator[Window]:
    """Start MeshLab with a cloud on a screen of its own."""
    read, write = os.pipe()
    screen = f"{SIZE[0]}x{SIZE[1]}x24"
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", screen, "-nolisten", "tcp"],
        pass_fds=(write,),
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    with os.fdopen(read) as pipe:
        display = f":{pipe.readline().strip()}"
    log = folder / "meshlab.log"
    window = Window(display, log)
    try:
        with open(log, "wb") as output:
            program = subprocess.Popen(
                ["meshlab", str(cloud)],
                env=window.environment,
                stdout=output,
                stderr=subprocess.STDOUT,
            )
        try:
            window.wait("All files opened")
            main = window.window("MeshLab 2020")
            window.tool("windowmove", main, 0, 0, "windowsize", main, *SIZE)
            window.tool("windowfocus", main)
            time.sleep(1)
            yield window
        finally:
            program.terminate()
            program.wait()
    finally:
        server.terminate()
        server.wait()


def open_script(window: Window, script: Path) -> str:
    """Open a filter script; return the script window."""
    # Filters > Show current filter script, the first entry that can be chosen.
    window.click(window.window("MeshLab 2020"), FILTERS)
    window.key("Down", "Return")
    dialog = window.window("^Dialog$")
    window.click(dialog, OPEN_SCRIPT)
    window.type(str(script))
    window.key("Return")
    time.sleep(1)
    return dialog


def tour(scan: Path, pictures: Path) -> str:
    """Go through docs/in-meshlab.md, take its pictures and return MeshLab's log."""
    with tempfile.TemporaryDirectory(prefix="in-meshlab-") as name:
        folder = Path(name)
        cloud = folder / "annotated.ply"
        annotate_file(scan, cloud, preset="bunny", color=True)
        (script,) = copy(["bunny"], folder)
        with meshlab(cloud, folder) as window:
            window.picture(pictures / "meshlab-annotated.png")
            dialog = open_script(window, script)
            window.picture(pictures / "meshlab-script.png")
            window.click(dialog, APPLY_SCRIPT)
            window.wait("Re-Applied filter Hausdorff")
            window.picture(pictures / "meshlab-60.png")

            # Without a window manager, only a click gives the main window the keyboard back.
            window.click(window.window("MeshLab 2020"), FILE)
            window.key("Escape", "ctrl+n")
            time.sleep(1)
            window.key("ctrl+i")
            time.sleep(1.5)
            window.type(str(cloud))
            window.key("Return")
            window.wait("All files opened", times=2)
            dialog = open_script(window, script)
            window.click(dialog, SECOND_FILTER)
            window.click(dialog, EDIT_PARAMETERS)
            editor = window.window("^Edit|^Dialog|Select|Condition", besides=dialog)
            window.click(editor, FIELD)
            window.key("ctrl+a")
            window.type("(q < 30)")
            window.picture(pictures / "meshlab-edit.png")
            window.click(editor, OK)
            window.click(dialog, APPLY_SCRIPT)
            window.wait("Re-Applied filter Hausdorff", times=2)
            window.picture(pictures / "meshlab-30.png")
            return window.log.read_text(errors="replace")


if __name__ == "__main__":
    target = Path(sys.argv[2])
    target.mkdir(parents=True, exist_ok=True)
    print(tour(Path(sys.argv[1]), target))
