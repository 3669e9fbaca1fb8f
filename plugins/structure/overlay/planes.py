"""The cells of a lattice: planes on planar faces and between them, and one solid of full cells."""

from itertools import pairwise

import numpy as np
from numba import njit
from scipy.ndimage import binary_dilation, binary_fill_holes, label

from polycube.structure.neighbourhoods import TABLE, codes, flip
from polycube.surface.measures import face_areas, face_normals
from polycube.types import TriMesh

ALONG = np.cos(np.radians(2))  # for a normal and the axis of its plane
SAME = 0.05  # of a cell: closer planes are merged
NEAREST = 0.6  # of a block: smallest distance of two planes
MIDDLE = 0.2  # of a block: largest distance of an inner plane from the centre
LEAST = 0.25  # of the area of a side of a cell: smallest area of a plane
ROUNDS = 20
PRICE = 0.05  # of a change of a cell besides its weight
THIN = 0.15  # smallest share of a cell in a wall that fills cells
AROUND = np.ones((3, 3, 3), bool)


def planes(surface: TriMesh, axis: int, size: float, doublings: int = 1) -> np.ndarray:
    """Coordinates of the lattice planes perpendicular to an axis.

    Every second plane bounds blocks of two cells, every fourth blocks of four, and so on. Each
    planar face has a plane between the largest blocks, the larger faces first, if no other is
    close, or else one between smaller blocks. Returns (2^doublings N + 1,) ascending, from the
    lowest point of the surface to the highest.

    surface : surface in the frame of the lattice
    size : wanted distance of two planes
    doublings : number of levels of smaller blocks and cells within the largest blocks
    """
    heights = surface.vertices[:, axis]
    fixed = [float(heights.min()), float(heights.max())]
    places, areas = _faces(surface, axis, SAME * size)
    wide, order = 2**doublings * size, np.argsort(-areas, kind="stable")
    order = order[areas[order] >= LEAST * size**2]
    for number in order:
        if min(abs(places[number] - other) for other in fixed) >= NEAREST * wide:
            fixed.append(float(places[number]))
    fixed.sort()
    parts = [max(1, round((b - a) / wide)) for a, b in pairwise(fixed)]
    ends = zip(pairwise(fixed), parts, strict=True)
    blocks = [np.linspace(a, b, n, endpoint=False) for (a, b), n in ends]
    lines = np.concatenate([*blocks, fixed[-1:]])
    for _ in range(doublings):
        lines = _halved(lines, places[order])
    return lines


def _halved(lines: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Lines (N,) with one more in each interval: at the centre, or at the first place near it."""
    between = (lines[1:] + lines[:-1]) / 2
    for place in places[::-1]:
        block = np.searchsorted(lines, place) - 1
        if 0 <= block < len(between):
            if abs((place - lines[block]) / (lines[block + 1] - lines[block]) - 0.5) < MIDDLE:
                between[block] = place
    return np.sort(np.concatenate([lines, between]))


def _faces(surface: TriMesh, axis: int, near: float) -> tuple[np.ndarray, np.ndarray]:
    """Heights and areas of the planes perpendicular to the axis."""
    flat = abs(face_normals(surface)[:, axis]) > ALONG
    height = surface.vertices[surface.faces[flat], axis].mean(axis=1)
    area = face_areas(surface)[flat]
    order = np.argsort(height)
    height, area = height[order], area[order]
    group = np.cumsum(np.append(0, np.diff(height) > near)) if len(height) else np.zeros(0, int)
    total = np.bincount(group, area)
    return np.bincount(group, area * height) / np.maximum(total, 1e-300), total


def manifold(share: np.ndarray, least: float) -> np.ndarray:
    """Cells with a smallest solid share, and as few changes as needed for a manifold solid.

    Returns (X, Y, Z) bool.

    share : (X, Y, Z) solid share of each cell
    least : share above which a cell is full
    """
    share = _with_walls(share, least)
    full = share >= least
    for _ in range(ROUNDS):
        # first the pinched points, so that blocks that touch along an edge are connected
        solid, weight = np.pad(full, 1), np.pad(np.abs(share - least), 1, constant_values=2.0)
        _repair(solid, codes(solid), weight, TABLE)
        inner = solid[1:-1, 1:-1, 1:-1]
        piece = label(inner)[0]
        full = binary_fill_holes(piece == 1 + np.bincount(piece.ravel(), minlength=2)[1:].argmax())
        if (full == inner).all():
            break
    return full


def _with_walls(share: np.ndarray, least: float) -> np.ndarray:
    """The shares, with those of walls without full cells raised above the limit.

    A wall consists of solid cells without full cells around them; two of its cells overlap full
    ones.
    """
    solid = (share >= THIN) & (share < least)
    apart = solid & ~binary_dilation(share >= least, AROUND)
    wall = binary_dilation(apart, AROUND, iterations=2, mask=solid) if apart.any() else apart
    return np.where(wall, (1 + least) / 2, share)


@njit(cache=True)
def _repair(solid: np.ndarray, codes: np.ndarray, weight: np.ndarray, table: np.ndarray) -> None:
    """Flip cells in place until no lattice point is pinched.

    The cell that repairs the most pinched points for its weight is flipped; if none repairs any,
    all cells around a pinched point are filled permanently. A weight above 1 marks a fixed cell.
    """
    while True:
        bad = np.argwhere(table[codes.ravel(), 1].reshape(codes.shape) > 0)
        if len(bad) == 0:
            return
        for n in range(len(bad)):
            a, b, c = bad[n]
            if table[codes[a, b, c], 1] == 0:
                continue
            best, chosen = 0.0, -1
            for bit in range(8):
                i, j, k = a + (bit >> 2), b + (bit >> 1 & 1), c + (bit & 1)
                if weight[i, j, k] > 1:
                    continue
                gain = -flip(solid, codes, i, j, k, table)[1]
                flip(solid, codes, i, j, k, table)
                value = gain / (PRICE + weight[i, j, k])
                if value > best:
                    best, chosen = value, bit
            for bit in range(8):
                i, j, k = a + (bit >> 2), b + (bit >> 1 & 1), c + (bit & 1)
                if bit == chosen or (chosen < 0 and weight[i, j, k] <= 1 and not solid[i, j, k]):
                    flip(solid, codes, i, j, k, table)
                    if chosen < 0:
                        weight[i, j, k] = 2.0
