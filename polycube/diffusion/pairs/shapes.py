"""Contexts of equal shape: one name for them all, also after a turn by the cube's rotations.

cube + nothing and cube + cube are one shape, a box; a cell with a hole along x is the shape of one
with a hole along y, turned.  A network can only be asked for the shape, not for its spelling.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from polycube.diffusion.pairs.templates import Context
from polycube.structure.lattice import collapse, lattice
from polycube.surface.frames import rotations, turn
from polycube.types import Polycube

UNTURNED = 0  # index of the identity in frames.rotations()


def shape_key(polycube: Polycube) -> bytes:
    """Which boxes are solid, equal for equal structures whatever their proportions and place."""
    return _key(collapse(polycube).occupancy)


def _key(boxes: np.ndarray) -> bytes:
    return bytes(boxes.shape) + np.packbits(boxes).tobytes()


def turned_contexts(
    contexts: Sequence[Context], grid: Sequence[int], primitives: Mapping[str, np.ndarray]
) -> np.ndarray:
    """The canonical context of the shape of each context, turned by each of frames.rotations().

    Canonical is the fullest context of a shape, of these the first.

    Returns
    -------
    (C, 24, n_cells) int64 into the primitives, len(primitives) where empty; -1 in all cells where
    none of the contexts has the turned shape.  [:, UNTURNED] are the contexts' own shapes.
    """
    index = {name: i for i, name in enumerate((*primitives, None))}
    cells = np.array([[index[name] for name in context] for context in contexts])
    boxes = [collapse(lattice(grid, context, primitives)).occupancy for context in contexts]
    keys = [_key(solid) for solid in boxes]
    canonical: dict[bytes, int] = {}
    for number in np.argsort((cells == index[None]).sum(axis=1), kind="stable"):
        canonical.setdefault(keys[number], number)
    cells = np.vstack([cells, np.full(cells.shape[1], -1)])  # the last is no context
    turned = {
        key: [canonical.get(_key(turn(boxes[number], r)), -1) for r in rotations()]
        for key, number in canonical.items()
    }
    return cells[np.array([turned[key] for key in keys])]
