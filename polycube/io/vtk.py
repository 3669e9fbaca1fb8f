"""Files for ParaView and PyVista: the XML formats of VTK, compressed by zlib.

They are written without the VTK library, so results can be written without it, and equal data give
equal bytes. Lengths are in model units, those of the polycube in cells.

Files without Bezier cells are XML with base64 data, which other programs can read. Files with
Bezier cells, which only VTK reads, have binary data appended to the XML and are a quarter smaller.
Arrays are compressed in sequence while they are written, so the memory does not grow with them.
"""

import base64
import shutil
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO
from xml.sax.saxutils import quoteattr

import numpy as np

from polycube.hexmesh.connectivity import PLACES, quad_sides
from polycube.hexmesh.metrics import metrics
from polycube.io.atomic import atomic_write
from polycube.structure.lattice import cell_of_box
from polycube.types import HexMesh, Labels, Polycube, TriMesh

HEXAHEDRON, BEZIER_HEXAHEDRON, LAGRANGE_HEXAHEDRON = 12, 79, 72  # cell types of VTK
BLOCK = 1 << 20  # bytes compressed together
LEVEL = 3  # level of zlib: higher ones are slower and hardly better
_TYPES = {"i": "Int", "u": "UInt", "f": "Float"}

Arrays = Mapping[str, np.ndarray]


def write_hex_vtu(
    path: Path, hexes: HexMesh, context: Sequence[str | None] = (), point_data: Arrays | None = None
) -> Path:
    """Write the hex mesh with its measures and sets, and the grid cell and primitive of each hex.

    context : primitive per grid cell, as in `Polycube.context`; empty if it is unknown
    point_data : more arrays (V,) or (V, 3)
    """
    boundary = np.zeros(len(hexes.vertices), np.uint8)
    boundary[hexes.quads] = 1
    at_vertices, at_hexes = set_arrays(hexes)
    points = {"boundary": boundary, **(point_data or {}), **at_vertices}
    cell_data = {**metrics(hexes.vertices, hexes.hexes), "cell": hexes.cell, **at_hexes}
    comment = ""
    if context:
        names, primitive = numbered_primitives(context)
        cell_data["primitive"] = primitive[hexes.cell]
        comment = _legend(names)
    return write_cells(path, hexes.vertices, hexes.hexes, HEXAHEDRON, points, cell_data, comment)


def write_polycube_vtu(path: Path, polycube: Polycube) -> Path:
    """Write one hexahedron per occupied box, with its grid cell and primitive."""
    corners = np.argwhere(polycube.occupancy)[:, None] + PLACES  # (C, 8, 3) indices of the knots
    used, hexes = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    knots = zip(polycube.knots, used.T, strict=True)
    points = np.stack([own[index] for own, index in knots], axis=1)
    cell = cell_of_box(polycube)
    names, primitive = numbered_primitives(polycube.context)
    arrays = {"cell": cell, "primitive": primitive[cell]}
    return write_cells(path, points, hexes.reshape(-1, 8), HEXAHEDRON, {}, arrays, _legend(names))


def write_labels_vtp(path: Path, surface: TriMesh, labels: Labels) -> Path:
    """Write the input surface with the axis (0..5 = +x -x +y -y +z -z) and patch of each face."""
    arrays = {"axis": labels.axis, "patch": labels.patch}
    return _write_polydata(path, surface.vertices, {"Polys": surface.faces}, arrays)


def write_named_vtp(
    path: Path, points: np.ndarray, items: Mapping[str, np.ndarray], array: str
) -> Path:
    """Write vertices (N, 1), edges (N, 2) and faces (N, 3) by name; `array` numbers the names.

    A comment in the file explains the numbers.
    """
    polygons, number = {}, [np.empty(0, np.int64)]
    for width, tag in enumerate(("Verts", "Lines", "Polys"), start=1):
        own = [(i, rows) for i, rows in enumerate(items.values()) if rows.shape[1] == width]
        polygons[tag] = np.concatenate([np.empty((0, width), int), *(rows for _, rows in own)])
        number += [np.full(len(rows), i) for i, rows in own]
    comment = _legend(list(items), array)
    return _write_polydata(path, points, polygons, {array: np.concatenate(number)}, comment)


def _write_polydata(
    path: Path, points: np.ndarray, cells: Arrays, cell_data: Arrays, comment: str = ""
) -> Path:
    """Write cells (N, K) of points by the name of their section."""
    sections: dict[str, Arrays] = {"CellData": cell_data, "Points": {"points": points}}
    counts = [f'NumberOfPoints="{len(points)}"']
    for tag, own in cells.items():
        offsets = own.shape[1] * np.arange(1, len(own) + 1)
        sections[tag] = {"connectivity": own.ravel(), "offsets": offsets}
        counts.append(f'NumberOf{tag}="{len(own)}"')
    return _write(path, "PolyData", " ".join(counts), sections, comment)


def write_cells(
    path: Path,
    points: np.ndarray,
    cells: np.ndarray,
    cell_type: int,
    point_data: Arrays,
    cell_data: Arrays,
    comment: str = "",
) -> Path:
    """Write an unstructured grid of cells (E, K) of one VTK type with points (N, 3)."""
    offsets = np.arange(1, len(cells) + 1) * cells.shape[1]
    types = np.full(len(cells), cell_type, np.uint8)
    sections = {
        "PointData": point_data,
        "CellData": cell_data,
        "Points": {"points": points},
        "Cells": {"connectivity": cells.ravel(), "offsets": offsets, "types": types},
    }
    counts = f'NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}"'
    # 2.1: the current order of its points
    version = "2.1" if cell_type == BEZIER_HEXAHEDRON else "1.0"
    return _write(path, "UnstructuredGrid", counts, sections, comment, version)


def set_arrays(hexes: HexMesh) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Arrays of the named sets of the boundary, except patches.

    Returns (V,) 1 on the quads of the set or on the named edge, and (H,) the sum of 1, 2, 4, 8, 16,
    32 for the faces -xi +xi -eta +eta -zeta +zeta of each hex in the set; uint8.
    """
    owner, side = quad_sides(hexes)
    quads = {name: own for name, own in hexes.sets.items() if not name.startswith("patch_")}
    nodes = dict(hexes.node_sets) | {name: hexes.quads[own] for name, own in quads.items()}
    every, n_hexes = np.arange(len(hexes.vertices)), len(hexes.hexes)
    sums = {name: np.bincount(owner[q], 1 << side[q], n_hexes) for name, q in quads.items()}
    at_hexes = {name: own.astype(np.uint8) for name, own in sums.items()}
    return {name: np.isin(every, own).astype(np.uint8) for name, own in nodes.items()}, at_hexes


def numbered_primitives(context: Sequence[str | None]) -> tuple[list[str], np.ndarray]:
    """Primitive names, sorted, and the number of the primitive of each grid cell (-1 if empty)."""
    names = sorted({name for name in context if name})
    return names, np.array([names.index(name) if name else -1 for name in context])


def _legend(names: Sequence[str], array: str = "primitive") -> str:
    """Explain the numbers of an array; string arrays cannot be read by meshio and others."""
    return f"<!-- {array}: {', '.join(f'{i} {name}' for i, name in enumerate(names))} -->\n"


def _write(
    path: Path,
    dataset: str,
    counts: str,
    sections: Mapping[str, Arrays],
    comment: str = "",
    version: str = "1.0",  # supported by most other readers
) -> Path:
    has_bezier = version != "1.0"
    with atomic_write(path) as temporary, open(temporary, "wb") as file, TemporaryFile() as data:
        file.write(
            f'<?xml version="1.0"?>\n{comment}'
            f'<VTKFile type="{dataset}" version="{version}" byte_order="LittleEndian" '
            'header_type="UInt64" compressor="vtkZLibDataCompressor">\n'
            f"<{dataset}>\n<Piece {counts}>\n".encode()
        )
        for tag, arrays in sections.items():
            file.write(f"<{tag}>\n".encode())
            for name, array in arrays.items():
                file.write(_array(name, np.asarray(array), data if has_bezier else None))
            file.write(f"</{tag}>\n".encode())
        file.write(f"</Piece>\n</{dataset}>\n".encode())
        if has_bezier:
            data.seek(0)
            file.write(b'<AppendedData encoding="raw">\n_')
            shutil.copyfileobj(data, file)
            file.write(b"\n</AppendedData>\n")
        file.write(b"</VTKFile>\n")
    return Path(path)


def _array(name: str, array: np.ndarray, data: IO[bytes] | None) -> bytes:
    """The XML element of an array; its content is appended to `data` or included as base64."""
    if array.dtype == bool:
        array = array.astype(np.uint8)
    width = array.shape[1] if array.ndim > 1 else 1
    little = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
    parts = _compressed(little.reshape(-1).view(np.uint8).data)
    if data is None:
        end = b' format="binary">' + b"".join(map(base64.b64encode, parts)) + b"</DataArray>\n"
    else:
        end = f' format="appended" offset="{data.tell()}"/>\n'.encode()
        data.writelines(parts)
    return (
        f'<DataArray type="{_TYPES[array.dtype.kind]}{8 * array.itemsize}" Name={quoteattr(name)} '
        f'NumberOfComponents="{width}"'
    ).encode() + end


def _compressed(content: memoryview) -> tuple[bytes, bytes]:
    """Header and blocks of compressed data.

    The header has the number of blocks, the size of a block, the size of the last block if it is
    smaller, and the compressed sizes.
    """
    starts = range(0, len(content), BLOCK)
    blocks = [zlib.compress(content[start : start + BLOCK], LEVEL) for start in starts]
    head = [len(blocks), BLOCK, len(content) % BLOCK, *map(len, blocks)]
    return np.array(head, "<u8").tobytes(), b"".join(blocks)
