"""Read the points of a scan, with normals if the file contains them.

open3d returns the readable part of a damaged file without an error. In PCD files it replaces
missing points by the content of uninitialised memory.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from polycube.errors import InputError, brief
from polycube.io.polygons.ply import is_points, read_columns
from polycube.surface.clouds.points import Cloud

NORMAL = ("nx", "ny", "nz")
PLACE = ("x", "y", "z")
PCD_NORMAL = ("normal_x", "normal_y", "normal_z")
RATIO = 88  # largest ratio of compression by LZF: 3 bytes for 264
KINDS = {"F": "f", "I": "i", "U": "u"}


def is_cloud(path: Path) -> bool:
    """Whether a file contains points only; decided by its suffix and, for PLY, by its header."""
    suffix = path.suffix.lower()
    if suffix == ".ply" and path.is_file():
        return is_points(path)
    return suffix in READERS and not path.is_dir()


def read_cloud(path: Path) -> Cloud:
    """Points of a file, unchanged.

    Raises InputError if the file is empty, damaged or of an unknown kind.
    """
    if not path.read_bytes().strip():
        raise InputError("the file is empty")
    return READERS[path.suffix.lower()](path)


def _read_ply(path: Path) -> Cloud:
    columns = read_columns(path)[0]
    points, normals = (
        np.array([columns.get(name, []) for name in names]).T for names in ("xyz", NORMAL)
    )
    return Cloud(points, normals if columns.keys() >= {*NORMAL} else np.zeros((0, 3)))


def _read_xyz(path: Path) -> Cloud:
    text = path.read_text(encoding="latin-1").replace(",", " ")
    try:
        rows = np.loadtxt(text.splitlines(), ndmin=2, usecols=(0, 1, 2))
    except ValueError as error:
        raise InputError(f"not a readable XYZ file: {brief(error)}") from None
    return Cloud(rows.reshape(-1, 3), np.zeros((0, 3)))


def read_pcd(path: Path) -> Cloud:
    """Points of a PCD file (text, binary or compressed), with normals if the file contains them.

    Raises InputError if the file is damaged or has no coordinates.
    """
    try:
        columns = _columns(path.read_bytes())
        normals = [columns[name] for name in PCD_NORMAL if name in columns]
        points = np.stack([columns[name] for name in PLACE], axis=1)
    except KeyError as error:
        raise InputError(f"not a readable PCD file: its header has no {error.args[0]}") from None
    except (ValueError, TypeError, ArithmeticError) as error:
        raise InputError(f"not a readable PCD file: {brief(error)}") from error
    return Cloud(points, np.stack(normals, axis=1) if len(normals) == 3 else np.zeros((0, 3)))


def _columns(data: bytes) -> Mapping[str, np.ndarray]:
    """(N,) values of each scalar field; ValueError if points are missing."""
    head, mark, rest = data.partition(b"\nDATA ")
    way, _, body = rest.partition(b"\n")
    rows = [line.split() for line in head.decode("latin-1").splitlines()]
    header = {row[0]: row[1:] for row in rows if row}
    number = int(header["POINTS"][0]) if mark else 0
    counts = [int(count) for count in header.get("COUNT", ["1"] * len(header["FIELDS"]))]
    kinds = [KINDS[kind] + size for kind, size in zip(header["TYPE"], header["SIZE"], strict=True)]
    fields = zip(header["FIELDS"], kinds, counts, strict=True)
    record = np.dtype([(name, f"<{kind}", (count,)) for name, kind, count in fields])
    readers: dict[bytes, Callable[..., Mapping[str, np.ndarray] | np.ndarray]]
    readers = {b"ascii": _text, b"binary": _records, b"binary_compressed": _compressed}
    if way.strip() not in readers:
        raise ValueError(f"unknown form of data {way[:20]!r}")
    found = readers[way.strip()](body, record, number)
    single = [name for name, count in zip(header["FIELDS"], counts, strict=True) if count == 1]
    return {name: found[name].reshape(number).astype(np.float64) for name in single}


def _text(body: bytes, record: np.dtype, number: int) -> np.ndarray:
    """Values of fields in text."""
    kinds = np.dtype([(name, "f8", record[name].shape) for name in record.names or ()])
    rows = np.zeros(0, kinds)
    if body.strip():
        rows = np.loadtxt(body.decode("latin-1").splitlines(), kinds, ndmin=1)
    if len(rows) != number:
        raise ValueError(f"it holds {len(rows)} of {number} points")
    return rows


def _records(body: bytes, record: np.dtype, number: int) -> np.ndarray:
    """Values of fields in binary records, one for each point."""
    available = len(body) // record.itemsize
    if available < number:
        raise ValueError(f"it ends after {available} of {number} points")
    return np.frombuffer(body, record, number)


def _compressed(body: bytes, record: np.dtype, number: int) -> Mapping[str, np.ndarray]:
    """Values of fields that are stored one after the other, compressed by LZF."""
    packed, size = np.frombuffer(body[:8].ljust(8, b"\0"), "<u4").tolist()
    is_complete = size == number * record.itemsize and 8 + packed <= len(body)
    is_complete &= size <= RATIO * packed
    values = np.frombuffer(_unpacked(body[8 : 8 + packed], size * is_complete), np.uint8)
    if not is_complete or len(values) != size:
        raise ValueError(f"its {len(body)} bytes do not hold {number} points")
    ends = np.cumsum([number * record[name].itemsize for name in record.names or ()])
    split = zip(record.names or (), np.split(values, ends[:-1]), strict=True)
    return {name: part.view(record[name].base) for name, part in split}


def _unpacked(data: bytes, size: int) -> bytearray:
    """Decompressed LZF stream of `size` bytes; fewer or more if it is damaged."""
    out, i = bytearray(), 0
    padded = data + bytes(2)
    while i < len(data):
        control, i = data[i], i + 1
        if control < 32:  # a literal run
            out += data[i : i + control + 1]
            i += control + 1
            continue
        length = (control >> 5) + 2  # a reference to earlier output
        if length == 9:
            length, i = length + padded[i], i + 1
        source = len(out) - ((control & 31) << 8) - padded[i] - 1
        i += 1
        if source < 0 or len(out) + length > size:
            break
        piece = out[source : source + length]  # source and target may overlap
        out += (piece * (length // len(piece) + 1))[:length]
    return out


READERS: dict[str, Callable[[Path], Cloud]] = {
    ".ply": _read_ply, ".pcd": read_pcd, ".xyz": _read_xyz,
}  # fmt: skip
