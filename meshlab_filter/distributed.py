"""Simplify a LAS file larger than memory: tiles on disk, ranked by Dask, one output.

Dask runs, restarts and counts the tasks; nothing here does. Tasks are given paths and write files,
so the scheduler never holds a point, and what a lost worker had begun is simply done again.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from . import tiletasks
from ._version import __version__
from .amounts import points_to_keep
from .cloud import check_readable, check_writable
from .errors import (
    FileFormatError,
    InvalidCloudError,
    InvalidParameterError,
    MeshlabFilterError,
    OutputError,
)
from .lasfile import import_laspy, las_errors, not_copc, provenance_header
from .methods.cluster_entropy import how_many_to_delete, target_of
from .methods.registry import Method, get_method
from .outputs import writing
from .provenance import comments, fingerprint, versions
from .quality import median_spacing
from .scheduling import connect, lost_scheduler, run_tasks
from .simplification import CLUSTER_METHOD, COUNT_METHOD, DEFAULT_DELETE
from .tiles import (
    PLAN,
    RECORD,
    draw_sample,
    median_cuts,
    partition,
    share_out,
    stream,
)
from .validation import FloatArray, IntArray, check_integer

#: Called with the name of a stage and the share of it done.
Progress = Callable[[str, "float | None"], object]

# A tile of this size takes some 300 MB to rank, 450 MB by the adaptive method with its halo.
_TILE_POINTS = 1_000_000
# Points the cuts are made from, and from which the adaptive method's budget is shared out.
_SAMPLE = 200_000
# Width of the halo, in spacings of the points that stay: what a point's own fate depends on.
_HALO = 4.0
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
    job = _Job.of(source, method, tiles, count, keep, seed, parameters)
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


def _try(method: Method, parameters: dict[str, Any]) -> None:
    """Rank a few points, so that a value out of range is refused before tiles are cut."""
    trial = {name: value for name, value in parameters.items() if name != "delete"}
    if "clusters" in trial:
        trial |= {"clusters": 2, "delete": 1}
    method.load()(np.random.default_rng(0).random((40, 3)), **trial)


class _Job:
    """What is to be done with a file, and the key under which it can be gone on with."""

    def __init__(
        self, source: Path, size: int, scales: FloatArray, tiles: int, asked: int | None,
        parameters: dict[str, Any],
    ) -> None:  # fmt: skip
        self.source, self.size, self.scales = source, size, scales
        self.tiles, self.asked, self.parameters = tiles, asked, parameters
        self.input = fingerprint(source)
        said = [__version__, self.input["sha256"], tiles, asked, parameters]
        self.key = hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()[:16]

    @classmethod
    def of(
        cls, source: Path, method: str | None, tiles: int | str, count: int | None,
        keep: float | None, seed: int, given: dict[str, Any],
    ) -> _Job:  # fmt: skip
        """Check everything that can be checked before the first tile."""
        with las_errors(source), import_laspy().open(str(source)) as reader:
            size, scales = int(reader.header.point_count), np.asarray(reader.header.scales)
        if size == 0:
            raise InvalidCloudError(f"The file has no points. Given: {source}.")
        asked = points_to_keep(size, count=count, keep=keep)
        given = {name: value for name, value in given.items() if value is not None}
        if method is None:
            by_cluster = {"clusters", "delete", "keep_representative"} & given.keys()
            method = COUNT_METHOD if asked is not None and not by_cluster else CLUSTER_METHOD
        if method not in (CLUSTER_METHOD, COUNT_METHOD):
            raise InvalidParameterError(
                f"Invalid method for tiles. Must be {CLUSTER_METHOD} or {COUNT_METHOD}. "
                f"Given: {method!r}."
            )
        known = get_method(method)
        known.check_parameters(given)
        parameters = {parameter.name: parameter.default for parameter in known.parameters} | given
        if method == CLUSTER_METHOD:
            if asked is None and parameters["delete"] is None:
                parameters["delete"] = DEFAULT_DELETE
            clusters = parameters["clusters"] or max(1, round(0.05 * size))
            parameters["clusters"] = check_integer(
                clusters, name="clusters", minimum=1, maximum=size
            )
            target_of(size, clusters, delete=parameters["delete"], count=asked)
        elif asked is None:
            raise InvalidParameterError(
                "Invalid target. Method adaptive needs the number or share of points to keep. "
                "Given: neither count nor keep."
            )
        _try(known, parameters)
        seed = check_integer(seed, name="seed", minimum=0)
        if tiles == "auto":
            tiles = -(-size // _TILE_POINTS)
        tiles = check_integer(tiles, name="tiles", minimum=1, maximum=size)
        return cls(source, size, scales, tiles, asked, {
            "method": method, "tiles": tiles, "count": asked, "seed": seed, **parameters,
        })  # fmt: skip

    def cut(self, folder: Path, tell: Progress) -> list[dict[str, int]]:
        """Cut the source into tiles, unless that is done."""
        if (folder / PLAN).exists():
            plan: list[dict[str, int]] = json.loads((folder / PLAN).read_text("utf-8"))["tiles"]
            return plan
        need = int(1.3 * self.size * RECORD.itemsize)
        free = shutil.disk_usage(folder).free
        if free < need:
            raise OutputError(
                f"Too little disk space for the tiles: {need >> 20} MB are needed and "
                f"{free >> 20} MB free. Given: {folder}."
            )
        tell("sampling", None)
        sample = draw_sample(self.source, size=_SAMPLE, seed=self.parameters["seed"])
        with writing(folder / "sample.npy") as partial:
            np.save(partial, sample)
        cuts = median_cuts(sample, self.scales, self.tiles)
        halo = np.zeros(3, dtype=np.int64)
        if self.asked is not None and self.parameters["method"] == COUNT_METHOD:
            # Spacing grows with the root of the share that is left, on a surface.
            spacing = median_spacing(sample * self.scales) if len(sample) > 6 else 0.0
            width = _HALO * spacing * np.sqrt(len(sample) / self.asked)
            halo = np.ceil(width / self.scales).astype(np.int64)
        return partition(
            self.source, folder, cuts, halo=halo, progress=lambda done: tell("cutting", done)
        )

    def rank(
        self, client: Any, folder: Path, plan: list[dict[str, int]], tell: Progress
    ) -> dict[str, Any]:
        """Find out which points stay; each tile's are in a file of its own afterwards."""
        own = np.array([tile["own"] for tile in plan])
        if self.parameters["method"] == CLUSTER_METHOD:
            return self._rank_clusters(client, folder, own, tell)
        return self._rank_adaptive(client, folder, own, tell)

    def _rank_clusters(
        self, client: Any, folder: Path, own: IntArray, tell: Progress
    ) -> dict[str, Any]:
        given, filled = self.parameters, np.flatnonzero(own)
        total = given["clusters"]
        if total < len(filled):
            raise InvalidParameterError(
                f"Invalid clusters. Must be at least one for each of {len(filled)} tiles. "
                f"Given: {total}."
            )
        # One for each tile, and the rest as the points are.
        clusters = (own > 0) + share_out(total - len(filled), own.astype(float), own - (own > 0))
        settings = {name: given[name] for name in ("k", "definition", "init", "max_iter", "tol")}
        settings |= {"clusters": clusters.tolist(), "seed": given["seed"]}
        common = {"scales": self.scales.tolist()}
        run_tasks(client, tiletasks.cluster_tile, folder, filled, settings | common,
             lambda done: tell("ranking tiles", done))  # fmt: skip

        rows = np.concatenate(
            [tiletasks.load(tiletasks.result_path(folder, n, "clusters")) for n in filled.tolist()]
        )
        rows = rows[np.lexsort((rows["cluster"], rows["tile"], rows["entropy"]))]
        target = target_of(self.size, total, delete=given["delete"], count=self.asked)
        deleted = how_many_to_delete(
            rows["count"], rows["entropy"], target,
            keep_representative=given["keep_representative"],
        )  # fmt: skip
        for number in filled.tolist():
            mine = rows["cluster"][:deleted][rows["tile"][:deleted] == number]
            with writing(tiletasks.result_path(folder, number, "deleted")) as partial:
                np.save(partial, mine)
        settings = {"keep_representative": given["keep_representative"]}
        kept = sum(run_tasks(client, tiletasks.keep_clusters, folder, filled, settings | common,
                        lambda done: tell("selecting", done)))  # fmt: skip
        return {
            "kept": kept,
            "clusters": {"total": total, "deleted": deleted},
            "missed": 0 if self.asked is None else kept - self.asked,
        }

    def _rank_adaptive(
        self, client: Any, folder: Path, own: IntArray, tell: Progress
    ) -> dict[str, Any]:
        assert self.asked is not None
        own_parameters = get_method(COUNT_METHOD).parameters
        options = {known.name: self.parameters[known.name] for known in own_parameters}
        common = {
            "scales": self.scales.tolist(), "seed": self.parameters["seed"], "options": options,
        }  # fmt: skip
        tell("sharing out the points", None)
        pilot = client.submit(
            tiletasks.pilot_tile_shares, str(folder),
            {"share": self.asked / self.size, **common}, pure=False,
        )  # fmt: skip
        with lost_scheduler():
            weights = np.array(pilot.result(), dtype=float)
        # A tile that kept nothing of the sample may still keep something.
        budgets = share_out(self.asked, np.where(own > 0, weights + 1, 0), own)
        settings = {"budgets": budgets.tolist(), **common}
        kept = sum(run_tasks(client, tiletasks.keep_adaptive, folder, np.flatnonzero(own), settings,
                        lambda done: tell("ranking tiles", done)))  # fmt: skip
        return {"kept": kept, "missed": kept - self.asked}


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
