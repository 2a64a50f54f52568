"""LAS and LAZ in and out: what stays is bit for bit what was read."""

import datetime

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter.cloud import Cloud, read_cloud, write_cloud
from meshlab_filter.errors import FileFormatError, OutputError

laspy = pytest.importorskip("laspy")

SIZE = 2000


def las_file(path, *, version="1.4", point_format=7, seed=0):
    """Write a LAS file with every kind of thing a header can carry."""
    rng = np.random.default_rng(seed)
    header = laspy.LasHeader(version=version, point_format=point_format)
    header.scales, header.offsets = np.array([0.001, 0.001, 0.01]), np.array([5e5, 5.4e6, 0.0])
    header.creation_date = datetime.date(2020, 2, 3)
    header.generating_software, header.system_identifier = "a scanner", "tripod"
    header.vlrs.append(laspy.VLR("LASF_Projection", 2112, "WKT", b'GEOGCS["WGS 84"]\0'))
    header.add_extra_dims([laspy.ExtraBytesParams("reflectance", "f4", "dB")])
    data = laspy.LasData(header)
    data.X, data.Y, data.Z = rng.integers(-(10**6), 10**6, size=(3, SIZE)).astype("i4")
    data.intensity = rng.integers(65536, size=SIZE).astype("u2")
    data.classification = rng.integers(20, size=SIZE).astype("u1")
    data.return_number = rng.integers(1, 4, size=SIZE).astype("u1")
    data["reflectance"] = rng.normal(size=SIZE).astype("f4")
    if "gps_time" in data.point_format.dimension_names:
        data.gps_time = np.sort(rng.random(SIZE))
    if "red" in data.point_format.dimension_names:
        data.red, data.green, data.blue = rng.integers(65536, size=(3, SIZE)).astype("u2")
    data.write(path)
    return path


@pytest.mark.parametrize(
    ("version", "point_format"), [("1.2", 0), ("1.2", 3), ("1.4", 6), ("1.4", 7)]
)
@pytest.mark.parametrize("source", [".las", ".laz"])
@pytest.mark.parametrize("target", [".las", ".laz"])
def test_survivors_keep_everything(tmp_path, version, point_format, source, target):
    """Every dimension, scale, offset, record and text of the header comes through."""
    path = las_file(tmp_path / f"in{source}", version=version, point_format=point_format)
    indices = np.arange(3, SIZE, 7)
    write_cloud(read_cloud(path), tmp_path / f"out{target}", indices=indices, comments=["seed=0"])
    before, after = laspy.read(path), laspy.read(tmp_path / f"out{target}")
    assert list(after.point_format.dimension_names) == list(before.point_format.dimension_names)
    for name in before.point_format.dimension_names:
        npt.assert_array_equal(np.asarray(after[name]), np.asarray(before[name])[indices])
    npt.assert_array_equal(after.header.scales, before.header.scales)
    npt.assert_array_equal(after.header.offsets, before.header.offsets)
    npt.assert_array_equal(after.header.maxs, after.xyz.max(axis=0))
    assert after.header.version == before.header.version
    assert after.header.point_format.id == point_format
    assert after.header.creation_date == before.header.creation_date
    assert after.header.generating_software == "a scanner"
    assert after.header.system_identifier == "tripod"
    assert after.header.vlrs.get("WktCoordinateSystemVlr")[0].string == 'GEOGCS["WGS 84"]'
    mine = [vlr for vlr in after.header.vlrs if vlr.user_id == "meshlab-filter"]
    assert [vlr.record_data for vlr in mine] == [b"seed=0"]


def test_extended_records_stay_and_copc_ones_go(tmp_path):
    """Extended records come through; those that describe a COPC octree do not."""
    data = laspy.read(las_file(tmp_path / "in.las"))
    data.evlrs = laspy.vlrs.vlrlist.VLRList(
        [laspy.VLR("someone", 7, "notes", b"x" * 70_000), laspy.VLR("copc", 1000, "", b"y" * 32)]
    )
    data.header.vlrs.append(laspy.VLR("COPC", 5, "", b"z" * 8))
    data.write(tmp_path / "in.las")
    write_cloud(read_cloud(tmp_path / "in.las"), tmp_path / "out.las")
    after = laspy.read(tmp_path / "out.las")
    assert [(e.user_id, e.record_data_bytes()) for e in after.evlrs] == [("someone", b"x" * 70_000)]
    assert not [vlr for vlr in after.header.vlrs if vlr.user_id.lower() == "copc"]


def test_cloud_of_a_file(tmp_path):
    """Coordinates are scaled and shifted, colours lie between 0 and 1."""
    path = las_file(tmp_path / "in.laz")
    cloud, data = read_cloud(path), laspy.read(path)
    npt.assert_array_equal(cloud.points, data.xyz)
    npt.assert_allclose(cloud.colors[:, 1], data.green / 65535)
    assert cloud.normals is None


def test_extra_columns_become_dimensions(tmp_path):
    """A column is added, or takes the place of a dimension of the same name."""
    path = las_file(tmp_path / "in.las")
    columns = {"rank": np.arange(SIZE), "reflectance": np.full(SIZE, 2.5, dtype="f4")}
    write_cloud(read_cloud(path), tmp_path / "out.laz", indices=np.array([5, 9]), extra=columns)
    after = laspy.read(tmp_path / "out.laz")
    npt.assert_array_equal(after["rank"], [5, 9])
    npt.assert_array_equal(after["reflectance"], [2.5, 2.5])


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_same_bytes_twice(tmp_path, suffix):
    """Nothing in an output depends on when it was written."""
    rng = np.random.default_rng(0)
    clouds = [read_cloud(las_file(tmp_path / "in.las")), Cloud(points=rng.normal(size=(50, 3)))]
    for cloud in clouds:
        for name in ("a", "b"):
            write_cloud(cloud, tmp_path / f"{name}{suffix}", comments=["x"])
        assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


def test_cloud_from_another_format(tmp_path):
    """Points, normals and colours of any cloud fit into LAS, to a two-thousand-millionth."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(300, 3)) * 40 + [5e5, 5e6, 100]
    normals, colors = rng.normal(size=(300, 3)), rng.random((300, 4))
    colors[:, 3] = 1
    cloud = Cloud(points=points, normals=normals, colors=colors)
    write_cloud(cloud, tmp_path / "out.laz", indices=np.arange(0, 300, 3))
    back = read_cloud(tmp_path / "out.laz")
    npt.assert_allclose(back.points, points[::3], atol=1e-6, rtol=0)
    npt.assert_array_equal(back.normals, normals[::3])
    npt.assert_allclose(back.colors, colors[::3], atol=1e-5)


@pytest.mark.parametrize("suffix", [".las", ".laz"])
@pytest.mark.parametrize("share", [0.001, 0.01, 0.3, 0.99])
def test_cut_short(tmp_path, suffix, share):
    """A file that ends too early is one sentence, not fewer points."""
    data = las_file(tmp_path / f"in{suffix}").read_bytes()
    path = tmp_path / f"cut{suffix}"
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(FileFormatError, match=r"^[^\n]*(LAS file|cut short)[^\n]*Given: .*cut"):
        read_cloud(path)


def test_text_named_las(tmp_path):
    """A text file with a LAS name is not a LAS file."""
    (tmp_path / "notes.las").write_text("hello " * 100)
    with pytest.raises(FileFormatError, match="Not a whole LAS file"):
        read_cloud(tmp_path / "notes.las")


def test_copc_is_not_written(tmp_path):
    """A name that promises an octree is refused, and nothing is left behind."""
    cloud = read_cloud(las_file(tmp_path / "in.las"))
    with pytest.raises(OutputError, match="COPC files can be read but not written"):
        write_cloud(cloud, tmp_path / "out.copc.laz")
    assert [file.name for file in tmp_path.iterdir()] == ["in.las"]


def test_real_scan(models_dir, tmp_path):
    """An airborne scan with a projection keeps its coordinates to the bit."""
    cloud = read_cloud(models_dir / "autzen_trim.las")
    write_cloud(cloud, tmp_path / "out.laz", indices=np.arange(0, len(cloud.points), 3))
    npt.assert_array_equal(read_cloud(tmp_path / "out.laz").points, cloud.points[::3])
