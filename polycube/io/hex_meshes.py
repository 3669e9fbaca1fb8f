"""Read a hex mesh of another program, and check that it bounds one solid.

Coordinates are not changed. Changes are reported: vertices merged or removed, hexes renumbered.
Remaining defects raise an error; they are not patched.
"""

import logging
import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from polycube.errors import InputError
from polycube.hexmesh import connectivity
from polycube.hexmesh.quality import triangles
from polycube.io.access.reading import reading
from polycube.io.decks import read_deck
from polycube.io.foreign.process import parsed
from polycube.surface.checks import check_surface
from polycube.surface.measures import connected, diagonal, unit
from polycube.types import HexMesh, TriMesh

logger = logging.getLogger(__name__)

DECKS = (".inp", ".bdf", ".nas")
FORMATS = (".vtu", ".vtk", ".mesh", ".msh", *DECKS)
FLAT = re.compile(r"(vertex|line|triangle|quad)\d*")  # cells that are ignored
SHARP = np.pi / 4  # angle between the normals of quads of different patches
MIRRORED = [4, 5, 6, 7, 0, 1, 2, 3]
# numbering with xi fastest, then eta, then zeta, as in some programs
BY_AXES = [0, 1, 3, 2, 4, 5, 7, 6]
APART = 0.1  # of the diagonal: boxes of mesh and surface that differ more do not belong to one part


def read_hexes(path: str | Path) -> tuple[HexMesh, list[str]]:
    """Conforming hex mesh with patches between sharp edges, and a list of the changes.

    Raises InputError with one sentence for an unusable mesh.
    """
    path = Path(path)
    with reading(path):
        *parts, read = _parsed(path)
        mesh, notes = tidy(*parts)
        notes = [*read, *notes]
    logger.info("%s: %d vertices, %d hexes", path, len(mesh.vertices), len(mesh.hexes))
    return mesh, notes


def _parsed(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[str]]:
    """Points (V, 3), hexes (H, 8), the array `cell` (H,), zeros if there is none, and notes."""
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"unknown kind of hex mesh {path.suffix!r}; can read {', '.join(FORMATS)}")
    found = read_deck(path) if path.suffix.lower() in DECKS else parsed(path, "meshio")
    kinds: Counter[str] = Counter()
    for kind, number in zip(found["kind"].tolist(), found["number"].tolist(), strict=True):
        kinds[kind.lower().removeprefix("vtk_lagrange_")] += number
    kinds = +kinds  # without those with count zero
    solids = {kind: number for kind, number in kinds.items() if not FLAT.fullmatch(kind)}
    if not solids or not all(kind.startswith("hexahedron") for kind in solids):
        had = ", ".join(f"{n} {kind}" for kind, n in kinds.items()) or "no cells"
        raise InputError(f"only meshes of hexahedra can be improved; it has {had}")
    curved = sum(number for kind, number in solids.items() if kind != "hexahedron")
    note = f"only the corners of hexes with more than 8 nodes are read: {curved}"
    points = found["points"]
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind not in "fiu":
        raise InputError("its points do not have three coordinates")
    blocks = _in_blocks(found, "hexes")
    if any(block.ndim != 2 or block.shape[1] != 8 for block in blocks):
        raise InputError("it has hexahedra without 8 corners")
    hexes = np.concatenate(blocks)
    if hexes.dtype.kind not in "iu":
        raise InputError("the corners of its hexahedra are not whole numbers")
    cell = np.concatenate([np.zeros(0, np.int64), *_in_blocks(found, "cell")])
    is_known = len(cell) == len(hexes) and cell.dtype.kind in "iu" and cell.min() >= 0
    return points, hexes, cell if is_known else np.zeros(len(hexes), int), [note] * bool(curved)


def _in_blocks(found: Mapping[str, np.ndarray], name: str) -> list[np.ndarray]:
    """The arrays with a name, of all blocks of cells that have one, in sequence."""
    every = (found.get(f"{name} {i}") for i in range(len(found["kind"])))
    return [array for array in every if array is not None]


def tidy(vertices: np.ndarray, hexes: np.ndarray, cell: np.ndarray) -> tuple[HexMesh, list[str]]:
    """Mesh of one solid in the vertex order of VTK, and one sentence for each change."""
    vertices, hexes = np.asarray(vertices, np.float64), np.asarray(hexes, np.int64)
    if not np.isfinite(vertices).all():
        raise InputError("coordinates must be finite numbers")
    if hexes.min() < 0 or hexes.max() >= len(vertices):
        raise InputError(f"a hex refers to vertex {hexes.max()}; there are {len(vertices)}")
    vertices, hexes, notes = _welded(vertices, hexes)
    hexes, cell, done = _distinct(hexes, cell)
    hexes, numbered = _in_order(vertices, hexes)
    hexes, turned = _oriented(vertices, hexes)
    mesh = connectivity.hex_mesh(vertices, hexes, cell=cell)
    try:
        connectivity.check_conforming(mesh)
    except ValueError as error:
        raise InputError(f"the hexes do not meet in whole faces: {error}") from None
    check_surface(boundary(mesh))
    mesh = connectivity.hex_mesh(vertices, hexes, mesh.quads, patches(mesh), cell)
    return mesh, notes + done + numbered + turned


def _welded(vertices: np.ndarray, hexes: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """The used vertices without duplicates, in their order."""
    used, local = np.unique(hexes, return_inverse=True)
    _, first, group = np.unique(vertices[used], axis=0, return_index=True, return_inverse=True)
    first_ones = np.sort(first)
    number = np.searchsorted(first_ones, first)[group.ravel()]
    notes = []
    if len(used) < len(vertices):
        notes.append(f"removed vertices that no hex uses: {len(vertices) - len(used)}")
    if len(first_ones) < len(used):
        notes.append(f"welded vertices at the same place: {len(used) - len(first_ones)}")
    return vertices[used][first_ones], number[local.reshape(hexes.shape)], notes


def _distinct(hexes: np.ndarray, cell: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[str]]:
    ordered = np.sort(hexes, axis=1)
    collapsed = (np.diff(ordered, axis=1) == 0).any(axis=1)
    if collapsed.any():
        what = f"{collapsed.sum()} hexes have two equal corners, the first is number"
        remedy = "wedges and pyramids cannot be improved"
        raise InputError(f"{what} {collapsed.argmax()}", remedy=remedy)
    distinct = np.sort(np.unique(ordered, axis=0, return_index=True)[1])
    extra = len(hexes) - len(distinct)
    return hexes[distinct], cell[distinct], [f"removed duplicate hexes: {extra}"] if extra else []


def _in_order(vertices: np.ndarray, hexes: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Corners in VTK's order; converted from the order of the axes if most hexes have that."""
    plain, by_axes = (_untwisted(vertices, h) for h in (hexes, hexes[:, BY_AXES]))
    if 2 * plain.sum() >= len(hexes) or by_axes.sum() <= plain.sum():
        return hexes, []
    note = "renumbered the corners of all hexes: they were in lexicographic order"
    return hexes[:, BY_AXES], [note]


def _untwisted(vertices: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """(H,) whether the corners are all right-handed, or all left-handed."""
    corners = vertices[hexes]
    edges = corners[:, connectivity.CORNERS[:, 1:]] - corners[:, connectivity.CORNERS[:, :1]]
    return np.abs(np.sign(np.linalg.det(edges)).sum(axis=1)) == 8


def _oriented(vertices: np.ndarray, hexes: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Mirror the numbering of hexes so that neighbours agree and the volume is positive.

    Each hex has two nodes, for the given and the mirrored numbering; neighbours with compatible
    numberings link equal nodes.
    """
    n = len(hexes)
    first, second = connectivity.neighbours(hexes)
    faces = hexes[:, connectivity.FACES].reshape(-1, 4)
    a, b = faces[first], faces[second]
    at = (b == a[:, :1]).argmax(axis=1)
    row = np.arange(len(a))
    opposite = b[row, (at + 3) % 4] == a[:, 1]
    equal = b[row, (at + 1) % 4] == a[:, 1]
    if not (opposite | equal).all():
        where = (~(opposite | equal)).argmax()
        share = "share the corners of a face, but not its edges: the vertex order is not VTK's"
        raise InputError(f"hexes {first[where] // 6} and {second[where] // 6} {share}")
    f, g = first // 6, second // 6
    left, right = np.where(opposite, g, n + g), np.where(opposite, n + g, g)
    side = connected(np.append(f, n + f), np.append(left, right), 2 * n)
    pieces = len(np.unique(np.minimum(side[:n], side[n:])))
    if pieces > 1:
        what = f"its hexes are {pieces} pieces that share no whole face"
        raise InputError(what, remedy="give one solid whose hexes meet in whole faces")
    if (side[:n] == side[n:]).any():
        raise InputError("the hexes cannot be oriented: they do not form a solid")
    turn = side[:n] != side[0]
    turned = np.where(turn[:, None], hexes[:, MIRRORED], hexes)
    corners = triangles(vertices - vertices.mean(axis=0), connectivity.boundary_quads(turned))
    if np.linalg.det(corners).sum() < 0:  # six times the volume
        turn = ~turn
        turned = turned[:, MIRRORED]
    if not turn.any():
        return hexes, []
    which = "all hexes: they were mirrored" if turn.all() else f"mirrored hexes: {turn.sum()}"
    return turned, [f"renumbered {which}"]


def patches(mesh: HexMesh, angle: float = SHARP) -> np.ndarray:
    """(Q,) parts of the boundary between edges that turn by more than `angle` radians."""
    _, pair = connectivity.quad_edges(mesh.quads)
    corners = mesh.vertices[mesh.quads]
    normals = unit(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]))
    turn = np.einsum("ed,ed->e", normals[pair[:, 0]], normals[pair[:, 1]])
    smooth = pair[turn >= np.cos(angle)]
    return connected(smooth[:, 0], smooth[:, 1], len(mesh.quads))


def boundary(mesh: HexMesh) -> TriMesh:
    """The boundary as a surface: four triangles of each quad, around its centre."""
    outer, quads = np.unique(mesh.quads, return_inverse=True)
    quads = quads.reshape(-1, 4)
    middle = len(outer) + np.tile(np.arange(len(quads)), 4)
    faces = np.column_stack([quads.T.ravel(), np.roll(quads, -1, axis=1).T.ravel(), middle])
    corners = mesh.vertices[outer]
    return TriMesh(np.concatenate([corners, corners[quads].mean(axis=1)]), faces)


def check_place(mesh: HexMesh, surface: TriMesh) -> None:
    """Raise InputError unless mesh and surface have the same position and size."""
    boxes = [(p.min(axis=0), p.max(axis=0)) for p in (mesh.vertices, surface.vertices)]
    size = diagonal(surface)
    if max(np.linalg.norm(a - b) for a, b in zip(*boxes, strict=True)) <= APART * size:
        return
    ratio = float(np.linalg.norm(boxes[0][1] - boxes[0][0]) / size)
    extents = [" to ".join("({:.4g}, {:.4g}, {:.4g})".format(*end) for end in box) for box in boxes]
    what = "placement" if 0.8 < ratio < 1.25 else f"units: it is {ratio:.3g} times as large"
    apart = f"does not lie where the surface is, from {extents[1]}"
    remedy = f"give both in the same {what}"
    raise InputError(f"the hex mesh, from {extents[0]}, {apart}", remedy=remedy)
