"""Hexes of the columns above the quads of a section."""

import numpy as np

from polycube.hexmesh.background.background import Background
from polycube.hexmesh.background.section import Section
from polycube.hexmesh.connectivity import hex_mesh
from polycube.surface.measures import connected
from polycube.types import HexMesh


def layers(levels: np.ndarray, full: np.ndarray, size: float, across_wall: float) -> np.ndarray:
    """(K,) number of layers of hexes in each slab.

    Parameters
    ----------
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
                thickest = low + np.argmax(thickness[low:high] / number[low:high])
                number[thickest] += 1
    return number


def columns(flat: Section, background: Background, full: np.ndarray, number: np.ndarray) -> HexMesh:
    """Hexes of all full cells, in space.

    Parameters
    ----------
    full : as in `layers`
    number : (K,) layers in each slab
    """
    levels = background.levels
    parts = [
        low + (high - low) * np.arange(n) / n
        for low, high, n in zip(levels[:-1], levels[1:], number.tolist(), strict=True)
    ]
    heights = np.append(np.concatenate(parts), levels[-1])
    slab = np.repeat(np.arange(len(number)), number)
    layer, quad = np.nonzero(full[flat.cell][:, slab].T)
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
