"""Simplify a LAS file larger than memory: tiles on disk, ranked by Dask, one output.

Dask runs, restarts and counts the tasks; nothing here does. Tasks are given paths and write files,
so the scheduler never holds a point, and what a lost worker had begun is simply done again.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from . import tiletasks
from .cloud import check_readable, check_writable
from .errors import (
    FileFormatError,
    InvalidCloudError,
    InvalidParameterError,
    MeshlabFilterError,
    OutputError,
)
from .lasfile import import_laspy, las_errors, not_copc, provenance_header
from .outputs import writing
from .provenance import comments, versions
from .scheduling import connect
from .tilejob import Progress, TileJob
from .tiles import stream

_SUFFIXES = (".las", ".laz")


def simplify_tiles(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    *,
    method: str | None = None,
    tiles: int | str = "auto",
    scheduler: Any = None,
    workers: int | None = None,
    count: int | None = None,
    keep: float | None = None,
    seed: int = 0,
    overwrite: bool = False,
    progress: Progress | None = None,
    announce: Callable[[str], object] | None = None,
    **parameters: Any,
) -> dict[str, Any]:
    """Simplify a LAS or LAZ file tile by tile; memory depends on the tile, not on the file.

    Parameters
    ----------
    source : path-like
        A .las, .laz or .copc.laz file.
    target : path-like
        A .las or .laz file; survivors keep the order of the source, every dimension and the bits
        of their coordinates.
    method : {"cluster-entropy", "adaptive"}, optional
        By default "adaptive" when a count or a share is asked for, else "cluster-entropy".
    tiles : int or "auto"
        How many tiles; "auto" takes a million points for each. The result depends on it.
    scheduler : {"threads", "processes"}, address or distributed.Client, optional
        Who runs the tasks: threads of this process (default), processes on this machine, or a
        Dask scheduler such as ``tcp://host:8786`` whose workers see the target's folder under
        the same path. The result does not depend on it.
    workers : int, optional
        Threads or processes to use; as many as cores by default. The result does not depend on
        it.
    count, keep, seed
        As for :func:`meshlab_filter.simplify`.
    overwrite : bool
        Allow replacing the source.
    progress : callable, optional
        Called with the name of a stage and the share of it that is done.
    announce : callable, optional
        Called once with the address of Dask's dashboard.
    **parameters
        The method's own.

    Returns
    -------
    dict
        ``input``, ``points`` (original, simplified), ``tiles``, ``clusters`` (total, deleted) for
        "cluster-entropy", ``missed``, ``parameters`` and ``versions``.

    Raises
    ------
    FileFormatError
        If the source is not a whole LAS file.
    InvalidParameterError
        If a parameter is out of range or Dask is not installed.
    OutputError
        If the target or the tiles cannot be written.
    SchedulerError
        If the scheduler cannot be reached or goes away, or workers keep dying.

    Notes
    -----
    Tiles are kept in a hidden folder beside the target until all is done. A run that was stopped
    goes on where it was when it is started again with the same source and parameters.

    "cluster-entropy" clusters each tile by itself and ranks the clusters of all tiles together,
    ties by tile and number. "adaptive" shares the count out between tiles by what it keeps of a
    sample of the whole cloud, and ranks each tile with a halo of its surroundings, of which only
    the tile's own points count.

    The clusters and their entropy are those of A. Mahdaoui and E. H. Sbai, "3D Point Cloud
    Simplification Based on k-Nearest Neighbor and Clustering", Advances in Multimedia 2020,
    8825205, Algorithm 1, within each tile.

    Examples
    --------
    >>> import tempfile
    >>> from meshlab_filter import read_cloud
    >>> from meshlab_filter.cloud import Cloud, write_cloud
    >>> points = np.random.default_rng(0).random((400, 3))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_cloud(Cloud(points=points), f"{folder}/scan.las")
    ...     report = simplify_tiles(
    ...         f"{folder}/scan.las", f"{folder}/thin.las", tiles=2, clusters=20, delete=4
    ...     )
    ...     kept = read_cloud(f"{folder}/thin.las").points
    >>> report["clusters"], len(kept) == report["points"]["simplified"]
    ({'total': 20, 'deleted': 4}, True)
    """
    source, target = check_readable(source), check_writable(target)
    for path in (source, target):
        if path.suffix.lower() not in _SUFFIXES:
            raise InvalidParameterError(
                f"Invalid file for tiles. Must be .las or .laz. Given: {path}."
            )
    if target.exists() and target.samefile(source) and not overwrite:
        raise OutputError(
            f"The output is the input; choose another name or pass --overwrite. Given: {target}."
        )
    job = TileJob.of(source, method, tiles, count, keep, seed, parameters)
    tell = progress or (lambda stage, share: None)
    folder = target.parent / f".{target.name}.tiles-{job.key}"
    with connect(scheduler, workers, announce or (lambda address: None)) as client:
        try:
            folder.mkdir(exist_ok=True)
            plan = job.cut(folder, tell)
            outcome = job.rank(client, folder, plan, tell)
            report = {
                "input": job.input,
                "points": {"original": job.size, "simplified": outcome.pop("kept")},
                "tiles": len(plan),
                **outcome,
                "parameters": job.parameters,
                "versions": versions(),
            }
            _write(source, target, folder, len(plan), report, tell)
        except (InvalidParameterError, InvalidCloudError, FileFormatError):
            # Going on from these tiles would end the same way.
            _discard(folder)
            raise
        except MeshlabFilterError:
            raise
        except OSError as error:
            raise OutputError(
                f"Cannot write the tiles: {error.strerror or error}. Given: {folder}."
            ) from error
        _discard(folder)
    return report


def _discard(folder: Path) -> None:
    """Remove the tiles, even while a task that nobody waits for is still at work on one."""
    gone = folder.with_name(f"{folder.name}.gone")
    # Under another name no task finds the folder any more to put a file into it.
    folder.replace(gone)
    shutil.rmtree(gone, ignore_errors=True)


def _write(
    source: Path, target: Path, folder: Path, tiles: int, report: dict[str, Any], tell: Progress
) -> None:
    """Stream the source once more and write the points that stay, in their order."""
    size, expected = report["points"]["original"], report["points"]["simplified"]
    stays = np.zeros(size, dtype=bool)
    for number in range(tiles):
        path = tiletasks.result_path(folder, number, "kept")
        if path.exists():
            stays[tiletasks.load(path)] = True
    if int(stays.sum()) != expected:
        raise FileFormatError(
            f"The tiles do not fit together: {expected} points stay and {int(stays.sum())} are "
            f"found; run again to make them anew. Given: {folder}."
        )
    laspy = import_laspy()
    with writing(target) as partial:
        with las_errors(source), laspy.open(str(source)) as reader:
            header = provenance_header(reader.header, comments(report))
            evlrs = not_copc(reader.evlrs or ())
        compress = target.suffix.lower() == ".laz"
        with laspy.open(str(partial), mode="w", header=header, do_compress=compress) as writer:
            for begin, points in stream(source):
                writer.write_points(points[stays[begin : begin + len(points)]])
                tell("writing", (begin + len(points)) / size)
            if evlrs:
                writer.write_evlrs(laspy.vlrs.vlrlist.VLRList(evlrs))
