"""Hexes of blocks: a coarse hex mesh of the part, each of whose hexes is divided evenly.

Opposite edges of a quad have the same number of parts, so the hexes share whole faces.
"""

from hashlib import sha256

import numpy as np

from polycube.hexmesh import connectivity
from polycube.structure import lattice
from polycube.structure.rough_map import affine_map
from polycube.surface.measures import coincident, connected
from polycube.types import Candidate, HexMesh, Polycube, TriMesh

LONGEST = 1.4  # largest length of a hex edge, relative to the wanted size
SAME = 1e-9  # of the extent: closer vertices of two blocks are merged


def counts(blocks: HexMesh, size: float) -> np.ndarray:
    """(H, 3) parts of each block along xi, eta and zeta for a hex size in model units."""
    ends = np.sort(blocks.hexes[:, connectivity.EDGES], axis=2)  # (H, 12, 2)
    edges, edge, _ = connectivity.unique_rows(ends.reshape(-1, 2))
    opposite = edge.reshape(-1, 4)  # opposite edges of one block in one direction
    group = connected(np.repeat(opposite[:, 0], 3), opposite[:, 1:].ravel(), len(edges))
    length = np.linalg.norm(np.diff(blocks.vertices[edges], axis=1)[:, 0], axis=1)
    wanted = np.bincount(group, length) / np.bincount(group)
    np.maximum.at(wanted, group, length / LONGEST)
    return np.maximum(1, np.round(wanted / size)).astype(int)[group[opposite[:, 0]]].reshape(-1, 3)


def candidate(blocks: HexMesh, surface: TriMesh, brick: str, proposal: str) -> Candidate:
    """A structure that consists of these blocks.

    Its polycube is one cell over the bounding box of the part.

    brick : name of a primitive that fills its cell
    """
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    ends = np.array([0.0, 1.0])
    polycube = Polycube(np.ones((1, 1, 1), bool), ends, ends, ends, (1, 1, 1), (brick,))
    rough_map = affine_map(polycube, np.diag(high - low), low)
    key = f"{proposal} {sha256(blocks.hexes.tobytes()).hexdigest()}"
    return Candidate(proposal, polycube, rough_map, 0.0, key, variants="blocks", blocks=blocks)


def genus_of(polycube: Polycube, blocks: HexMesh | None) -> int:
    """Number of handles of a structure; of its blocks if it has blocks."""
    return lattice.genus(polycube) if blocks is None else connectivity.genus(blocks)


def number_of_hexes(parts: np.ndarray) -> float:
    """Number of hexes of blocks divided into parts (H, 3)."""
    return float(parts.prod(axis=1, dtype=float).sum())


def cut(blocks: HexMesh, parts: np.ndarray) -> HexMesh:
    """Hexes of blocks divided into parts (H, 3); the map is trilinear in each block."""
    if (parts == 1).all():
        return blocks
    places, hexes, owner, start = [], [], [], 0
    for number, n in enumerate(parts):
        shares = np.stack(np.meshgrid(*(np.arange(k + 1) / k for k in n), indexing="ij"), axis=-1)
        along = shares[..., None, :]
        weights = np.where(connectivity.PLACES, along, 1 - along).prod(axis=-1)
        places.append(weights.reshape(-1, 8) @ blocks.vertices[blocks.hexes[number]])
        low = np.stack(np.unravel_index(np.arange(n.prod()), n), axis=1)
        corners = (low[:, None] + connectivity.PLACES).transpose(2, 0, 1)
        hexes.append(start + np.ravel_multi_index(corners, n + 1))
        owner.append(np.full(n.prod(), number))
        start += len(places[-1])
    vertices, of = np.concatenate(places), np.concatenate(owner)
    first, name = coincident(vertices, SAME * np.ptp(vertices, axis=0).max())
    joined = name[np.concatenate(hexes)]
    quads, inner = connectivity.exposed(joined)
    patch = np.zeros((len(blocks.hexes), 6), np.int64)
    patch[connectivity.quad_sides(blocks)] = blocks.patch
    side = (joined[inner][:, connectivity.FACES] == quads[:, None]).all(axis=2).argmax(axis=1)
    patches = patch[of[inner], side]
    return connectivity.hex_mesh(vertices[first], joined, quads, patches, blocks.cell[of])


def on_box(vertices: np.ndarray) -> np.ndarray:
    """(V, 3) vertices moved away from the centre of their bounding box, onto the unit cube."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    out = 2 * (vertices - low) / (high - low) - 1
    return (1 + out / np.maximum(abs(out).max(axis=1, keepdims=True), SAME)) / 2
