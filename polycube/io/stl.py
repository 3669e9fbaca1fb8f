"""Read STL files, binary and ASCII, with checks of structure; write binary ones by trimesh."""

import re
from pathlib import Path

import numpy as np

from polycube.errors import InputError, brief
from polycube.io.atomic import atomic_write
from polycube.io.polygons.division import Soup

HEADER, RECORD = 84, 50  # bytes: 80 of text and a count; a triangle
LINE = re.IGNORECASE | re.MULTILINE
VERTEX = re.compile(rb"^[ \t]*vertex[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)[ \t\r]*$", LINE)
FACET = re.compile(rb"^[ \t]*(end)?facet\b", LINE)
END = re.compile(rb"^[ \t]*endsolid\b", LINE)


def read_stl(path: Path) -> Soup:
    """Corners (3 F, 3), not merged, and faces (F, 3); raises InputError with one sentence."""
    data = path.read_bytes()
    if not data:
        raise InputError("the file is empty")
    count = int.from_bytes(data[80:HEADER], "little")
    number, spare = divmod(len(data) - HEADER, RECORD)
    notes: tuple[str, ...] = ()
    is_text = False
    if count == 0 and number > 0 and spare == 0 and b"\0" in data:
        notes = (f"its header gives 0 triangles; its size gives {number}, which were read",)
    elif 0 < count <= number:
        number, spare = count, len(data) - HEADER - RECORD * count
        if spare:
            notes = (f"ignored bytes after the last of {count} triangles: {spare}",)
    else:
        is_text = (count, number, spare) != (0, 0, 0)
    # by its size: a binary file may begin with "solid" too
    corners = _text(data, count) if is_text else _binary(data, number)
    return Soup(corners, np.arange(len(corners)).reshape(-1, 3), notes)


def _text(data: bytes, count: int) -> np.ndarray:
    """Read a file that is not a complete binary one, whose header would give `count` triangles."""
    if b"\0" in data:
        has = f"its {len(data)} bytes contain {max(len(data) - HEADER, 0) // RECORD}"
        raise InputError(f"not a complete STL file: its header gives {count} triangles, but {has}")
    if data.lstrip()[:5].lower() != b"solid":
        raise InputError("not an STL file: neither binary, nor text that begins with 'solid'")
    vertices = VERTEX.findall(data)
    ends = [bool(end) for end in FACET.findall(data)]
    n_facets = ends.count(True)
    if not END.search(data) or len(ends) != 2 * n_facets or len(vertices) != 3 * n_facets:
        raise InputError(
            f"not a complete STL file: it ends after {len(vertices)} vertices of "
            f"{len(ends) - n_facets} facets; each needs three, 'endfacet', and 'endsolid' last"
        )
    try:
        return np.array(vertices, dtype=np.float64).reshape(-1, 3)
    except ValueError as error:
        what = f"not an STL file: a coordinate is not a number ({brief(error)})"
        raise InputError(what) from None


def write_stl(path: Path, vertices: np.ndarray, faces: np.ndarray) -> Path:
    """Write a binary STL file in single precision, as required by the format."""
    from trimesh import Trimesh

    with atomic_write(path) as temporary:
        Trimesh(vertices, faces, process=False).export(temporary, file_type="stl")
    return Path(path)


def _binary(data: bytes, number: int) -> np.ndarray:
    records = np.frombuffer(data, np.uint8, RECORD * number, HEADER).reshape(-1, RECORD)
    floats = np.ascontiguousarray(records[:, 12:48]).view("<f4")  # behind the normal
    with np.errstate(invalid="ignore"):  # signalling NaN
        return floats.reshape(-1, 3).astype(np.float64)
