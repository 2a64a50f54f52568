"""A file to be simplified in tiles: what is asked for, the cuts, and the ranking of all tiles."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from . import tiletasks
from ._version import __version__
from .amounts import points_to_keep
from .errors import InvalidCloudError, InvalidParameterError, OutputError
from .lasfile import import_laspy, las_errors
from .methods.cluster_entropy import how_many_to_delete, target_of
from .methods.registry import Method, get_method
from .outputs import writing
from .provenance import fingerprint
from .quality import median_spacing
from .scheduling import lost_scheduler, run_tasks
from .simplification import CLUSTER_METHOD, COUNT_METHOD, DEFAULT_DELETE
from .tiles import PLAN, RECORD, draw_sample, median_cuts, partition, share_out
from .validation import FloatArray, IntArray, check_integer

#: Called with the name of a stage and the share of it done.
Progress = Callable[[str, "float | None"], object]

# A tile of this size takes some 300 MB to rank, 450 MB by the adaptive method with its halo.
_TILE_POINTS = 1_000_000
# Points the cuts are made from, and from which the adaptive method's budget is shared out.
_SAMPLE = 200_000
# Width of the halo, in spacings of the points that stay: what a point's own fate depends on.
_HALO = 4.0


def _try(method: Method, parameters: dict[str, Any]) -> None:
    """Rank a few points, so that a value out of range is refused before tiles are cut."""
    trial = {name: value for name, value in parameters.items() if name != "delete"}
    if "clusters" in trial:
        trial |= {"clusters": 2, "delete": 1}
    method.load()(np.random.default_rng(0).random((40, 3)), **trial)


class TileJob:
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
    ) -> TileJob:  # fmt: skip
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
