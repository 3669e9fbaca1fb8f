"""Topology of bricks: its defects, and the cheapest flips that repair them.

Runs of bricks are flipped, the cheapest per defect first, until the solid is connected, without
voids, manifold and of the given genus; then as long as this lowers the energy of `cut`.
"""

import numpy as np
from numba import njit

from polycube.structure.neighbourhoods import TABLE, codes, flip
from polycube.types import PerAxis

FLIPS = 400  # largest number of flips


def defect(full: np.ndarray, genus: int) -> int:
    """Number of defects compared with one manifold solid of a genus; 0 if there are none."""
    solid = np.pad(full, 1)
    total, bad, _ = TABLE[codes(solid)].sum(axis=(0, 1, 2))
    return _defect(solid, genus, total, bad)


def corners(full: np.ndarray) -> int:
    """Number of lattice points with at least three faces of the boundary of the bricks."""
    return int(TABLE[codes(np.pad(full, 1)), 2].sum())


@njit(cache=True)
def _pieces(solid: np.ndarray, value: bool) -> int:
    """Number of face-connected components of voxels (X, Y, Z) with a value."""
    flat, (_, ny, nz) = solid.ravel(), solid.shape
    seen = flat != value
    stack = np.zeros(flat.size, np.int64)
    pieces = 0
    for first in range(flat.size):
        if seen[first]:
            continue
        pieces += 1
        seen[first], stack[0], top = True, first, 1
        while top:
            top -= 1
            at = stack[top]
            y, z = at // nz % ny, at % nz
            for neighbour in range(6):
                step = 1 if neighbour < 3 else -1
                if neighbour % 3 == 0:
                    other = at + step * ny * nz
                    inside = 0 <= other < flat.size
                elif neighbour % 3 == 1:
                    other, inside = at + step * nz, 0 <= y + step < ny
                else:
                    other, inside = at + step, 0 <= z + step < nz
                if inside and not seen[other]:
                    seen[other], stack[top] = True, other
                    top += 1
    return pieces


@njit(cache=True)
def _defect(solid: np.ndarray, genus: int, total: int, bad: int) -> int:
    """Number of pinched points, additional components, voids, and wrong handles.

    total, bad : sums of the first two columns of `polycube.structure.neighbourhoods.TABLE`
    """
    pieces, outside = _pieces(solid, True), _pieces(solid, False)
    if pieces == 0:
        return 1000
    handles = pieces + outside - 1 - total // 8
    return bad + pieces - 1 + outside - 1 + abs(handles - genus)


@njit(cache=True)
def _change(solid: np.ndarray, gain: np.ndarray, areas: PerAxis, i: int, j: int, k: int) -> float:
    """Change of the energy by flipping one brick; indices include the empty layer."""
    full = solid[i, j, k]
    x, y, z = i - 1, j - 1, k - 1
    change = gain[x, y, z] if full else -gain[x, y, z]
    change += areas[0][x, y, z] * (1 if solid[i - 1, j, k] == full else -1)
    change += areas[0][x + 1, y, z] * (1 if solid[i + 1, j, k] == full else -1)
    change += areas[1][x, y, z] * (1 if solid[i, j - 1, k] == full else -1)
    change += areas[1][x, y + 1, z] * (1 if solid[i, j + 1, k] == full else -1)
    change += areas[2][x, y, z] * (1 if solid[i, j, k - 1] == full else -1)
    change += areas[2][x, y, z + 1] * (1 if solid[i, j, k + 1] == full else -1)
    return change


@njit(cache=True)
def _flip_run(solid: np.ndarray, codes: np.ndarray, run: np.ndarray, table: np.ndarray) -> None:
    """Flip a run of bricks (axis, i, j, k, length) in place."""
    at = run[1:4].copy()
    for _ in range(run[4]):
        flip(solid, codes, at[0], at[1], at[2], table)
        at[run[0]] += 1


@njit(cache=True)
def _runs(
    solid: np.ndarray, codes: np.ndarray, gain: np.ndarray, areas: PerAxis, table: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Runs of equal bricks (N, 5): axis, start, length; and the changes by flipping each.

    The changes are those of the energy (N,) and of the sums of the table (N, 2).
    """
    shape = np.array(solid.shape)
    most = gain.size * (gain.shape[0] + gain.shape[1] + gain.shape[2])
    runs, n = np.zeros((most, 5), np.int64), 0
    changes, effects, at = np.zeros(most), np.zeros((most, 2), np.int64), np.zeros(3, np.int64)
    for axis in range(3):
        for i in range(1, shape[0] - 1):
            for j in range(1, shape[1] - 1):
                for k in range(1, shape[2] - 1):
                    at[0], at[1], at[2] = i, j, k
                    value, change, length = solid[i, j, k], 0.0, 0
                    total, bad = 0, 0
                    while at[axis] < shape[axis] - 1 and solid[at[0], at[1], at[2]] == value:
                        x, y, z = at[0], at[1], at[2]
                        change += _change(solid, gain, areas, x, y, z)
                        more = flip(solid, codes, x, y, z, table)
                        total, bad = total + more[0], bad + more[1]
                        at[axis] += 1
                        length += 1
                        if length > 1 or axis == 0:  # single bricks are considered once
                            runs[n, 0], runs[n, 1], runs[n, 2], runs[n, 3] = axis, i, j, k
                            runs[n, 4], changes[n] = length, change
                            effects[n, 0], effects[n, 1] = total, bad
                            n += 1
                    for _ in range(length):
                        at[axis] -= 1
                        flip(solid, codes, at[0], at[1], at[2], table)
    return runs[:n], changes[:n], effects[:n]


@njit(cache=True)
def _repair(
    solid: np.ndarray,
    gain: np.ndarray,
    areas: PerAxis,
    genus: int,
    limit: float,
    codes: np.ndarray,
    table: np.ndarray,
) -> bool:
    """Flip runs of bricks in place; True if the topology is correct in the end.

    In each step, the run with the smallest cost per repaired defect is flipped; then those that
    lower the energy. The change of pinched points and of the Euler number by a run is local and
    bounds the number of repaired defects, so components are counted for a few promising runs only.
    """
    total, bad = 0, 0
    for code in codes.ravel():
        total, bad = total + table[code, 0], bad + table[code, 1]
    defects = _defect(solid, genus, total, bad)
    for _ in range(FLIPS):
        runs, changes, effects = _runs(solid, codes, gain, areas, table)
        bound = np.full(len(runs), np.inf)
        for n in range(len(runs)):
            least = bad + effects[n, 1] + abs(1 - (total + effects[n, 0]) // 8 - genus)
            if defects == 0:
                if least == 0 and changes[n] < -1e-12:
                    bound[n] = changes[n]
            elif least < defects and changes[n] <= limit:
                bound[n] = changes[n] / (defects - least if changes[n] > 0 else 1)
        best, chosen, left = np.inf, -1, defects
        for n in np.argsort(bound):
            if bound[n] >= best:
                break
            _flip_run(solid, codes, runs[n], table)
            after = _defect(solid, genus, total + effects[n, 0], bad + effects[n, 1])
            _flip_run(solid, codes, runs[n], table)
            if after == 0 or after < defects:
                value = (
                    changes[n] / (defects - after)
                    if defects > after and changes[n] > 0
                    else changes[n]
                )
                if value < best:
                    best, chosen, left = value, n, after
        if chosen < 0:
            break
        _flip_run(solid, codes, runs[chosen], table)
        total, bad, defects = total + effects[chosen, 0], bad + effects[chosen, 1], left
    return defects == 0


def repaired(
    full: np.ndarray, gain: np.ndarray, areas: PerAxis, genus: int, limit: float = np.inf
) -> np.ndarray | None:
    """Bricks flipped to one manifold solid of a genus at low energy; None if none is found.

    gain, areas : as for `minimum_cut`; limit : largest energy added by flipping one run of bricks
    """
    solid = np.pad(full, 1)
    is_right = _repair(solid, gain, areas, genus, limit, codes(solid), TABLE)
    return solid[1:-1, 1:-1, 1:-1] if is_right else None
