"""Hexes of a lattice that are twice as large where small ones are not needed.

Two cells along each axis make a block.  Where all is coarse a block is one hex.  Where some cells
are needed, sheets of hexes round every layer of two blocks, in each of the three directions, cut
the blocks there in half (Mitchell and Tautges 1995 insert sheets so; the closed sheets end inside
the fine part, so that its outer blocks make the transition).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation, binary_erosion, label

from polycube.hexmesh.connectivity import PLACES, hex_mesh
from polycube.hexmesh.generation.sheets import has_sheet, with_sheet
from polycube.structure.windows import TABLE, windows
from polycube.types import HexMesh

PAIR = 4  # cells along a pair of blocks
AROUND = np.ones((3, 3, 3), bool)
ROUNDS = 30  # of growth of the fine part


class Plan(NamedTuple):
    """What is fine and what is full, on a lattice padded to whole pairs of blocks."""

    fine: np.ndarray  # (X, Y, Z) blocks that are cut
    inner: np.ndarray  # (X, Y, Z) those whose neighbours all are: their cells are full or not
    cells: np.ndarray  # (2 X, 2 Y, 2 Z) full cells, eight alike in all other blocks


def graded(full: np.ndarray, needed: np.ndarray) -> HexMesh | None:
    """Hexes of the full cells, in numbers of cells; None where they would all be small.

    Where blocks are coarse, those are hexes of which half is full.

    Parameters
    ----------
    full : (X, Y, Z) cells of a manifold solid
    needed : (X, Y, Z) cells that must not become part of a larger hex
    """
    wide = [(PAIR, PAIR + -n % PAIR) for n in full.shape]
    plan = planned(np.pad(full, wide), np.pad(needed, wide))
    if plan is None:
        return None
    mesh = _cut(plan)
    return None if mesh is None else _kept(mesh, plan)


def planned(full: np.ndarray, needed: np.ndarray) -> Plan | None:
    """Fine blocks round the needed cells, more until no place is pinched; None where all are."""
    share = full.reshape(_eights(full)).mean(axis=(1, 3, 5))
    wanted = _any_of_eight(needed) & (share > 0)
    for _ in range(ROUNDS):
        fine = _whole_pairs(binary_dilation(wanted, AROUND))
        inner = binary_erosion(fine, AROUND)
        cells = np.where(_cells(inner), full, _cells(share >= 0.5))
        wrong = _wrong(cells)
        if not wrong.any():
            is_thin = not cells.any()  # no block is half full
            return None if is_thin or fine[share > 0].all() else Plan(fine, inner, cells)
        more = wrong & (share > 0) & ~inner
        if not (more & ~wanted).any():
            return None
        wanted |= more
    return None


def _wrong(cells: np.ndarray) -> np.ndarray:
    """(X, Y, Z) blocks at pinched places, of all pieces but the largest, and of voids."""
    wrong = np.zeros(cells.shape, bool)
    pinched = TABLE[windows(np.pad(cells, 1)), 1] > 0
    for a, b, c in np.ndindex(2, 2, 2):
        nx, ny, nz = cells.shape
        wrong |= pinched[a : nx + a, b : ny + b, c : nz + c]
    for some, main in ((cells, None), (~cells, (0, 0, 0))):
        piece, number = label(some)
        if number > 1:
            largest = 1 + np.bincount(piece.ravel())[1:].argmax() if main is None else piece[main]
            wrong |= binary_dilation(some & (piece != largest), AROUND)
    return _any_of_eight(wrong)


def _whole_pairs(blocks: np.ndarray) -> np.ndarray:
    """The blocks filled up to whole pairs along each axis, and where two pairs meet at an edge."""
    pairs = _any_of_eight(blocks)
    while True:
        before = pairs.copy()
        for axis in range(3):
            layers = np.moveaxis(pairs, axis, 0)  # a view: filled in place
            a, b, c, d = (
                layers[:, :-1, :-1],
                layers[:, 1:, :-1],
                layers[:, :-1, 1:],
                layers[:, 1:, 1:],
            )
            meet = (a & d & ~b & ~c) | (b & c & ~a & ~d)
            for quarter in (a, b, c, d):
                quarter |= meet
        if (pairs == before).all():
            return _cells(pairs)


def _cut(plan: Plan) -> HexMesh | None:
    """Hexes of all blocks that are fine, beside fine ones or full; the fine ones cut by sheets."""
    coarse = plan.cells[::2, ::2, ::2] & ~plan.inner
    blocks = np.argwhere(binary_dilation(plan.fine, AROUND) | coarse)
    corners = blocks[:, None] + PLACES
    shape = np.array(plan.fine.shape) + 1
    used, hexes = np.unique(np.ravel_multi_index(corners.T, shape).T, return_inverse=True)
    places = np.stack(np.unravel_index(used, shape), axis=1).astype(float)
    number = np.ravel_multi_index(blocks.T, plan.fine.shape)
    mesh = hex_mesh(places, hexes.reshape(-1, 8), cell=number)
    for axis in range(3):
        for parity in (0, 1):
            block = np.unravel_index(mesh.cell, plan.fine.shape)
            inside = plan.fine[block] & (block[axis] // 2 % 2 == parity)
            if not inside.any():
                continue
            if not has_sheet(mesh, inside):
                return None
            mesh = with_sheet(mesh, inside, depth=1.0)
    return mesh


def _kept(mesh: HexMesh, plan: Plan) -> HexMesh:
    """The hexes of full cells and blocks, in numbers of cells of the unpadded lattice."""
    vertices = 2 * mesh.vertices
    cell = np.floor(vertices[mesh.hexes].mean(axis=1)).astype(int)  # (H, 3)
    inner = plan.inner[np.unravel_index(mesh.cell, plan.fine.shape)]
    middle = cell[inner, None] + 0.5
    corner = cell[inner, None] + (vertices[mesh.hexes[inner]] > middle)
    vertices[mesh.hexes[inner]] = corner
    block = np.stack(np.unravel_index(mesh.cell, plan.fine.shape), axis=1)
    kept = plan.cells[tuple(np.where(inner[:, None], cell, 2 * block).T)]
    used, hexes = np.unique(mesh.hexes[kept], return_inverse=True)
    return hex_mesh(vertices[used] - PAIR, hexes.reshape(-1, 8))


def _cells(blocks: np.ndarray) -> np.ndarray:
    """Blocks as their cells, or pairs of blocks as their blocks."""
    return blocks.repeat(2, axis=0).repeat(2, axis=1).repeat(2, axis=2)


def _any_of_eight(cells: np.ndarray) -> np.ndarray:
    """(X / 2, Y / 2, Z / 2) whether any cell of a block is marked."""
    return np.asarray(cells.reshape(_eights(cells)).any(axis=(1, 3, 5)))


def _eights(cells: np.ndarray) -> tuple[int, ...]:
    """Shape in which each axis of (X, Y, Z) is pairs."""
    return tuple(n for length in cells.shape for n in (length // 2, 2))
