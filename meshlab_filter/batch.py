"""Many files, each in a process of its own: a bad one does not stop the rest."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .errors import OutputError
from .supervisor import FOLDER_VARIABLE


@dataclass(frozen=True, kw_only=True)
class BatchRow:
    """What became of one file.

    Attributes
    ----------
    source, out : Path
    code : int
        0, or the exit code of ``meshlab-filter run`` for this file alone.
    message : str
        What it said, if it failed.
    report : dict or None
        What report.json holds, if it did not.
    """

    source: Path
    out: Path
    code: int
    message: str
    report: dict[str, Any] | None


def run_batch(
    sources: Sequence[Path],
    out: Path,
    arguments: Sequence[str],
    *,
    jobs: int = 1,
    progress: Callable[[str, float | None], object] | None = None,
) -> list[BatchRow]:
    """Run ``meshlab-filter run`` on every file.

    Parameters
    ----------
    sources : sequence of Path
    out : Path
        Each file gets a folder in it, of the file's name without extension.
    arguments : sequence of str
        The other options, as on the command line.
    jobs : int
        How many at a time.
    progress : callable, optional
        Called with the file just done and the share of files done.

    Returns
    -------
    list of BatchRow
        In the order of the files.

    Raises
    ------
    OutputError
        If two files would write to the same folder.
    """
    tell = progress or (lambda stage, share: None)
    folders: dict[Path, Path] = {}
    for source in sources:
        folder = out / source.stem
        if folder in folders:
            raise OutputError(
                f"Two files would write to {folder}; run them apart. "
                f"Given: {folders[folder]} and {source}."
            )
        folders[folder] = source
    running: set[subprocess.Popen[str]] = set()
    lock = threading.Lock()
    stopped = threading.Event()

    def work(folder: Path, source: Path) -> BatchRow:
        # Without the variable the process supervises itself, and a crash of MeshLab is its own.
        environment = {k: v for k, v in os.environ.items() if k != FOLDER_VARIABLE}
        command = [sys.executable, "-m", "meshlab_filter", "run", str(source), "--out", str(folder)]
        with lock:
            if stopped.is_set():
                raise KeyboardInterrupt
            child = subprocess.Popen(
                [*command, *arguments, "--quiet"],
                env=environment,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
            )
            running.add(child)
        _, said = child.communicate()
        with lock:
            running.discard(child)
        lines = [line for line in said.splitlines() if line.strip()]
        report = None
        if child.returncode == 0:
            report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        return BatchRow(
            source=source,
            out=folder,
            code=child.returncode,
            message="" if report else " ".join(lines[-1:]).removeprefix("Error: "),
            report=report,
        )

    rows: dict[Path, BatchRow] = {}
    with ThreadPoolExecutor(max_workers=jobs) as pool:
        futures = [pool.submit(work, folder, source) for folder, source in folders.items()]
        try:
            for future in futures:
                row = future.result()
                rows[row.source] = row
                tell(f"{row.source.name} ({len(rows)} of {len(sources)})", len(rows) / len(sources))
        except KeyboardInterrupt:
            with lock:
                stopped.set()
                for child in running:
                    child.terminate()
            raise
    return [rows[source] for source in folders.values()]
