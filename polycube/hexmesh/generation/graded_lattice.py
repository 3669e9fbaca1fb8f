"""Graded hexes of a lattice: larger hexes in regions that do not need small ones.

Two cells along each axis form a block, and two blocks a block of the next level. In coarse regions,
a block of the last level is one hex. In fine regions, sheets of hexes around every layer of two
blocks, in each of the three directions, divide the blocks in half (Mitchell and Tautges 1995 insert
sheets in this way; the closed sheets end inside the fine region, so that its outer blocks form the
transition). The same is repeated for the blocks inside, down to the cells.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation, binary_erosion, label

from polycube.hexmesh.connectivity import PLACES, hex_mesh
from polycube.hexmesh.generation.sheets import has_sheet, with_sheet
from polycube.structure.neighbourhoods import TABLE, codes
from polycube.types import HexMesh

AROUND = np.ones((3, 3, 3), bool)
ROUNDS = 30  # rounds of growth of the fine region


class Plan(NamedTuple):
    """Blocks to divide and occupied cells, on a lattice padded to pairs of the largest blocks."""

    fine: list[np.ndarray]  # (X, Y, Z) divided blocks, of two cells, of four, etc.
    cells: np.ndarray  # (X, Y, Z) occupied cells, equal in each block that becomes a hex


def graded(full: np.ndarray, needed: Sequence[np.ndarray]) -> HexMesh | None:
    """Hexes of the occupied cells in cell coordinates; None if all of them would be small.

    In coarse regions, blocks that are at least half occupied become hexes.

    full : (X, Y, Z) cells of a manifold solid
    needed : for blocks of two cells, of four etc., the cells (X, Y, Z) that need smaller hexes
    """
    pair = 2 ** (len(needed) + 1)
    wide = [(pair, pair + -n % pair) for n in full.shape]
    plan = planned(np.pad(full, wide), [np.pad(cells, wide) for cells in needed])
    if plan is None:
        return None
    mesh = _cut(plan)
    if mesh is None:
        return None
    is_full = plan.cells[tuple(_blocks(plan, mesh)[1].T)]
    used, hexes = np.unique(mesh.hexes[is_full], return_inverse=True)
    return hex_mesh(mesh.vertices[used] - pair, hexes.reshape(-1, 8))


def planned(full: np.ndarray, needed: Sequence[np.ndarray]) -> Plan | None:
    """Fine blocks around the needed cells, grown until nothing is pinched; None if all are fine."""
    shares, wanted = [full.astype(float)], []
    for number, cells in enumerate(needed, 1):
        shares.append(shares[-1].reshape(_pairs_shape(shares[-1])).mean(axis=(1, 3, 5)))
        wanted.append(_reduced(cells, number) & (shares[-1] > 0))
    for _ in range(ROUNDS):
        fine = _fine(wanted)
        cells = shares[-1] >= 0.5
        for share, blocks in zip(shares[-2::-1], fine[::-1], strict=True):
            cells = np.where(_cells(_inner(blocks)), share >= 0.5, _cells(cells))
        defects = _topology_defects(cells)
        if not defects.any():
            is_small = bool(fine[0][shares[1] > 0].all())
            return Plan(fine, cells) if cells.any() and not is_small else None
        grown = False
        # whether blocks are divided into blocks of this level
        cut = np.ones(wanted[-1].shape, bool)
        for number in range(len(fine), 0, -1):
            inner = _inner(fine[number - 1])
            more = _reduced(defects, number) & (shares[number] > 0) & cut & ~inner
            grown |= bool((more & ~wanted[number - 1]).any())
            wanted[number - 1] |= more
            cut = _cells(inner)
        if not grown:
            return None
    return None


def _fine(wanted: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Blocks divided so that the wanted ones are inner ones, and those around finer ones."""
    fine: list[np.ndarray] = []
    for blocks in wanted:
        if fine:
            blocks = blocks | _any_of_eight(binary_dilation(fine[-1], AROUND))
        fine.append(_complete_pairs(binary_dilation(blocks, AROUND)))
    return fine


def _inner(fine: np.ndarray) -> np.ndarray:
    """(X, Y, Z) blocks with only fine neighbours: they become eight smaller ones."""
    return binary_erosion(fine, AROUND)


def _topology_defects(cells: np.ndarray) -> np.ndarray:
    """(X, Y, Z) cells at pinched points, of smaller components, and of voids."""
    defects = _pinched(cells)
    for cells_of_kind, main in ((cells, None), (~cells, (0, 0, 0))):
        piece, number = label(cells_of_kind)
        if number > 1:
            largest = 1 + np.bincount(piece.ravel())[1:].argmax() if main is None else piece[main]
            defects |= binary_dilation(cells_of_kind & (piece != largest), AROUND)
    return defects


def _pinched(cells: np.ndarray) -> np.ndarray:
    """(X, Y, Z) cells around edges and corners at which occupied cells meet alone."""
    found = np.zeros(cells.shape, bool)
    pinched = TABLE[codes(np.pad(cells, 1)), 1] > 0
    for a, b, c in np.ndindex(2, 2, 2):
        nx, ny, nz = cells.shape
        found |= pinched[a : nx + a, b : ny + b, c : nz + c]
    return found


def _complete_pairs(blocks: np.ndarray) -> np.ndarray:
    """Blocks completed to whole pairs along each axis, also where two pairs meet at an edge."""
    pairs = _any_of_eight(blocks)
    while True:
        before = pairs.copy()
        for axis in range(3):
            layers = np.moveaxis(pairs, axis, 0)  # a view, filled in place
            low, high = layers[:, :-1], layers[:, 1:]
            a, b, c, d = low[..., :-1], high[..., :-1], low[..., 1:], high[..., 1:]
            meet = (a & d & ~b & ~c) | (b & c & ~a & ~d)
            for quarter in (a, b, c, d):
                quarter |= meet
        if (pairs == before).all():
            return _cells(pairs)


def _cut(plan: Plan) -> HexMesh | None:
    """Hexes of all fine blocks, and of the occupied ones next to them; fine ones divided by sheets.

    The `cell` of a hex is the number of its block, see `_blocks`.
    """
    last, top = len(plan.fine), plan.fine[-1]
    step = 2**last
    selected = binary_dilation(top, AROUND) | (plan.cells[::step, ::step, ::step] & ~_inner(top))
    while (more := _pinched(selected)).any():
        selected |= more
    blocks = np.argwhere(selected)
    corners = blocks[:, None] + PLACES
    shape = np.array(top.shape) + 1
    used, hexes = np.unique(np.ravel_multi_index(corners.T, shape).T, return_inverse=True)
    places = step * np.stack(np.unravel_index(used, shape), axis=1).astype(float)
    mesh = hex_mesh(places, hexes.reshape(-1, 8), cell=_numbers(plan, last, step * blocks))
    for number in range(last, 0, -1):
        fine = plan.fine[number - 1]
        for axis in range(3):
            for parity in (0, 1):
                level, first = _blocks(plan, mesh)
                block = tuple(first.T >> number)
                inside = (level == number) & fine[block] & (block[axis] >> 1 & 1 == parity)
                if not inside.any():
                    continue
                if not has_sheet(mesh, inside):
                    return None
                mesh = with_sheet(mesh, inside, depth=1.0)
        mesh = _halved(mesh, plan, number)
    return mesh


def _halved(mesh: HexMesh, plan: Plan, number: int) -> HexMesh:
    """The mesh in which the parts of inner blocks have become blocks of the level below."""
    level, first = _blocks(plan, mesh)
    parts = np.flatnonzero(level == number)
    parts = parts[_inner(plan.fine[number - 1])[tuple(first[parts].T >> number)]]
    half, vertices = 2 ** (number - 1), mesh.vertices.copy()
    corners = vertices[mesh.hexes[parts]]
    start = half * np.floor(corners.mean(axis=1) / half)
    vertices[mesh.hexes[parts]] = start[:, None] + half * (corners > start[:, None] + half / 2)
    cell = mesh.cell.copy()
    cell[parts] = _numbers(plan, number - 1, start.astype(int))
    return replace(mesh, vertices=vertices, cell=cell)


def _numbers(plan: Plan, level: int, first: np.ndarray) -> np.ndarray:
    """(N,) one number for a level and the first cells (N, 3) of blocks."""
    return level * plan.cells.size + np.ravel_multi_index(first.T, plan.cells.shape)


def _blocks(plan: Plan, mesh: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    """(H,) levels and (H, 3) first cells of the blocks of hexes."""
    level, first = np.divmod(mesh.cell, plan.cells.size)
    return level, np.stack(np.unravel_index(first, plan.cells.shape), axis=1)


def _reduced(cells: np.ndarray, times: int) -> np.ndarray:
    """Whether any cell of each block of that level is marked."""
    for _ in range(times):
        cells = _any_of_eight(cells)
    return cells


def _cells(blocks: np.ndarray) -> np.ndarray:
    """Expand blocks to their cells, or pairs of blocks to their blocks."""
    return blocks.repeat(2, axis=0).repeat(2, axis=1).repeat(2, axis=2)


def _any_of_eight(cells: np.ndarray) -> np.ndarray:
    """(X / 2, Y / 2, Z / 2) whether any cell of a block is marked."""
    return np.asarray(cells.reshape(_pairs_shape(cells)).any(axis=(1, 3, 5)))


def _pairs_shape(cells: np.ndarray) -> tuple[int, ...]:
    """Shape in which each axis of (X, Y, Z) is split into pairs."""
    return tuple(n for length in cells.shape for n in (length // 2, 2))
