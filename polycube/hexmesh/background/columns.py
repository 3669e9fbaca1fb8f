"""Hexes of the columns above the quads of a section, and along the axis of a turned part."""

import numpy as np

from polycube.hexmesh.background.background import Background, NoBackgroundError
from polycube.hexmesh.background.section import Section
from polycube.hexmesh.background.smoothing import smoothed
from polycube.hexmesh.connectivity import hex_mesh
from polycube.surface.measures import coincident, connected
from polycube.types import HexMesh

INNER = 0.62  # radius of the square in the middle of a disc
SQUARE = 1.1  # divisor of the square in its mixture with a circle
RINGS = 16  # sectors per ring of quads around it


def layers(levels: np.ndarray, full: np.ndarray, size: float, across_wall: float) -> np.ndarray:
    """(K,) number of layers of hexes in each slab.

    levels : (K + 1,) heights of the caps
    full : (C, K) whether each cell of the section is full in each slab
    size : wanted size of hexes along the axis; at most 1.5 times as large
    across_wall : smallest number of layers between any two caps
    """
    thickness = np.diff(levels)
    number = np.maximum(1, np.round(thickness / size)).astype(int)
    for column in full:
        step = np.diff(np.concatenate([[0], column, [0]]).astype(int))
        for low, high in zip(np.flatnonzero(step > 0), np.flatnonzero(step < 0), strict=True):
            while number[low:high].sum() < across_wall:
                number[low + np.argmax(thickness[low:high] / number[low:high])] += 1
    return number


def columns(flat: Section, background: Background, full: np.ndarray, number: np.ndarray) -> HexMesh:
    """Hexes of all full cells, in space.

    full : as in `layers`
    number : (K,) layers in each slab
    """
    levels = background.levels
    between = zip(levels[:-1], levels[1:], number.tolist(), strict=True)
    parts = [low + (high - low) * np.arange(n) / n for low, high, n in between]
    heights = np.append(np.concatenate(parts), levels[-1])
    layer, quad = np.nonzero(full[flat.cell][:, np.repeat(np.arange(len(number)), number)].T)
    size = len(flat.vertices)
    below = flat.quads[quad] + layer[:, None] * size
    above = below + size
    if background.is_cyclic:
        above %= size * number.sum()
    hexes = np.concatenate([below, above], axis=1)
    used, hexes = np.unique(hexes, return_inverse=True)
    height, vertex = np.divmod(used, size)
    vertices = np.column_stack([flat.vertices[vertex], heights[height]])
    return hex_mesh(background.place(vertices), hexes.reshape(-1, 8))


def feet(mesh: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    """The lowest quad (N, 4) of each column of a mesh from `columns`, and its number of hexes (N,).

    A column that is a ring has its first hex as the lowest one.
    """
    ends = np.sort(np.concatenate([mesh.hexes[:, :4], mesh.hexes[:, 4:]]), axis=1)
    below, above = np.unique(ends, axis=0, return_inverse=True)[1].reshape(2, -1)
    column = connected(below, above, int(above.max(initial=below.max())) + 1)[below]
    rank = np.isin(below, above)  # a hex that is not the lowest one follows
    order = np.lexsort((np.arange(len(rank)), rank, column))
    first = order[np.unique(column[order], return_index=True)[1]]
    return mesh.hexes[first, :4], np.bincount(column)[column[first]]


def disc(number: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 2) of a unit disc, the first on its rim at angles k 2 pi / number, and quads.

    Concentric squares l q with max |q| = 1 become rounded, l INNER [(1 - l / 2) q / SQUARE + l c /
    2] with the point c of the unit circle at the same place of the border; rings lead to the rim.

    number : of vertices on the rim, a multiple of 4
    """
    side = number // 4
    line = np.linspace(-1, 1, side + 1)
    place = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    level = abs(place).max(axis=1)
    x, y = (place / np.maximum(level, 1e-30)[:, None]).T
    # place on the border in eighths of a turn, from the middle of a side
    eighth = np.where(abs(x) >= abs(y), np.where(x > 0, y, 4 - y), np.where(y > 0, 2 - x, 6 + x))
    turn = np.pi / 4 * (eighth + 1)
    square = np.sqrt(0.5) * np.stack([x - y, x + y], axis=1)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    half = level[:, None] / 2
    inner = INNER * level[:, None] * ((1 - half) * square / SQUARE + half * circle)
    around = 2 * np.pi * np.arange(number) / number
    rim = np.stack([np.cos(around), np.sin(around)], axis=1)
    border = np.flatnonzero(level == 1)
    border = border[np.argsort(np.rint(turn[border] * number / (2 * np.pi)) % number)]
    rings = max(1, round(number / RINGS))
    share = np.arange(rings)[:, None, None] / rings
    vertices = np.concatenate([((1 - share) * rim + share * inner[border]).reshape(-1, 2), inner])
    names = np.append(np.arange(rings * number), rings * number + border).reshape(-1, number)
    after = np.roll(names, -1, axis=1)
    table = rings * number + np.arange(len(inner)).reshape(side + 1, side + 1)
    ring = np.stack([names[1:], names[:-1], after[:-1], after[1:]], axis=-1)
    square = np.stack([table[:-1, :-1], table[1:, :-1], table[1:, 1:], table[:-1, 1:]], axis=-1)
    quads = np.concatenate([ring.reshape(-1, 4), square.reshape(-1, 4)])
    return smoothed(vertices, quads, np.arange(len(vertices)) >= number), quads


def core(
    outline: np.ndarray, flat: Section, radius: float, number: int, part: Background
) -> HexMesh:
    """Hexes between the axis and a radius of a turned part: a disc, swept between two caps.

    outline : (P, 2) points (z, r) round a cell of the section between the axis and the radius
    flat : quads at larger radii, whose vertices at the radius are those of the core
    number : of hexes round the axis
    part : the background grid of the part
    """
    near = 1e-3 * radius
    at_axis, at_rim = (outline[abs(outline[:, 1] - r) < near, 0] for r in (0.0, radius))
    if len(at_axis) < 2 or len(at_rim) < 2:
        raise NoBackgroundError("its axis is not between two caps")
    rim = flat.vertices[abs(flat.vertices[:, 1] - radius) < near, 0]
    low, high = at_rim.min(), at_rim.max()
    rim = np.unique(rim[(rim > low - near) & (rim < high + near)])
    vertices, quads = disc(number)
    r = np.linalg.norm(vertices, axis=1)
    angle = np.arctan2(vertices[:, 1], vertices[:, 0]) + part.levels[0]
    bottom = at_axis.min() + (low - at_axis.min()) * r
    top = at_axis.max() + (high - at_axis.max()) * r
    z = bottom + ((rim - low) / (high - low))[:, None] * (top - bottom)
    z[:, :number] = rim[:, None]
    turned = np.stack([z, *np.broadcast_arrays(radius * r, angle, z)[:2]], axis=-1)
    layer = np.arange(len(rim) - 1)[:, None, None] * len(vertices)
    hexes = np.concatenate([quads + layer, quads + layer + len(vertices)], axis=2).reshape(-1, 8)
    return hex_mesh(part.place(turned.reshape(-1, 3)), hexes)


def joined(meshes: list[HexMesh], near: float) -> HexMesh:
    """One mesh, with close vertices merged."""
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    start = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    hexes = np.concatenate([m.hexes + s for m, s in zip(meshes, start[:-1], strict=True)])
    first, merged = coincident(vertices, near)
    return hex_mesh(vertices[first], merged[hexes])
