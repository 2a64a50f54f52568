"""Damaged files by the thousand, read as the product reads them.

``python tests/fuzzing.py FORMAT COUNT SEED`` reads COUNT damaged files and prints, as JSON, how
many ended in a result and how many in a sentence. Anything else ends the process.
"""

import faulthandler
import json
import struct
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from meshlab_filter.errors import MeshlabFilterError

#: Seconds after which a file has hung, and bytes of address space a reader may ask for.
HANG, MEMORY = 20, 2 * 2**30
LIES = (b"0", b"-1", b"1", b"3", b"255", b"65536", b"2147483647", b"4294967295", b"-2147483648",
        b"99999999999999999999", b"1e9", b"nan", b"inf", b"x", b"")  # fmt: skip
WORDS = (b"vertex", b"face", b"element", b"property", b"list", b"float", b"uchar", b"double",
         b"int", b"end_header", b"ascii", b"binary_big_endian", b"OFF", b"COFF", b"NOFF", b"solid",
         b"facet", b"v", b"vn", b"f", b"l", b"usemtl", b"mtllib", b"/", b"//", b",", b"\n",
         b"<filter name=", b'"', b">", b"</FilterScript>", b"&lt;", b"<!ENTITY", b"\0")  # fmt: skip


def damaged(content, rng):
    """Return a file's bytes after one to four kinds of damage."""
    data = bytearray(content)
    for _ in range(rng.integers(1, 5)):
        if not data:
            break
        kind = rng.integers(7)
        at = int(rng.integers(len(data)))
        # Half of the damage is done near the beginning, where headers are.
        if rng.random() < 0.5:
            at = min(at, int(rng.integers(200)))
        if kind == 0:
            del data[at:]
        elif kind == 1:
            data[at] ^= 1 << int(rng.integers(8))
        elif kind == 2:
            data[at : at + int(rng.integers(1, 9))] = rng.bytes(int(rng.integers(1, 9)))
        elif kind == 3:
            # Whole numbers as binary headers hold them.
            number = int(rng.choice([0, 1, 2**16, 2**31 - 1, 2**31, 2**32 - 1]))
            data[at : at + 4] = struct.pack(rng.choice(["<I", ">I"]), number)
        elif kind == 4:
            number_at = [index for index in range(at, min(len(data), at + 200))
                         if chr(data[index]).isdigit()]  # fmt: skip
            if number_at:
                end = number_at[0]
                while end < len(data) and chr(data[end]).isdigit():
                    end += 1
                data[number_at[0] : end] = LIES[rng.integers(len(LIES))]
        elif kind == 5:
            data[at:at] = WORDS[rng.integers(len(WORDS))]
        else:
            part = data[at : at + int(rng.integers(1, 100))]
            data[at:at] = part * int(rng.integers(1, 4))
    return bytes(data)


def whole_files(form):
    """Return small files of a format, of every kind that its readers know."""
    rng = np.random.default_rng(0)
    points = rng.random((12, 3)).round(4)
    triangles = rng.integers(0, 12, (8, 3))
    return globals()[f"_whole_{form}"](points, triangles)


def _text(points, form="%g %g %g"):
    return "".join(form % tuple(point) + "\n" for point in points)


def _whole_ply(points, triangles):
    import io

    import plyfile

    rows = np.zeros(len(points), dtype=[("x", "f4"), ("y", "f8"), ("z", "f4"), ("red", "u1"),
                                        ("green", "u1"), ("blue", "u1"), ("n", "i4")])  # fmt: skip
    rows["x"], rows["y"], rows["z"] = points.T
    listed = np.empty(len(points), dtype=[*rows.dtype.descr, ("list", object)])
    for name in rows.dtype.names:
        listed[name] = rows[name]
    listed["list"] = [np.arange(index % 3, dtype="f4") for index in range(len(points))]
    corners = np.empty(len(triangles), dtype=[("vertex_indices", object)])
    corners["vertex_indices"] = list(triangles.astype("i4"))
    faces = plyfile.PlyElement.describe(corners, "face")
    for vertices in (plyfile.PlyElement.describe(rows, "vertex"),
                     plyfile.PlyElement.describe(listed, "vertex")):  # fmt: skip
        for text, order in ((True, "="), (False, "<"), (False, ">")):
            for elements in ([vertices], [vertices, faces], [faces, vertices]):
                stream = io.BytesIO()
                plyfile.PlyData(
                    elements, text=text, byte_order=order, comments=["a"], obj_info=["b"]
                ).write(stream)
                yield stream.getvalue()


def _whole_obj(points, triangles):
    vertices = _text(points, "v %g %g %g")
    yield vertices.encode()
    yield _text(np.hstack([points, points]), "v %g %g %g %g %g %g").encode()
    rest = _text(points[:, :2], "vt %g %g") + _text(points, "vn %g %g %g")
    yield (vertices + rest + _text(np.repeat(triangles + 1, 3, axis=1),
                                   "f %d/%d/%d %d/%d/%d %d/%d/%d")).encode()  # fmt: skip
    yield (
        "mtllib a.mtl\ng one\nusemtl red\n" + vertices + "f -1 -2 -3\nf 1 2 3 4 5\nl 1 2\n"
    ).encode()


def _whole_off(points, triangles):
    yield f"OFF\n12 0 0\n{_text(points)}".encode()
    faces = _text(triangles, "3 %d %d %d")
    yield f"OFF\n# a comment\n12 8 0\n{_text(points)}{faces}4 0 1 2 3\n".encode()
    yield f"COFF\n12 8 0\n{_text(points, '%g %g %g 255 0 10 255')}{faces}".encode()
    yield f"NOFF\n12 0 0\n{_text(np.hstack([points, points]), '%g ' * 6)}".encode()


def _whole_stl(points, triangles):
    corners = points[triangles]
    yield bytes(80) + struct.pack("<I", 8) + b"".join(
        struct.pack("<12fH", 0, 0, 1, *corner.ravel(), 0) for corner in corners
    )  # fmt: skip
    facet = "facet normal 0 0 1\nouter loop\n{}endloop\nendfacet\n"
    body = "".join(facet.format(_text(corner, "vertex %g %g %g")) for corner in corners)
    yield f"solid a\n{body}endsolid a\n".encode()


def _whole_xyz(points, triangles):
    yield _text(points).encode()
    yield ("# x y z\n" + _text(np.hstack([points, points]), "%g,%g,%g,%g,%g,%g")).encode()
    yield ("x;y;z\r\n" + _text(points, "%.6f;%.6e;%g\r")).encode()


def _whole_pts(points, triangles):
    yield f"12\n{_text(points)}".encode()
    yield f"12\n{_text(np.hstack([points, points]), '%g %g %g -1 %g %g %g')}".encode()
    yield (
        b"[Expe/PointSet/Binary/0.1]\nproperty position 12\nproperty radius 4\n"
        b"property color 4\nnofpoints 12\ndata\n" + points.astype("f4").tobytes() + bytes(96)
    )


def _whole_las(points, triangles):
    import io

    import laspy

    for version, form in (("1.2", 3), ("1.4", 7)):
        for packed in (False, True):
            header = laspy.LasHeader(version=version, point_format=form)
            header.scales = [1e-4] * 3
            header.creation_date = None
            header.add_extra_dims([laspy.ExtraBytesParams("deviation", "f4")])
            data = laspy.LasData(header)
            data.x, data.y, data.z = points.T
            stream = io.BytesIO()
            data.write(stream, do_compress=packed)
            yield stream.getvalue()


def _whole_mlx(points, triangles):
    from meshlab_filter.presets import folder

    for path in sorted(folder().glob("*.mlx")):
        yield path.read_bytes()


def _reader(form):
    """Return the function by which the product reads a format, and one that ends its process."""
    if form == "mlx":
        import pymeshlab

        from meshlab_filter.bridge.check import check_script
        from meshlab_filter.bridge.layer import add_layer
        from meshlab_filter.presets import open_script

        meshset = pymeshlab.MeshSet(verbose=False)
        points = np.random.default_rng(0).random((20, 3))
        add_layer(meshset, points, normals=points, quality=points[:, 0], colors=np.ones((20, 4)))
        return lambda path: check_script(meshset, open_script(path)), lambda: None
    from meshlab_filter.bridge.meshreader import MeshReader
    from meshlab_filter.cloud import read_cloud
    from meshlab_filter.textcloud import is_meshlab_points

    # As read_cloud does, but with one process for many files, and less patience.
    reader = MeshReader(seconds=3)
    if form in ("obj", "off", "stl"):
        return reader.read, reader.close
    return (
        lambda path: reader.read(path) if is_meshlab_points(path) else read_cloud(path),
        reader.close,
    )


def main():
    """Read damaged files of one format."""
    import resource

    form, count, seed = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    rng = np.random.default_rng(seed)
    (read, close), wholes = _reader(form), list(whole_files(form))
    for packed in wholes:
        assert packed, form
    resource.setrlimit(resource.RLIMIT_AS, (4 * MEMORY, resource.RLIM_INFINITY))
    suffixes = [f".{form}", ".laz"] if form == "las" else [f".{form}"]
    ended = {"result": 0, "sentence": 0, "crash": 0, "hang": 0, "slowest": 0.0}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        for number in range(count + len(wholes)):
            content = wholes[number % len(wholes)]
            file = path / f"scan{suffixes[number % len(wholes) % len(suffixes)]}"
            if number >= len(wholes):
                content = damaged(content, rng)
            file.write_bytes(content or b"\n")
            begun = time.monotonic()
            faulthandler.dump_traceback_later(HANG, exit=True)
            try:
                read(file)
                ended["result"] += 1
            except MeshlabFilterError as error:
                if "\n" in str(error) or number < len(wholes):
                    raise AssertionError("not one sentence, or a whole file") from error
                ended["sentence"] += 1
                ended["crash"] += "crashed" in str(error)
                ended["hang"] += "was not done" in str(error)
            except BaseException:
                Path(tempfile.gettempdir(), f"meshlab-filter-fuzz{file.suffix}").write_bytes(
                    content
                )
                raise
            faulthandler.cancel_dump_traceback_later()
            ended["slowest"] = max(ended["slowest"], time.monotonic() - begun)
    # What the process with MeshLab took is in no account before it has ended.
    close()
    who = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    ended["memory"] = 1024 * max(resource.getrusage(each).ru_maxrss for each in who)
    print(json.dumps(ended))


if __name__ == "__main__":
    main()
