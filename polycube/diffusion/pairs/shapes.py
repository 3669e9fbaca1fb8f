"""Contexts of equal shape: one canonical context for each shape, also after rotations.

cube + nothing and cube + cube have the same shape, a box; a cell with a hole along x has the shape
of one with a hole along y, rotated. A network can only recognise the shape, not the context.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from polycube.diffusion.pairs.templates import Context
from polycube.structure.lattice import collapse, lattice
from polycube.surface.frames import rotations, turn
from polycube.types import Polycube

IDENTITY = 0  # index of the identity in frames.rotations()


def shape_key(polycube: Polycube) -> bytes:
    """Key of the solid boxes, equal for equal structures with any proportions and position."""
    return _key(collapse(polycube).occupancy)


def _key(boxes: np.ndarray) -> bytes:
    return bytes(boxes.shape) + np.packbits(boxes).tobytes()


def turned_contexts(
    contexts: Sequence[Context], grid: Sequence[int], primitives: Mapping[str, np.ndarray]
) -> np.ndarray:
    """The canonical context of the shape of each context, rotated by each of frames.rotations().

    The canonical context of a shape has the most occupied cells; of several, the first is taken.

    Returns
    -------
    (C, 24, n_cells) int64 numbers of the primitives, len(primitives) for an empty cell; -1 in all
    cells if no context has the rotated shape. [:, IDENTITY] are the shapes of the contexts
    themselves.
    """
    index = {name: i for i, name in enumerate((*primitives, None))}
    cells = np.array([[index[name] for name in context] for context in contexts])
    boxes = [collapse(lattice(grid, context, primitives)).occupancy for context in contexts]
    keys = [_key(solid) for solid in boxes]
    canonical: dict[bytes, int] = {}
    for number in np.argsort((cells == index[None]).sum(axis=1), kind="stable"):
        canonical.setdefault(keys[number], number)
    cells = np.vstack([cells, np.full(cells.shape[1], -1)])  # the last one is no context
    turned = {
        key: [canonical.get(_key(turn(boxes[number], r)), -1) for r in rotations()]
        for key, number in canonical.items()
    }
    return cells[np.array([turned[key] for key in keys])]
