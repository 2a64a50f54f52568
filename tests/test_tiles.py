"""Cutting a LAS file into tiles: no point twice, none lost."""

import json

import numpy as np
import numpy.testing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshlab_filter import tiles
from meshlab_filter.errors import FileFormatError

laspy = pytest.importorskip("laspy")


def las_file(path, cells):
    """Write points at integer coordinates to a LAS file."""
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales, header.offsets = np.full(3, 0.001), np.array([5e5, 5.4e6, 0.0])
    data = laspy.LasData(header)
    data.X, data.Y, data.Z = np.asarray(cells, dtype="i4").T
    data.write(path)
    return path


def cells(size, seed=0, spread=1000):
    """Integer coordinates, many of them shared."""
    return np.random.default_rng(seed).integers(-spread, spread, size=(size, 3)).astype("i4")


@pytest.mark.parametrize("count", [1, 2, 3, 7, 16])
def test_tiles_hold_equal_numbers(count):
    """Median cuts give tiles of nearly as many points."""
    points = cells(8000, spread=10**6)
    home = tiles.locate(tiles.median_cuts(points, np.ones(3), count), points)
    sizes = np.bincount(home)
    assert len(sizes) == count
    assert sizes.min() > 0.9 * 8000 / count


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 1000), count=st.integers(1, 20), spread=st.integers(1, 50))
def test_boxes_are_half_open(seed, count, spread):
    """Every place is in exactly one tile, on the cuts as well, however many points share it."""
    points = cells(200, seed, spread)
    cuts = tiles.median_cuts(points, np.ones(3), count)
    found = np.zeros(len(points), dtype=int)

    def put(number, rows):
        found[rows] += 1

    tiles._descend(cuts, points, np.arange(len(points)), np.zeros(3, dtype=np.int64), put)
    npt.assert_array_equal(found, 1)
    home = tiles.locate(cuts, points)
    # The same place is in the same tile.
    _, place = np.unique(points, axis=0, return_inverse=True)
    for where in np.unique(place):
        assert len(np.unique(home[place.ravel() == where])) == 1


def test_longest_edge_is_cut_in_units_of_length():
    """The scales of the axes count, not the integers."""
    points = cells(100)
    assert tiles.median_cuts(points, np.array([1.0, 5.0, 1.0]), 2)[0] == 1


@pytest.mark.parametrize("halo", [0, 40])
def test_partition(tmp_path, halo, monkeypatch):
    """Tiles hold every point once as their own, and the points around them as a halo."""
    monkeypatch.setattr(tiles, "_STREAM", 700)
    points = cells(5000)
    source = las_file(tmp_path / "in.laz", points)
    cuts = tiles.median_cuts(points, np.ones(3), 6)
    plan = tiles.partition(
        source, tmp_path, cuts, halo=np.full(3, halo), progress=lambda done: None
    )
    assert json.loads((tmp_path / tiles.PLAN).read_text())["tiles"] == plan
    home, seen = tiles.locate(cuts, points), []
    for number, expected in enumerate(plan):
        records = tiles.read_tile(tmp_path, number, expected)
        npt.assert_array_equal(records["cell"], points[records["row"]])
        npt.assert_array_equal(records["own"], home[records["row"]] == number)
        seen.append(records["row"][records["own"]])
        own, other = records["cell"][records["own"]], points[home != number]
        low, high = own.min(axis=0), own.max(axis=0)
        near = ((other > low - halo) & (other < high + halo)).all(axis=1)
        inside = np.isin(np.flatnonzero(home != number)[near], records["row"])
        assert inside.all() or halo == 0
        assert records["own"].all() == (halo == 0)
    npt.assert_array_equal(np.sort(np.concatenate(seen)), np.arange(5000))


def test_sample_is_seeded(tmp_path, monkeypatch):
    """The same seed draws the same points; a small file is drawn whole."""
    monkeypatch.setattr(tiles, "_STREAM", 700)
    source = las_file(tmp_path / "in.las", cells(5000))
    first, again, other = (tiles.draw_sample(source, size=500, seed=s) for s in (1, 1, 2))
    npt.assert_array_equal(first, again)
    assert 400 < len(first) < 600
    assert len(first) != len(other) or (first != other).any()
    npt.assert_array_equal(tiles.draw_sample(source, size=5000, seed=0), cells(5000))


@pytest.mark.parametrize("damage", ["flip", "cut", "gone"])
def test_damaged_tile(tmp_path, damage):
    """A tile that is not as it was written is found out."""
    source = las_file(tmp_path / "in.las", cells(100))
    (expected,) = tiles.partition(
        source, tmp_path, 0, halo=np.zeros(3, dtype=int), progress=lambda done: None
    )
    path = tiles.tile_path(tmp_path, 0)
    data = bytearray(path.read_bytes())
    data[50] ^= 1
    if damage == "gone":
        path.unlink()
    else:
        path.write_bytes(data if damage == "flip" else data[:-1])
    with pytest.raises(FileFormatError, match="A tile is damaged"):
        tiles.read_tile(tmp_path, 0, expected)


@settings(deadline=None, max_examples=100)
@given(
    limits=st.lists(st.integers(0, 30), min_size=1, max_size=12),
    data=st.data(),
)
def test_share_out(limits, data):
    """Shares add up to the total, within the limits, and in proportion where limits allow."""
    limits = np.array(limits)
    weights = np.array([data.draw(st.floats(0.01, 100)) for _ in limits])
    total = data.draw(st.integers(0, int(limits.sum())))
    shares = tiles.share_out(total, weights, limits)
    assert shares.sum() == total
    assert (shares >= 0).all()
    assert (shares <= limits).all()
    free = shares < limits
    if free.sum() > 1:
        ratio = total * weights[free] / weights.sum()
        assert (shares[free] >= np.floor(ratio) - 1e-9).all()
