"""PLY files: every byte of the records that stay, and every lie a header can tell."""

import struct

import numpy as np
import numpy.testing as npt
import plyfile
import pytest

from meshlab_filter import read_cloud, write_cloud
from meshlab_filter.errors import FileFormatError

KEPT = np.array([0, 3, 4, 9])


def rows_with_everything(count=12, seed=0):
    """Return vertices with colours, normals, quality and properties of every type."""
    rng = np.random.default_rng(seed)
    rows = np.zeros(
        count,
        dtype=[("x", "f8"), ("y", "f8"), ("z", "f8"), ("nx", "f4"), ("ny", "f4"), ("nz", "f4"),
               ("red", "u1"), ("green", "u1"), ("blue", "u1"), ("alpha", "u1"),
               ("quality", "f4"), ("label", "i4"), ("gps_time", "f8"), ("ring", "u2"),
               ("delta", "i1"), ("echo", "i2"), ("id", "u4")],
    )  # fmt: skip
    for name in rows.dtype.names:
        kind = rows.dtype[name]
        if kind.kind == "f":
            rows[name] = rng.normal(size=count) * 1e5
        else:
            info = np.iinfo(kind)
            rows[name] = rng.integers(info.min, info.max, count, endpoint=True)
    return rows


def element_with_list(rows, *, swapped=False):
    """Return a vertex element in which a list of varying length stands among the values.

    plyfile writes the single values of elements with lists in the machine's byte order, whatever
    it was asked for: values swapped beforehand come out right.
    """
    if swapped:
        rows = rows.byteswap()
    wider = np.empty(len(rows), dtype=[*rows.dtype.descr[:4], ("sources", object),
                                       *rows.dtype.descr[4:]])  # fmt: skip
    for name in rows.dtype.names:
        wider[name] = rows[name]
    wider["sources"] = [np.arange(index % 4, dtype="u2") for index in range(len(rows))]
    return plyfile.PlyElement.describe(
        wider, "vertex", len_types={"sources": "u1"}, val_types={"sources": "u2"}
    )


def faces(count=5):
    """Return triangles and quadrilaterals."""
    rows = np.empty(count, dtype=[("vertex_indices", object)])
    rows["vertex_indices"] = [np.arange(3 + index % 2, dtype="i4") for index in range(count)]
    return plyfile.PlyElement.describe(rows, "face")


@pytest.mark.parametrize("lists", [False, True], ids=["values", "lists"])
@pytest.mark.parametrize("form", ["ascii", "little", "big"])
@pytest.mark.parametrize("order", ["vertex first", "face first"])
def test_all_properties_survive(tmp_path, form, lists, order):
    """An independent reader finds the same value of each property, comment and obj_info."""
    rows = rows_with_everything()
    element = element_with_list(rows) if lists else plyfile.PlyElement.describe(rows, "vertex")
    written = element_with_list(rows, swapped=True) if lists and form == "big" else element
    elements = [written, faces()] if order == "vertex first" else [faces(), written]
    plyfile.PlyData(
        elements, text=form == "ascii", byte_order={"little": "<", "big": ">"}.get(form, "="),
        comments=["scanned on a Tuesday"], obj_info=["num_cols 12"],
    ).write(str(tmp_path / "scan.ply"))  # fmt: skip

    cloud = read_cloud(tmp_path / "scan.ply")
    assert cloud.faces == 5
    for column, axis in enumerate("xyz"):
        npt.assert_array_equal(cloud.points[:, column], rows[axis])
    write_cloud(cloud, tmp_path / "thin.ply", indices=KEPT, comments=["thinned"])

    thin = plyfile.PlyData.read(str(tmp_path / "thin.ply"))
    assert [element.name for element in thin] == ["vertex"]
    assert thin.comments == ["scanned on a Tuesday", "thinned"]
    assert thin.obj_info == ["num_cols 12"]
    for name in element.data.dtype.names:
        for before, after in zip(element.data[name][KEPT], thin["vertex"][name]):
            npt.assert_array_equal(after, before)
            assert np.asarray(after).dtype.newbyteorder("=") == np.asarray(before).dtype


@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_records_keep_their_bytes(tmp_path, order):
    """Not even the payload of a NaN in an attribute changes."""
    rows = rows_with_everything().astype(rows_with_everything().dtype.newbyteorder(order))
    rows["quality"].view(order + "u4")[3] = 0x7FC0BEEF
    plyfile.PlyData([plyfile.PlyElement.describe(rows, "vertex")], byte_order=order).write(
        str(tmp_path / "scan.ply")
    )
    write_cloud(read_cloud(tmp_path / "scan.ply"), tmp_path / "thin.ply", indices=KEPT)
    assert (tmp_path / "thin.ply").read_bytes().endswith(b"end_header\n" + rows[KEPT].tobytes())


def test_ascii_lines_are_kept_as_written(tmp_path):
    """Digits beyond the declared type, exponents and spacing stay; coordinates use all digits."""
    lines = [b"500000.12345 4100000.98765   7.50 +1e2\n", b"1 2 3 4\n", b"5 6 7.000 08\n"]
    (tmp_path / "scan.ply").write_bytes(
        b"ply\nformat ascii 1.0\ncomment by hand\nelement vertex 3\nproperty float x\n"
        b"property float y\nproperty float z\nproperty float note\nend_header\n" + b"".join(lines)
    )
    cloud = read_cloud(tmp_path / "scan.ply")
    assert cloud.points[0].tolist() == [500000.12345, 4100000.98765, 7.5]
    write_cloud(cloud, tmp_path / "thin.ply", indices=np.array([0, 2]))
    assert (tmp_path / "thin.ply").read_bytes().endswith(b"end_header\n" + lines[0] + lines[2])


@pytest.mark.parametrize("newline", [b"\n", b"\r\n", b"\r"], ids=["lf", "crlf", "cr"])
@pytest.mark.parametrize("binary", [False, True], ids=["ascii", "binary"])
def test_line_breaks_of_every_system(tmp_path, newline, binary):
    """Files with the line breaks of Windows and of old Macs are read and keep theirs."""
    header = newline.join([
        b"ply", b"format %s 1.0" % (b"binary_little_endian" if binary else b"ascii"),
        "comment gescannt von Jörg".encode(), b"element vertex 3", b"property double x",
        b"property double y", b"property double z", b"end_header", b"",
    ])  # fmt: skip
    # The first byte of the first record is a line feed, which belongs to it and not to the header.
    records = [struct.pack("<Q2d", 0x3FF000000000000A, 2, 3), *(struct.pack("<3d", 4, 5, index)
               for index in range(2))]  # fmt: skip
    if not binary:
        records = [b"1 2 3" + newline, b"4 5 0" + newline, b"4 5 1"]
    (tmp_path / "scan.ply").write_bytes(header + b"".join(records))
    cloud = read_cloud(tmp_path / "scan.ply")
    npt.assert_allclose(cloud.points, [[1, 2, 3], [4, 5, 0], [4, 5, 1]])
    write_cloud(cloud, tmp_path / "thin.ply", indices=np.array([0, 2]))
    expected = header.replace(b"vertex 3", b"vertex 2") + records[0] + records[2]
    assert (tmp_path / "thin.ply").read_bytes() == expected + (b"" if binary else newline)


@pytest.mark.parametrize("lists", [False, True], ids=["values", "lists"])
@pytest.mark.parametrize("form", ["ascii", "little", "big"])
def test_extra_values_stand_beside_those_of_the_same_name(tmp_path, form, lists):
    """A new quality is written as quality; the one the file had is kept under another name."""
    rows = rows_with_everything()
    element = plyfile.PlyElement.describe(rows, "vertex")
    if lists:
        element = element_with_list(rows, swapped=form == "big")
    plyfile.PlyData(
        [element], text=form == "ascii", byte_order={"little": "<", "big": ">"}.get(form, "=")
    ).write(str(tmp_path / "scan.ply"))
    distance = np.random.default_rng(1).random(len(rows))
    write_cloud(
        read_cloud(tmp_path / "scan.ply"), tmp_path / "all.ply",
        indices=KEPT, extra={"quality": distance},
    )  # fmt: skip
    vertex = plyfile.PlyData.read(str(tmp_path / "all.ply"))["vertex"]
    npt.assert_array_equal(vertex["quality"], distance[KEPT])
    npt.assert_array_equal(vertex["input_quality"], rows["quality"][KEPT])
    npt.assert_array_equal(vertex["id"], rows["id"][KEPT])


@pytest.mark.parametrize("suffix", [".xyz", ".csv", ".ply"])
def test_another_format_keeps_coordinates_and_normals(tmp_path, suffix):
    """Every digit of coordinates and normals is in the file of the other format."""
    rows = rows_with_everything()
    for axis in "xyz":
        rows[f"n{axis}"] = 3**-0.5
    source = tmp_path / ("scan.ply" if suffix != ".ply" else "scan.xyz")
    if suffix == ".ply":
        table = np.column_stack([rows[name] for name in ("x", "y", "z", "nx", "ny", "nz")])
        np.savetxt(source, table, fmt="%.17g")
    else:
        plyfile.PlyData([plyfile.PlyElement.describe(rows, "vertex")]).write(str(source))
    cloud = read_cloud(source)
    write_cloud(cloud, tmp_path / f"thin{suffix}", indices=KEPT)
    thin = read_cloud(tmp_path / f"thin{suffix}")
    npt.assert_array_equal(thin.points, cloud.points[KEPT])
    npt.assert_array_equal(thin.normals, cloud.normals[KEPT])


HEADER = (
    "ply\nformat {form} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n"
    "property float z\n{more}end_header\n"
)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"solid but not ply\n", "does not begin with 'ply'"),
        (b"ply\nformat ascii 1.0\n", "has no end"),
        (b"ply\nend_header\n", "says the format"),
        (HEADER.format(form="ascii", count=10, more=""), "announces 10 lines of records, 2 follow"),
        (HEADER.format(form="ascii", count=10**15, more=""), "announces 1000000000000000 lines"),
        (HEADER.format(form="ascii", count=-5, more=""), "line that is not PLY"),
        (HEADER.format(form="ascii", count="many", more=""), "line that is not PLY"),
        (HEADER.format(form="ebcdic", count=2, more=""), "line that is not PLY"),
        (HEADER.format(form="ascii", count=2, more="property quad w\n"), "that is not PLY"),
        (HEADER.format(form="ascii", count=2, more="property list float int w\n"), "that is not"),
        (HEADER.format(form="ascii", count=2, more="property float x\n"), "one of them twice"),
        (HEADER.format(form="ascii", count=2, more="element vertex 2\nproperty int i\n"), "twice"),
        (HEADER.format(form="ascii", count=2, more="property float w\n"), "4 numbers a vertex, 3"),
        (HEADER.format(form="ascii", count=1, more="property list int int w\n"), "not numbers"),
        (HEADER.format(form="binary_little_endian", count=3, more=""), "36 bytes; 12 follow"),
        (HEADER.format(form="binary_big_endian", count=10**13, more=""), "cut short"),
        (HEADER.format(form="binary_little_endian", count=1,
                       more="element face 1\nproperty list uint int i\n"), "0 follow"),
        (b"ply\nformat binary_little_endian 1.0\nelement vertex 1\n"
         b"property list uint float x\nend_header\n\xff\xff\xff\xff", "no vertices with x, y"),
        (b"ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list int float x\n"
         b"element vertex 0\nproperty float x\nproperty float y\nproperty float z\n"
         b"end_header\n\xff\xff\xff\xff", "negative length"),
        (b"ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint float x\n"
         b"element vertex 0\nproperty float x\nproperty float y\nproperty float z\n"
         b"end_header\n\xff\xff\xff\xff", "ends behind the file"),
    ],
)  # fmt: skip
def test_damaged_files_end_in_a_sentence(tmp_path, content, message):
    """What is wrong with the file is said in one line that names it."""
    path = tmp_path / "scan.ply"
    if isinstance(content, str):
        body = b"1 2 3\n4 5 6\n" if "ascii" in content or "ebcdic" in content else b"\0" * 12
        content = content.encode() + body
    path.write_bytes(content)
    with pytest.raises(FileFormatError, match=message) as caught:
        read_cloud(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_mesh_cut_short_in_its_faces_is_refused(tmp_path):
    """Vertices are all there, but the file is not whole; that is not hidden."""
    for text in (False, True):
        plyfile.PlyData(
            [plyfile.PlyElement.describe(rows_with_everything(), "vertex"), faces()], text=text
        ).write(str(tmp_path / "mesh.ply"))
        data = (tmp_path / "mesh.ply").read_bytes()
        (tmp_path / "mesh.ply").write_bytes(data[: -9 - 4 * text])
        with pytest.raises(FileFormatError, match="cut short"):
            read_cloud(tmp_path / "mesh.ply")
