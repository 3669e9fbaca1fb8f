"""Hex mesh of a polycube, positioned by its rough map.

Every interval of the lattice is divided into equal parts across its whole slab, so the hexes share
whole faces. The number of parts follows from the length of the interval in the model.
"""

import numpy as np

from polycube.hexmesh.connectivity import FACES, PLACES, exposed, hex_mesh
from polycube.structure.lattice import boundary, cell_at
from polycube.structure.rough_map import evaluate, identity_map
from polycube.types import HexMesh, PerAxis, Polycube, RoughMap

_AXIS_OF_FACE = np.array([1, 0, 3, 2, 5, 4])  # axis label of each local face of a hex


def counts(
    polycube: Polycube, rough_map: RoughMap, size: float, least: int = 2, across: int = 4
) -> PerAxis:
    """Number of parts of each lattice interval, per axis.

    size : wanted edge length in model units
    least : smallest number of parts of one lattice interval
    across : smallest number of parts along each axis of the whole lattice
    """
    found = []
    for axis in range(3):
        length = interval_lengths(polycube, rough_map, axis)
        number = np.maximum(np.round(length / size).astype(int), least)
        while number.sum() < across:
            number[np.argmax(length / number)] += 1
        found.append(number)
    return found[0], found[1], found[2]


def interval_lengths(polycube: Polycube, rough_map: RoughMap, axis: int) -> np.ndarray:
    """Mean length in the model of each lattice interval along an axis, over the occupied boxes."""
    steps = 8
    knots = [np.sort(np.append(k, (k[1:] + k[:-1]) / 2)) for k in polycube.knots]
    ends = polycube.knots[axis]
    parts = np.arange(len(ends) - 1)[:, None] + np.arange(steps) / steps
    knots[axis] = np.interp(np.append(parts, len(ends) - 1), np.arange(len(ends)), ends)
    grid = np.stack(np.meshgrid(*knots, indexing="ij"), axis=-1)
    places = evaluate(rough_map, grid.reshape(-1, 3)).reshape(grid.shape)
    piece = np.linalg.norm(np.diff(np.moveaxis(places, axis, 0), axis=0), axis=-1)
    length = piece.reshape(len(ends) - 1, steps, *piece.shape[1:]).sum(axis=1)  # (I, 2J+1, 2K+1)
    solid = np.moveaxis(polycube.occupancy, axis, 0)  # (I, J, K)
    touched = np.zeros(length.shape, bool)
    for j, k in np.ndindex(3, 3):  # corners, midpoints of edges and centre of every box
        n_j, n_k = 2 * solid.shape[1], 2 * solid.shape[2]
        touched[:, j : j + n_j : 2, k : k + n_k : 2] |= solid
    return np.array([row[used].mean() for row, used in zip(length, touched, strict=True)])


def mesh(polycube: Polycube, rough_map: RoughMap, counts: PerAxis) -> HexMesh:
    """Hexes of the polycube with the given number of parts of each interval."""
    return mesh_between(polycube, rough_map, grid_lines(polycube, counts))


def mesh_between(polycube: Polycube, rough_map: RoughMap, lines: PerAxis) -> HexMesh:
    """Hexes of the polycube between the given lines of each axis, which include all its knots."""
    middles = [(line[1:] + line[:-1]) / 2 for line in lines]
    slab = [np.searchsorted(k, m) - 1 for k, m in zip(polycube.knots, middles, strict=True)]
    cells = np.argwhere(polycube.occupancy[np.ix_(*slab)])  # (H, 3)
    shape = tuple(len(line) for line in lines)
    corners = (cells[:, None] + PLACES).transpose(2, 0, 1)
    used, hexes = np.unique(np.ravel_multi_index(corners, shape), return_inverse=True)
    hexes = hexes.reshape(-1, 8)
    index = np.unravel_index(used, shape)
    places = np.stack([line[i] for line, i in zip(lines, index, strict=True)], axis=1)
    box = np.stack([s[i] for s, i in zip(slab, cells.T, strict=True)], axis=1)
    quads, owner = exposed(hexes)
    face = (hexes[owner][:, FACES] == quads[:, None]).all(axis=2).argmax(axis=1)
    surface, full = boundary(polycube), polycube.occupancy
    patch = np.zeros((full.sum(), 6), np.int64)  # of each side of the full boxes
    patch[surface.box, surface.axis] = surface.patch
    number = np.zeros(full.shape, np.int64)
    number[full] = np.arange(full.sum())
    patch = patch[number[tuple(box[owner].T)], _AXIS_OF_FACE[face]]
    cell = cell_at(polycube, places[hexes].mean(axis=1))
    return hex_mesh(evaluate(rough_map, places), hexes, quads, patch, cell)


def grid_lines(polycube: Polycube, counts: PerAxis) -> PerAxis:
    """Polycube coordinates of the mesh lines along each axis."""

    def line(number: np.ndarray, knots: np.ndarray) -> np.ndarray:
        parts = [i + np.arange(n) / n for i, n in enumerate(number)]
        return np.interp(np.append(np.concatenate(parts), len(number)), range(len(knots)), knots)

    x, y, z = map(line, counts, polycube.knots)
    return x, y, z


def map_through(
    polycube: Polycube, rough_map: RoughMap, counts: PerAxis, positions: np.ndarray
) -> RoughMap:
    """Trilinear map between the mesh lines; `rough_map` outside the solid and in its holes.

    positions : (V, 3) of the vertices of `mesh` with the same number of parts
    """
    lines = grid_lines(polycube, counts)
    lattice = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    found = evaluate(rough_map, lattice.reshape(-1, 3)).reshape(lattice.shape)
    places = mesh(polycube, identity_map(polycube), counts).vertices
    index = [np.searchsorted(line, places[:, axis] - 1e-9) for axis, line in enumerate(lines)]
    found[tuple(index)] = positions
    return RoughMap(*lines, found)
