"""Read PLY files by plyfile: columns of the vertices, and polygons."""

import re
from pathlib import Path

import numpy as np
from plyfile import PlyData, PlyParseError

from polycube.errors import InputError, brief
from polycube.io.polygons.division import Soup, triangulated

HEADER = 100_000  # largest size of the header, in bytes
NUMBER = re.compile(rb"^element\s+(\w+)\s+0*([1-9]\d*)\s*$", re.MULTILINE)
CORNERS = ("vertex_indices", "vertex_index")
TRIANGLES = {"face": dict.fromkeys(CORNERS, 3)}  # read at once, other polygons one by one
LARGEST = 2**31  # of vertex numbers


def is_points(path: Path) -> bool:
    """Whether the header has vertices, but no faces."""
    numbers = _numbers(path)
    return b"vertex" in numbers and b"face" not in numbers


def read_ply(path: Path) -> Soup:
    """Vertices and faces, polygons divided; raises InputError with one sentence."""
    columns, corners, sizes = read_columns(path)
    return triangulated(np.stack([columns[axis] for axis in "xyz"], axis=1), corners, sizes)


def read_columns(path: Path) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Columns (V,) of the vertices by name, (N,) corners and (P,) sizes of all polygons.

    Raises InputError if the file is damaged, or has no coordinates.
    """
    if not path.stat().st_size:
        raise InputError("the file is empty")
    try:
        if sum(map(int, _numbers(path).values())) > path.stat().st_size:
            raise ValueError("its header states more elements than the file has bytes")
        found = {element.name: element.data for element in _parsed(path)}
        vertices = found.get("vertex", np.zeros(0, []))
        names = vertices.dtype.names or ()
        if not {*names} >= {*"xyz"}:
            raise ValueError("its vertices have no x, y and z")
        columns = {name: vertices[name].astype(np.float64) for name in names}
        faces = found.get("face", np.zeros(0, []))
        rings = next((list(faces[name]) for name in CORNERS if name in faces.dtype.names), [])
        sizes = np.array([len(ring) for ring in rings], np.int64)
        corners = np.concatenate([np.zeros(0, np.int64), *rings])
        if not ((np.abs(corners) < LARGEST) & (corners == np.floor(corners))).all():
            raise ValueError("the number of a corner is not a whole number")
        return columns, corners.astype(np.int64), sizes
    except (PlyParseError, ValueError, LookupError, OverflowError, MemoryError) as error:
        raise InputError(f"not a readable PLY file: {brief(error)}") from None


def _numbers(path: Path) -> dict[bytes, bytes]:
    """Number of elements of each name that the header states, in decimal digits, if not zero."""
    with path.open("rb") as file:
        head, mark, _ = file.read(HEADER).partition(b"end_header")
    return dict(NUMBER.findall(head)) if mark else {}


def _parsed(path: Path) -> PlyData:
    try:
        return PlyData.read(str(path), known_list_len=TRIANGLES)
    except PlyParseError:
        return PlyData.read(str(path))
