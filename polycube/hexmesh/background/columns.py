"""Hexes of the columns above the quads of a section."""

import numpy as np

from polycube.hexmesh.background.background import Background
from polycube.hexmesh.background.section import Section
from polycube.hexmesh.connectivity import hex_mesh
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
    heights = heights_of(background.levels, number)
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


def heights_of(levels: np.ndarray, number: np.ndarray) -> np.ndarray:
    """(N + 1,) levels of the layers, for their number (K,) between levels (K + 1,)."""
    parts = [
        low + (high - low) * np.arange(n) / n
        for low, high, n in zip(levels[:-1], levels[1:], number.tolist(), strict=True)
    ]
    return np.append(np.concatenate(parts), levels[-1])
