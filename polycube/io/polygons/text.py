"""Read the vertices and faces of OFF and OBJ files in text; the rest is ignored.

trimesh accepts some damaged files, and its errors do not give the line.
"""

import re
from pathlib import Path

import numpy as np

from polycube.errors import InputError, brief
from polycube.io.polygons.division import Soup, triangulated

HEAD = re.compile(r"\s*(?:ST)?C?N?OFF\b(?!\s*BINARY)")  # with colours, normals, texture
LARGEST = 2**31 - 1  # largest vertex index


def read_off(path: Path) -> Soup:
    """Vertices and faces of an OFF file, polygons divided; raises InputError with one sentence."""
    text = path.read_text(encoding="latin-1")
    head = HEAD.match(text)
    if not head:
        raise InputError("not an OFF file in text: it does not begin with OFF")
    rows = [line.partition("#")[0].split() for line in text[head.end() :].splitlines()]
    rows = [row for row in rows if row]
    try:
        n_vertices, n_faces = map(int, rows[0][:2])
        if min(n_vertices, n_faces) < 0 or len(rows) <= n_vertices + n_faces:
            stated = brief(f"{n_vertices} vertices and {n_faces} faces")
            what = f"{stated} are in its first line, but {len(rows) - 1} lines follow"
            raise InputError(f"not a complete OFF file: {what}")
        vertices = np.array([row[:3] for row in rows[1 : n_vertices + 1]], np.float64)
        faces = rows[n_vertices + 1 : n_vertices + n_faces + 1]
        sizes = np.array([int(row[0]) for row in faces], np.int64)
        own = [row[1 : max(0, size) + 1] for row, size in zip(faces, sizes.tolist(), strict=True)]
        if any(len(row) != size for row, size in zip(own, sizes.tolist(), strict=True)):
            raise ValueError("a line of a face has fewer corners than it says")
        corners = np.array([int(corner) for row in own for corner in row], np.int64)
        return triangulated(vertices.reshape(-1, 3), corners, sizes)
    except (LookupError, ValueError, OverflowError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"not a readable OFF file: {brief(error)}") from None


def read_obj(path: Path) -> Soup:
    """Vertices and faces of an OBJ file, polygons divided; raises InputError with the line."""
    vertices: list[list[float]] = []
    corners: list[int] = []
    sizes: list[int] = []
    text = path.read_text(encoding="latin-1").replace("\\\n", " ")
    for number, line in enumerate(text.splitlines(), start=1):
        fields = line.split()
        try:
            if fields[:1] == ["v"]:
                x, y, z = fields[1:4]
                vertices.append([float(x), float(y), float(z)])
            elif fields[:1] == ["f"]:
                indices = (int(field.split("/", 1)[0]) for field in fields[1:])
                corners += [_vertex(index, len(vertices)) for index in indices]
                sizes.append(len(fields) - 1)
        except ValueError as error:
            raise InputError(f"line {number}, {line.strip()[:60]!r}: {brief(error)}") from None
    points = np.array(vertices).reshape(-1, 3)
    return triangulated(points, np.array(corners, np.int64), np.array(sizes, np.int64))


def _vertex(index: int, n_vertices: int) -> int:
    """Convert an index: counted from 1, or negative and counted back from the last vertex."""
    if index > LARGEST:
        raise ValueError(f"vertex index larger than {LARGEST}")
    if index == 0:
        raise ValueError("vertex index 0; OBJ counts vertices from 1")
    if index < -n_vertices:
        raise ValueError(f"vertex index {index} is before the first of {n_vertices}")
    return index - 1 if index > 0 else n_vertices + index
