"""What LAS and LAZ files announce, held against their size before memory is reserved for it."""

from __future__ import annotations

import importlib
import struct
from pathlib import Path

from .errors import FileFormatError

# Nobody packs points a thousandfold; what takes so few bytes need not be doubted.
_PACKING, _SMALL = 1000, 2**24
_LASZIP_RECORD = 22204
# The compressor of points in layers, and the layers of each kind of item in a point (LASzip's
# source, laszip.hpp): points of format 6 and up, colours, colours with infrared, waves.
_LAYERED, _LAYERS, _EXTRA_BYTES = 3, {10: 9, 11: 1, 12: 2, 13: 1}, 14


def check_announced(path: Path) -> None:
    """Refuse a header that announces more than the file can hold: laspy goes through it all.

    ASPRS, LAS Specification 1.4 R15, table 3 (public header block).
    """
    with open(path, "rb") as file:
        header = file.read(375).ljust(375, b"\0")
    if not header.startswith(b"LASF"):
        raise FileFormatError(
            f"Not a whole LAS file: it does not begin with 'LASF'. Given: {path}."
        )
    size = path.stat().st_size
    offset, records = struct.unpack_from("<II", header, 96)
    counts = [(records, 54, "variable length records")]
    if header[25] >= 4:
        (extended,) = struct.unpack_from("<I", header, 243)
        counts.append((extended, 60, "extended variable length records"))
    (length,) = struct.unpack_from("<H", header, 105)
    (points,) = struct.unpack_from("<I", header, 107)
    if header[25] >= 4:
        (points,) = struct.unpack_from("<Q", header, 247)
    if header[104] & 0xC0:
        counts.append((_announced_chunks(path, offset), 1, "chunks of packed points"))
        _check_packing(path, points * length)
    else:
        counts.append((points, max(length, 20), "points"))
    for count, least, what in counts:
        if count * least > size:
            raise FileFormatError(
                f"The file is cut short: it announces {count} {what} and has {size} bytes. "
                f"Given: {path}."
            )
    if offset > size:
        raise FileFormatError(
            f"The file is cut short: its points begin at byte {offset} of {size}. Given: {path}."
        )


def _announced_chunks(path: Path, offset: int) -> int:
    """Return how many chunks the table of a packed file announces; memory is reserved for them.

    M. Isenburg, "LASzip: lossless compression of LiDAR data", PE&RS 79 (2013): the points begin
    with the place of the table, or with -1 if that stands at the end of the file.
    """
    with open(path, "rb") as file:
        file.seek(offset)
        (place,) = struct.unpack("<q", file.read(8).ljust(8, b"\0"))
        if place == -1:
            file.seek(-8, 2)
            (place,) = struct.unpack("<q", file.read(8))
        file.seek(max(0, place))
        _, chunks = struct.unpack("<II", file.read(8).ljust(8, b"\0"))
    return int(chunks)


def check_chunks(path: Path) -> None:
    """Refuse a packed file whose chunks are larger than it, or unpack to more than can be.

    Raises
    ------
    FileFormatError
        In one sentence; laspy and lazrs raise errors of their own for tables that are no tables.
    """
    laspy = importlib.import_module("laspy")
    with open(path, "rb") as file:
        header = laspy.LasHeader.read_from(file)
        if not header.are_points_compressed:
            return
        lazrs = importlib.import_module("lazrs")
        packing = [vlr for vlr in header.vlrs if vlr.record_id == _LASZIP_RECORD]
        if not packing:
            raise FileFormatError(
                f"The file may be damaged: it does not say how its points are packed. "
                f"Given: {path}."
            )
        file.seek(header.offset_to_point_data)
        chunks = lazrs.read_chunk_table(file, lazrs.LazVlr(packing[0].record_data))
        layers = _layers(packing[0].record_data)
        place = header.offset_to_point_data + 8
        for _, packed in chunks:
            # A chunk of layers: one point as it is, how many follow, the size of each layer.
            file.seek(place + header.point_format.size + 4)
            sizes = struct.unpack(f"<{layers}I", file.read(4 * layers).ljust(4 * layers, b"\0"))
            if sum(sizes) > packed:
                raise FileFormatError(
                    f"The file may be damaged: layers of its points are larger than the chunk "
                    f"they are in. Given: {path}."
                )
            place += packed
    if sum(packed for _, packed in chunks) > path.stat().st_size:
        raise FileFormatError(f"The file is cut short: its chunks go beyond it. Given: {path}.")
    # The last chunk is announced as full, and reserved as such.
    _check_packing(path, sum(points for points, _ in chunks) * header.point_format.size)


def _layers(packing: bytes) -> int:
    """Return how many layers a chunk has by the record that says how points are packed."""
    compressor, items = struct.unpack_from("<H30xH", packing.ljust(34, b"\0"))
    if compressor != _LAYERED:
        return 0
    layers = 0
    for kind, size, _ in struct.iter_unpack("<3H", packing[34 : 34 + 6 * items]):
        layers += size if kind == _EXTRA_BYTES else _LAYERS.get(kind, 0)
    return layers


def _check_packing(path: Path, unpacked: int) -> None:
    size = path.stat().st_size
    if unpacked > _PACKING * size + _SMALL:
        raise FileFormatError(
            f"The file may be damaged: its points would take {unpacked} bytes and it has {size}. "
            f"Given: {path}."
        )
