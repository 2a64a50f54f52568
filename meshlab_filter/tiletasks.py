"""What workers do with one tile: they are given paths and write files, never arrays.

Each task writes its result whole or not at all, and the same result however often it runs, so a
task that a worker did not live to finish can simply be run again.
"""

from __future__ import annotations

import json
import threading
from pathlib import Path
from typing import Any

import numpy as np

from .clustering import kmeans
from .entropy import cluster_entropy
from .errors import FileFormatError
from .methods import adaptive
from .methods.cluster_entropy import representatives
from .outputs import writing
from .tiles import PLAN, locate, read_tile
from .validation import FloatArray, IntArray

#: One row of what is gathered from all tiles.
CLUSTER = np.dtype([("tile", "<i4"), ("cluster", "<i4"), ("count", "<i8"), ("entropy", "<f8")])

_PARSER = threading.Lock()


def tile_seed(seed: int, number: int) -> int:
    """Return the seed of a tile: its own, and the same wherever and whenever it runs."""
    return int(np.random.SeedSequence([seed, number]).generate_state(1)[0])


def cluster_tile(folder: str, number: int, parameters: dict[str, Any]) -> int:
    """Cluster a tile and write its labels, centroids and rows of clusters.

    Parameters
    ----------
    folder : str
        The folder of tiles.
    number : int
        Which tile.
    parameters : dict
        ``clusters``, ``scales``, ``seed``, ``k``, ``definition``, ``init``, ``max_iter``, ``tol``.

    Returns
    -------
    int
        The number of the tile.
    """
    target = result_path(folder, number, "clusters")
    if target.exists():
        return number
    points, _ = _own_points(Path(folder), number, parameters["scales"])
    clustering = kmeans(
        points,
        parameters["clusters"][number],
        init=parameters["init"],
        max_iter=parameters["max_iter"],
        tol=parameters["tol"],
        seed=tile_seed(parameters["seed"], number),
    )
    labels = clustering.labels
    rows = np.empty(len(clustering.centroids), dtype=CLUSTER)
    rows["tile"], rows["cluster"] = number, np.arange(len(rows))
    rows["count"] = np.bincount(labels, minlength=len(rows))
    rows["entropy"] = cluster_entropy(
        points, labels, k=parameters["k"], definition=parameters["definition"]
    )
    _save(result_path(folder, number, "labels"), labels.astype("<i4"))
    _save(result_path(folder, number, "centroids"), clustering.centroids)
    # Written last: that it is there says that the others are.
    _save(target, rows)
    return number


def keep_clusters(folder: str, number: int, parameters: dict[str, Any]) -> int:
    """Write which points of a tile stay once its deleted clusters are known.

    Parameters
    ----------
    folder, number
        As for :func:`cluster_tile`.
    parameters : dict
        ``scales`` and ``keep_representative``.

    Returns
    -------
    int
        How many points stay.
    """
    base = Path(folder)
    points, rows = _own_points(base, number, parameters["scales"])
    labels = load(result_path(folder, number, "labels")).astype(np.int64)
    deleted = load(result_path(folder, number, "deleted"))
    centroids = load(result_path(folder, number, "centroids"))
    stay = ~np.isin(labels, deleted)
    if parameters["keep_representative"]:
        stay[representatives(points, labels, centroids, deleted)] = True
    _save(result_path(folder, number, "kept"), rows[stay])
    return int(stay.sum())


def pilot_tile_shares(folder: str, parameters: dict[str, Any]) -> list[int]:
    """Simplify the sample as the cloud will be and count what stays in each tile.

    Parameters
    ----------
    folder : str
        The folder of tiles, with ``sample.npy``.
    parameters : dict
        ``share`` of the points that stay, ``scales``, ``seed``, ``options`` of the method.

    Returns
    -------
    list of int
        One number a tile.
    """
    base = Path(folder)
    cells = load(base / "sample.npy")
    plan = json.loads((base / PLAN).read_text(encoding="utf-8"))
    points = cells * np.asarray(parameters["scales"])
    count = max(1, round(parameters["share"] * len(points)))
    ranking = adaptive.rank(points, count=count, seed=parameters["seed"], **parameters["options"])
    home = locate(plan["cuts"], cells[ranking.indices])
    return [int(n) for n in np.bincount(home, minlength=len(plan["tiles"]))]


def keep_adaptive(folder: str, number: int, parameters: dict[str, Any]) -> int:
    """Rank a tile together with its halo and write which of its own points stay.

    Parameters
    ----------
    folder, number
        As for :func:`cluster_tile`.
    parameters : dict
        ``budgets`` of the tiles, ``scales``, ``seed`` and ``options`` of the method.

    Returns
    -------
    int
        How many points stay.
    """
    target = result_path(folder, number, "kept")
    budget = int(parameters["budgets"][number])
    if target.exists():
        return budget
    records = _records(Path(folder), number)
    points = records["cell"] * np.asarray(parameters["scales"])
    # What is left then has no more own points than stay; the last to go make up their number.
    ranking = adaptive.rank(
        points,
        count=max(budget, 1),
        seed=tile_seed(parameters["seed"], number),
        **parameters["options"],
    )
    own = np.flatnonzero(records["own"])
    best = own[np.argsort(ranking.rank[own])[len(own) - budget :]]
    _save(target, np.sort(records["row"][best]))
    return budget


def result_path(folder: str | Path, number: int, kind: str) -> Path:
    """Return the file of one result of a tile."""
    return Path(folder) / f"tile{number:06d}.{kind}.npy"


def load(path: Path) -> Any:
    """Read an array that a task has written.

    Raises
    ------
    FileFormatError
        If the file is not whole.
    """
    try:
        # NumPy parses the header as Python, and the parser of Python 3.11 fails now and then when
        # two threads use it at once.
        with _PARSER:
            return np.load(path, allow_pickle=False)
    except (ValueError, EOFError, FileNotFoundError) as error:
        raise FileFormatError(
            f"A tile is damaged; run again to make the tiles anew. Given: {path}."
        ) from error


def _records(folder: Path, number: int) -> Any:
    plan = json.loads((folder / PLAN).read_text(encoding="utf-8"))
    return read_tile(folder, number, plan["tiles"][number])


def _own_points(folder: Path, number: int, scales: list[float]) -> tuple[FloatArray, IntArray]:
    """Return the coordinates, without the file's offset, and the places of a tile's points."""
    records = _records(folder, number)
    records = records[records["own"]]
    return records["cell"] * np.asarray(scales), records["row"]


def _save(path: Path, array: Any) -> None:
    with writing(path) as partial:
        np.save(partial, array)
