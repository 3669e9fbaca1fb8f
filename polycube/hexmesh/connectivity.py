"""Connectivity of a hex mesh: boundary, edges, valences, extraordinary edges, checks, octree.

Local numbering is that of VTK (see `polycube.types.HexMesh`). A face is exposed if it belongs to
only one hex; the boundary consists of the exposed faces, counter-clockwise from outside.
"""

from dataclasses import replace

import numpy as np

from polycube.surface.measures import components, euler, fans, half_edges
from polycube.types import HexMesh

# position of each corner in the unit cube (xi, eta, zeta)
PLACES = np.reshape(
    [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1], (8, 3)
)
# each corner and the ends of its three edges, right-handed
CORNERS = np.array(
    [
        [0, 1, 3, 4],
        [1, 2, 0, 5],
        [2, 3, 1, 6],
        [3, 0, 2, 7],
        [4, 7, 5, 0],
        [5, 4, 6, 1],
        [6, 5, 7, 2],
        [7, 6, 4, 3],
    ]
)
# -xi, +xi, -eta, +eta, -zeta, +zeta, counter-clockwise from outside
FACES = np.array(
    [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]]
)
# four edges each along xi, eta and zeta, in ascending direction
EDGES = np.reshape(
    [0, 1, 3, 2, 4, 5, 7, 6, 0, 3, 1, 2, 4, 7, 5, 6, 0, 4, 1, 5, 2, 6, 3, 7], (12, 2)
)
GRID = np.stack(np.meshgrid(*[range(3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)  # (27, 3)
# the corners whose mean is each of the 27 points; the same point may have several numbers
_PARENTS = [np.flatnonzero(((place == 1) | (2 * PLACES == place)).all(axis=1)) for place in GRID]
CHILDREN = (PLACES[:, None] + PLACES) @ [9, 3, 1]  # (8, 8) points of the corners of each child


def hex_mesh(
    vertices: np.ndarray,
    hexes: np.ndarray,
    quads: np.ndarray | None = None,
    patch: np.ndarray | None = None,
    cell: np.ndarray | None = None,
) -> HexMesh:
    """Make a hex mesh; missing arguments default to all boundary quads, patch 0 and cell 0.

    vertices : (V, 3), hexes : (H, 8), quads : (Q, 4), patch : (Q,), cell : (H,)
    """
    hexes = np.asarray(hexes)
    quads = boundary_quads(hexes) if quads is None else quads
    patch = np.zeros(len(quads), np.int64) if patch is None else patch
    cell = np.zeros(len(hexes), np.int64) if cell is None else cell
    return HexMesh(vertices, hexes, quads, patch, cell)


def boundary_quads(hexes: np.ndarray) -> np.ndarray:
    """(Q, 4) faces of only one hex, counter-clockwise from outside, in the order of the hexes."""
    return exposed(hexes)[0]


def exposed(hexes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Boundary quads (Q, 4) and the hex of each (Q,)."""
    faces = hexes[:, FACES].reshape(-1, 4)
    _, inverse, count = unique_rows(np.sort(faces, axis=1))
    single = np.flatnonzero(count[inverse] == 1)
    return faces[single], single // 6


def quad_sides(mesh: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    """The hex of each boundary quad (Q,), and its number in FACES (Q,)."""
    faces = mesh.hexes[:, FACES].reshape(-1, 4)
    return np.divmod(label_of(mesh.quads, faces, np.arange(len(faces))), 6)


def on_faces(mesh: HexMesh, values: np.ndarray) -> np.ndarray:
    """(H, 6) value of the boundary quad (Q,) at each face of a hex; -1 inside."""
    found = np.full((len(mesh.hexes), 6), -1, values.dtype)
    found[quad_sides(mesh)] = values
    return found


def label_of(rows: np.ndarray, known: np.ndarray, label: np.ndarray) -> np.ndarray:
    """(N,) label of the known row with the same vertices in any order; 0 if there is none."""
    _, number, _ = unique_rows(np.sort(np.concatenate([known, rows]), axis=1))
    table = np.zeros(number.max() + 1, np.int64)
    table[number[: len(known)]] = label
    return table[number[len(known) :]]


def part(mesh: HexMesh, elements: np.ndarray, sides: np.ndarray) -> tuple[HexMesh, np.ndarray]:
    """Extract hexes (E,) of a mesh with their boundary quads, and the used vertices (V',),
    ascending; without CAD faces and sets.

    sides : (Q, 2) hex and local face of each boundary quad of the mesh
    """
    used, hexes = np.unique(mesh.hexes[elements], return_inverse=True)
    is_inside = np.isin(sides[:, 0], elements)
    piece = replace(
        mesh,
        vertices=mesh.vertices[used],
        hexes=hexes.reshape(-1, 8),
        quads=np.searchsorted(used, mesh.quads[is_inside]),
        patch=mesh.patch[is_inside],
        cell=mesh.cell[elements],
        cad_face=mesh.cad_face[:0],
        sets={},
    )
    return piece, used


def neighbours(hexes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of equal faces, as numbers 6 hex + local face: (P,) and (P,)."""
    _, inverse, count = unique_rows(np.sort(hexes[:, FACES].reshape(-1, 4), axis=1))
    order = np.argsort(inverse, kind="stable")
    first = (np.cumsum(count) - count)[count == 2]
    return order[first], order[first + 1]


def unique_rows(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distinct rows in lexical order, index of each row among them, and number of occurrences."""
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    new = np.ones(len(rows), bool)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    inverse = np.zeros(len(rows), np.int64)
    inverse[order] = np.cumsum(new) - 1
    return ordered[new], inverse, np.bincount(inverse, minlength=int(new.sum()))


def edge_valence(hexes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges (E, 2) with ascending ends, and the number of hexes around each (E,)."""
    edges, _, count = unique_rows(np.sort(hexes[:, EDGES].reshape(-1, 2), axis=1))
    return edges, count


def edges(hexes: np.ndarray) -> np.ndarray:
    """(E, 2) edges with ascending ends."""
    return edge_valence(hexes)[0]


def quad_edges(quads: np.ndarray, is_closed: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Edges (E, 2) of quads (Q, 4) or triangles, with ascending ends, and the two at each (E, 2).

    is_closed : True: raise ValueError unless every edge has exactly two quads. False: an edge of
        the border has its quad twice; an edge with more than two quads has the first and the last
    """
    found, inverse, count = unique_rows(np.sort(half_edges(quads), axis=1))
    if is_closed and (count != 2).any():
        worst = found[np.argmax(count != 2)]
        what = f"{(count != 2).sum()} edges without exactly two quads"
        where = f"first at vertices {worst[0]}-{worst[1]}"
        raise ValueError(f"boundary is not a closed manifold: {what}, {where}")
    last = np.cumsum(count) - 1
    order = np.argsort(inverse, kind="stable") // quads.shape[1]
    return found, np.stack([order[last - count + 1], order[last]], axis=1)


def extraordinary_edges(mesh: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    """Interior edges (I, 2) without exactly four hexes, and boundary edges (B, 2) without two."""
    found, count = edge_valence(mesh.hexes)
    outside, _ = quad_edges(mesh.quads)
    key = np.int64(len(mesh.vertices))
    is_boundary = np.isin(found @ [key, 1], outside @ [key, 1])
    return found[~is_boundary & (count != 4)], found[is_boundary & (count != 2)]


def genus(mesh: HexMesh) -> int:
    """Number of handles of the boundary; raises ValueError unless it is one closed manifold."""
    check_conforming(mesh)
    parts = components(mesh.quads).max() + 1
    if parts != 1:
        raise ValueError(f"boundary has {parts} components; one is needed for a genus")
    return 1 - euler(mesh.quads) // 2


def check_conforming(mesh: HexMesh) -> None:
    """Raise ValueError unless hexes share whole faces and the boundary is a closed manifold."""
    if len(mesh.hexes) == 0:
        raise ValueError("hex mesh has no hexes")
    if mesh.hexes.min() < 0 or mesh.hexes.max() >= len(mesh.vertices):
        what = f"hexes must refer to vertices 0 to {len(mesh.vertices) - 1}"
        raise ValueError(f"{what}; got {mesh.hexes.min()} to {mesh.hexes.max()}")
    if (np.diff(np.sort(mesh.hexes, axis=1), axis=1) == 0).any():
        raise ValueError("a hex has the same vertex twice")
    faces, _, count = unique_rows(np.sort(mesh.hexes[:, FACES].reshape(-1, 4), axis=1))
    if (count > 2).any():
        raise ValueError(f"face {faces[np.argmax(count > 2)].tolist()} has {count.max()} hexes")
    outside, _ = exposed(mesh.hexes)
    found, listed = (unique_rows(np.sort(q, axis=1))[0] for q in (outside, mesh.quads))
    if not np.array_equal(found, listed):
        raise ValueError("quads are not the boundary faces of the hexes")
    quad_edges(mesh.quads)
    _, corner = np.unique(fans(mesh.quads), return_index=True)
    vertex, count = np.unique(mesh.quads.ravel()[corner], return_counts=True)
    if (count > 1).any():
        what = f"boundary is not a manifold at vertex {vertex[np.argmax(count > 1)]}"
        raise ValueError(f"{what}: {count.max()} fans of quads meet there")


def split(mesh: HexMesh) -> HexMesh:
    """Divide every hex into eight; the existing vertices keep their numbers.

    The children of hex h are 8 h to 8 h + 7, those of quad q are 4 q to 4 q + 3. The result has no
    CAD faces and sets.
    """
    number = np.zeros((len(mesh.hexes), 27), np.int64)
    vertices = [mesh.vertices]
    middles = {}
    for size in (1, 2, 4, 8):
        here = [k for k, parents in enumerate(_PARENTS) if len(parents) == size]
        corners = np.stack([mesh.hexes[:, _PARENTS[k]] for k in here], axis=1)  # (H, K, size)
        if size == 1:
            number[:, here] = corners[..., 0]
            continue
        rows, inverse, _ = unique_rows(np.sort(corners.reshape(-1, size), axis=1))
        start = sum(map(len, vertices))
        number[:, here] = start + inverse.reshape(corners.shape[:2])
        vertices.append(mesh.vertices[rows].mean(axis=1))
        middles[size] = rows, start
    quads = mesh.quads
    middle = _number_of(half_edges(quads), *middles[2]).reshape(-1, 4)
    centre = np.repeat(_number_of(quads, *middles[4])[:, None], 4, axis=1)
    children = np.stack([quads, middle, centre, np.roll(middle, 1, axis=1)], axis=-1)
    return replace(
        mesh,
        vertices=np.vstack(vertices),
        hexes=number[:, CHILDREN].reshape(-1, 8),
        quads=children.reshape(-1, 4),
        patch=np.repeat(mesh.patch, 4),
        cell=np.repeat(mesh.cell, 8),
        cad_face=mesh.cad_face[:0],
        sets={},
    )


def _number_of(rows: np.ndarray, known: np.ndarray, start: int) -> np.ndarray:
    """Vertex at the centre of each row of corners; `known` are the distinct rows."""
    return start + label_of(rows, known, np.arange(len(known)))
