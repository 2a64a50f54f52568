"""Clouds in plain text: lines stay as they are."""

import numpy as np
import numpy.testing as npt
import pytest

from meshlab_filter import read_cloud, write_cloud
from meshlab_filter.errors import FileFormatError


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("scan.xyz", b"1 2 3 9\n4.50 5 6 8\n7 8 9e0 7\n", b"1 2 3 9\n7 8 9e0 7\n"),
        ("scan.xyz", b"1 2 3\r\n4 5 6\r\n7 8 9", b"1 2 3\r\n7 8 9\r\n"),
        ("scan.xyz", b"1 2 3\r4 5 6\r7 8 9\r", b"1 2 3\r7 8 9\r"),
        ("scan.pts", b"3\n1 2 3 -5 10 20 30\n4 5 6 1 1 1 1\n7 8 9 0 4 5 6\n",
         b"2\n1 2 3 -5 10 20 30\n7 8 9 0 4 5 6\n"),
        ("scan.csv", b"x,y,z,name\n1,2,3,4\n4,5,6,4\n7,8,9,4\n", b"x,y,z,name\n1,2,3,4\n7,8,9,4\n"),
        ("scan.csv", b"\xef\xbb\xbfX;Y;Z\n1;2;3\n4;5;6\n7;8;9\n", b"X;Y;Z\n1;2;3\n7;8;9\n"),
        ("scan.asc", b"# a comment\n1 2 3\n\n// another\n4 5 6\n7 8 9\n", b"1 2 3\n7 8 9\n"),
        ("scan.txt", b"500000.123 4100000.456 7.000\n4 5 6\n-0.0 1e-310 +9\n",
         b"500000.123 4100000.456 7.000\n-0.0 1e-310 +9\n"),
    ],
)  # fmt: skip
def test_lines_are_kept_as_written(tmp_path, name, content, expected):
    """Whatever stands in a line stays, further columns and line breaks included."""
    (tmp_path / name).write_bytes(content)
    cloud = read_cloud(tmp_path / name)
    assert cloud.points.shape == (3, 3)
    write_cloud(cloud, tmp_path / f"thin_{name}", indices=np.array([0, 2]))
    assert (tmp_path / f"thin_{name}").read_bytes() == expected
    again = read_cloud(tmp_path / f"thin_{name}")
    npt.assert_array_equal(again.points, cloud.points[[0, 2]])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\n\n\n", "no lines of numbers"),
        (b"x y z\n", "no lines of numbers"),
        (b"1 2\n3 4\n5 6\n", "at least three numbers"),
        (b"1 2 3\n4 5\n", "Not lines of numbers"),
        (b"1 2 3\nfour five six\n", "Not lines of numbers"),
        (b"5\n1 2 3\n", "announces 5 points, 1 follow"),
        (b"99999999999999999999\n1 2 3\n", "cut short"),
        (b"1 2 3\n\x00\x01\x02", "Not a text file"),
        ("1 2 3\n".encode("utf-16"), "Not a text file"),
        (b"\xff\xfe\xfa\n", "Not lines of numbers"),
    ],
)
def test_damaged_files_end_in_a_sentence(tmp_path, content, message):
    """What is wrong with the file is said in one line that names it."""
    path = tmp_path / "scan.xyz"
    path.write_bytes(content)
    with pytest.raises(FileFormatError, match=message) as caught:
        read_cloud(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_columns_are_normals_only_if_they_have_length_one(tmp_path):
    """Colours in columns four to six are not mistaken for normals."""
    np.savetxt(tmp_path / "a.xyz", [[0, 0, 0, 0, 0, 1], [1, 0, 0, 0.6, 0.8, 0]])
    np.savetxt(tmp_path / "b.xyz", [[0, 0, 0, 255, 0, 1], [1, 0, 0, 12, 8, 0]])
    npt.assert_allclose(read_cloud(tmp_path / "a.xyz").normals, [[0, 0, 1], [0.6, 0.8, 0]])
    assert read_cloud(tmp_path / "b.xyz").normals is None
