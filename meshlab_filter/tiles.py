"""A LAS file cut into tiles on disk, in one stream, by seeded kd-median cuts.

Cuts are made on the file's integer coordinates, so that which side a point is on is exact: a tile
is a half-open box, and every point is in one tile and no other.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import FileFormatError
from .lasfile import import_laspy, las_errors
from .outputs import writing
from .validation import FloatArray, IntArray

#: One record of a tile: the point's place in the source, its integer coordinates, and whether it
#: lies in the tile itself rather than in the halo around it.
RECORD = np.dtype([("row", "<i8"), ("cell", "<i4", 3), ("own", "?")])
# Points read at a time. It decides which points are sampled, hence is no parameter.
_STREAM = 1_000_000
PLAN = "tiles.json"


def stream(source: Path) -> Iterator[tuple[int, Any]]:
    """Yield (place of the first point, points) for consecutive pieces of a LAS file."""
    with las_errors(source), import_laspy().open(str(source)) as reader:
        begin = 0
        for points in reader.chunk_iterator(_STREAM):
            yield begin, points
            begin += len(points)
        if begin != reader.header.point_count:
            raise FileFormatError(
                f"The file is cut short: it announces {reader.header.point_count} points and "
                f"holds {begin}. Given: {source}."
            )


def cells_of(points: Any) -> npt.NDArray[np.int32]:
    """Return the integer coordinates of LAS points: shape (N, 3)."""
    return np.column_stack([points.X, points.Y, points.Z])


def draw_sample(source: Path, *, size: int, seed: int) -> npt.NDArray[np.int32]:
    """Return the integer coordinates of about ``size`` points drawn at random, all if fewer."""
    rng = np.random.default_rng(seed)
    with las_errors(source), import_laspy().open(str(source)) as reader:
        share = size / max(reader.header.point_count, 1)
    drawn = [
        cells_of(points) if share >= 1 else cells_of(points)[rng.random(len(points)) < share]
        for _, points in stream(source)
    ]
    return np.concatenate(drawn) if drawn else np.empty((0, 3), dtype=np.int32)


def median_cuts(sample: npt.NDArray[np.signedinteger[Any]], scales: FloatArray, tiles: int) -> Any:
    """Return a tree of cuts that splits the sample into tiles of equal numbers of points.

    Parameters
    ----------
    sample : numpy.ndarray, shape (S, 3), int
        Integer coordinates.
    scales : numpy.ndarray, shape (3,)
        Their units of length; the longest edge is cut.
    tiles : int
        How many tiles; fewer come out where points coincide.

    Returns
    -------
    int or list
        The number of a tile, or [axis, at, below, above]: points with a coordinate less than
        ``at`` are below.

    Examples
    --------
    >>> import numpy as np
    >>> median_cuts(np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]), np.ones(3), 2)
    [0, 2, 0, 1]
    """
    numbers = iter(range(tiles))

    def cut(cells: npt.NDArray[np.signedinteger[Any]], count: int) -> Any:
        extent = np.ptp(cells.astype(np.int64), axis=0) * scales if len(cells) else np.zeros(3)
        if count == 1 or extent.max() == 0:
            return next(numbers)
        axis = int(extent.argmax())
        values = np.sort(cells[:, axis])
        below = count // 2
        at = values[len(values) * below // count]
        if at == values[0]:
            at = values[values > at][0]
        lower = cells[:, axis] < at
        return [axis, int(at), cut(cells[lower], below), cut(cells[~lower], count - below)]

    return cut(sample, tiles)


def locate(cuts: Any, cells: npt.NDArray[np.int32]) -> IntArray:
    """Return the tile of each point.

    Examples
    --------
    >>> import numpy as np
    >>> locate([0, 2, 0, 1], np.array([[1, 9, 9], [2, 9, 9]], dtype=np.int32)).tolist()
    [0, 1]
    """
    tile = np.empty(len(cells), dtype=np.int64)

    def put(number: int, rows: IntArray) -> None:
        tile[rows] = number

    _descend(cuts, cells, np.arange(len(cells)), np.zeros(3, dtype=np.int64), put)
    return tile


def partition(
    source: Path,
    folder: Path,
    cuts: Any,
    *,
    halo: IntArray,
    progress: Callable[[float], object],
) -> list[dict[str, int]]:
    """Stream the source into a file for each tile, with the points around it as a halo.

    Parameters
    ----------
    source : Path
        A LAS, LAZ or COPC file.
    folder : Path
        Where the tiles go.
    cuts : int or list
        As from :func:`median_cuts`.
    halo : numpy.ndarray, shape (3,), int64
        How far around its box a tile sees other points, in integer coordinates.
    progress : callable
        Called with the share of the points that is done.

    Returns
    -------
    list of dict
        For each tile the number of records, ``points``, how many of them are its ``own``, and
        their ``crc``. The same is in the folder's ``tiles.json``, which is written last.
    """
    plan: list[dict[str, int]] = []
    with las_errors(source), import_laspy().open(str(source)) as reader:
        total = reader.header.point_count
    for path in folder.glob("*.points"):
        path.unlink()
    for begin, points in stream(source):
        cells = cells_of(points)
        home = locate(cuts, cells)

        def put(
            number: int,
            rows: IntArray,
            begin: int = begin,
            cells: npt.NDArray[np.int32] = cells,
            home: IntArray = home,
        ) -> None:
            while len(plan) <= number:
                plan.append({"points": 0, "own": 0, "crc": 0})
            records = np.empty(len(rows), dtype=RECORD)
            records["row"], records["cell"] = begin + rows, cells[rows]
            records["own"] = home[rows] == number
            data = records.tobytes()
            with open(tile_path(folder, number), "ab") as file:
                file.write(data)
            tile = plan[number]
            tile["points"] += len(rows)
            tile["own"] += int(records["own"].sum())
            tile["crc"] = zlib.crc32(data, tile["crc"])

        _descend(cuts, cells, np.arange(len(cells)), halo, put)
        progress((begin + len(points)) / total)
    with writing(folder / PLAN) as partial:
        partial.write_text(json.dumps({"cuts": cuts, "tiles": plan}), encoding="utf-8")
    return plan


def tile_path(folder: Path, number: int) -> Path:
    """Return the file of a tile's points."""
    return folder / f"tile{number:06d}.points"


def read_tile(folder: Path, number: int, expected: dict[str, int]) -> npt.NDArray[np.void]:
    """Return the records of a tile.

    Raises
    ------
    FileFormatError
        If the file is not what was written to it.
    """
    path = tile_path(folder, number)
    data = path.read_bytes() if path.exists() else b""
    whole = expected["points"] * RECORD.itemsize
    if len(data) != whole or zlib.crc32(data) != expected["crc"]:
        raise FileFormatError(
            f"A tile is damaged; run again to make the tiles anew. Given: {path}."
        )
    return np.frombuffer(data, dtype=RECORD)


def share_out(total: int, weights: FloatArray, limits: IntArray) -> IntArray:
    """Divide a total among tiles in proportion to weights, to the unit and within their limits.

    Parameters
    ----------
    total : int
        At most the sum of the limits.
    weights : numpy.ndarray, shape (T,)
        Not negative, positive where the limit is.
    limits : numpy.ndarray, shape (T,), int64
        The most each can take.

    Returns
    -------
    numpy.ndarray, shape (T,), int64
        Sums to the total.

    Examples
    --------
    >>> import numpy as np
    >>> share_out(10, np.array([1.0, 1.0, 2.0]), np.array([2, 9, 9])).tolist()
    [2, 3, 5]
    """
    full = limits == 0
    # Tiles that reach their limit leave the rest to the others.
    while True:
        ideal = np.where(full, limits, 0).astype(float)
        rest = total - int(limits[full].sum())
        ideal[~full] = rest * (weights[~full] / max(weights[~full].sum(), 1e-300))
        over = ~full & (ideal >= limits)
        if not over.any():
            break
        full |= over
    shares: IntArray = np.floor(ideal).astype(np.int64)
    missing = total - int(shares.sum())
    fraction = np.where(full, -1.0, ideal - shares)
    shares[np.argsort(-fraction, kind="stable")[:missing]] += 1
    return shares


def _descend(
    node: Any,
    cells: npt.NDArray[np.int32],
    rows: IntArray,
    halo: IntArray,
    put: Callable[[int, IntArray], None],
) -> None:
    """Hand each tile the rows in its box widened by the halo."""
    if not len(rows):
        return
    if isinstance(node, int):
        put(node, rows)
        return
    axis, at, below, above = node
    values = cells[rows, axis].astype(np.int64)
    _descend(below, cells, rows[values < at + halo[axis]], halo, put)
    _descend(above, cells, rows[values >= at - halo[axis]], halo, put)
