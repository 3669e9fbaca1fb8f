"""Hexes of the columns above the quads of a section."""

from __future__ import annotations

import numpy as np

from polycube.hexmesh.connectivity import hex_mesh
from polycube.types import HexMesh

from .section import Section


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


def columns(flat: Section, levels: np.ndarray, full: np.ndarray, number: np.ndarray) -> HexMesh:
    """Hexes of all full cells, in the coordinates of the section and its axis.

    Parameters
    ----------
    levels, full : as in `layers`
    number : (K,) layers in each slab
    """
    parts = [
        low + (high - low) * np.arange(n) / n
        for low, high, n in zip(levels[:-1], levels[1:], number.tolist(), strict=True)
    ]
    heights = np.append(np.concatenate(parts), levels[-1])
    slab = np.repeat(np.arange(len(number)), number)
    layer, quad = np.nonzero(full[flat.cell][:, slab].T)
    size = len(flat.vertices)
    below = flat.quads[quad] + layer[:, None] * size
    hexes = np.concatenate([below, below + size], axis=1)
    used, hexes = np.unique(hexes, return_inverse=True)
    height, vertex = np.divmod(used, size)
    vertices = np.column_stack([flat.vertices[vertex], heights[height]])
    return hex_mesh(vertices, hexes.reshape(-1, 8))
