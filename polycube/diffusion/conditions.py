"""Condition of a denoiser: contexts on a grid of primitives, or arbitrary structures.

The condition determines the additional input for a part, the labels, and the number of points. Its
value for a part is a context, or a genus.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from polycube.diffusion.encoding import box_of, image_size, pixels_of
from polycube.diffusion.pairs.any_structure import LatticePair
from polycube.diffusion.pairs.lattices import MOST_HANDLES, MOST_SLABS
from polycube.diffusion.pairs.pairs import Pair
from polycube.structure.primitives import Item, primitive_name

AXES = 6  # number of directions of a face


class Condition(ABC):
    """Common properties of the two conditions; without a grid it is empty.

    grid : cells along x, y, z
    cells, primitives : possible contents of a cell, as configured and by name, in the order of the
        vector
    length : length of the vector that is the input of a network
    labels : number of classes of each label of a point, by name
    image : height and width of the image of the points
    origin : (3,) offset from a polycube to the centre of the learning frame
    """

    grid: tuple[int, ...] = ()
    cells: tuple[Item, ...] = ()
    primitives: tuple[str, ...] = ()
    length: int
    labels: Mapping[str, int]
    image: tuple[int, int]
    origin: np.ndarray

    @abstractmethod
    def value_of(self, pair: Any) -> Any:
        """The value of the condition for a pair, as an argument of `vector`."""

    @abstractmethod
    def vector(self, value: Any) -> np.ndarray:
        """(length,) float32 vector: a value as input of a network."""

    @abstractmethod
    def pixels(self, value: Any, pads: bool) -> np.ndarray:
        """(N,) pixels of the sample points of a geometry; pads : those of occupied cells only."""

    def box(self, value: Any, pads: bool) -> np.ndarray:
        """(2, 3) box of a geometry, see `encoding.learning_frame`."""
        return box_of(self.grid, value, pads)


class GridContexts(Condition):
    """Contexts on a grid of primitives, as context vectors.

    The labels of a point are the axis of its polycube face, the cell, and whether it is in a hole.
    """

    def __init__(self, grid: Sequence[int], primitives: Sequence[Item]) -> None:
        n_cells = int(np.prod(grid))
        self.grid, self.cells = tuple(grid), tuple(primitives)
        self.primitives = tuple(map(primitive_name, primitives))
        self.length = 4 * (len(primitives) * n_cells - 1) + 1
        self.labels = {"axis": AXES, "cell": n_cells, "wall": 2}
        self.image, self.origin = image_size(grid), np.array(grid) / 2

    def value_of(self, pair: Pair) -> Sequence[str | None]:
        """The context of a pair."""
        return pair.context

    def vector(self, value: Sequence[str | None]) -> np.ndarray:
        """1 at 4 (n_cells p + cell) for primitive p of each cell; 29 numbers for the paper's grid.

        Raises LookupError for a primitive outside the training set.
        """
        unknown = [name for name in value if name is not None and name not in self.primitives]
        if unknown:
            known = ", ".join(self.primitives)
            raise LookupError(f"no primitive named {unknown[0]!r}; have {known}")
        n_cells = int(np.prod(self.grid))
        if len(value) != n_cells:
            raise ValueError(f"context must name {n_cells} cells; got {tuple(value)}")
        vector = np.zeros(self.length, np.float32)
        for cell, name in enumerate(value):
            if name is not None:
                vector[4 * (n_cells * self.primitives.index(name) + cell)] = 1
        return vector

    def pixels(self, value: Sequence[str | None], pads: bool) -> np.ndarray:
        """512 points for each cell."""
        return pixels_of(value, pads)


class AnyStructure(Condition):
    """Arbitrary lattices in the learning frame of a part; the input is the genus, if it is known.

    The labels of a point are the axis of its polycube face and the number of the knot on that axis.
    """

    length = MOST_HANDLES + 2
    labels = MappingProxyType({"axis": AXES, "knot": MOST_SLABS + 1})
    image = (16, 16)
    origin = np.zeros(3)

    def value_of(self, pair: LatticePair) -> int | None:
        """The genus of a pair, if it is known."""
        return pair.genus

    def vector(self, value: int | None) -> np.ndarray:
        """1 at the genus; at the end if it is unknown, or larger than any in the training."""
        has_entry = value is not None and 0 <= value <= MOST_HANDLES
        vector = np.zeros(self.length, np.float32)
        vector[value if has_entry else -1] = 1
        return vector

    def pixels(self, value: int | None, pads: bool) -> np.ndarray:
        """All pixels of the image."""
        return np.arange(self.image[0] * self.image[1])


def condition(grid: Sequence[int] | None, primitives: Sequence[Item]) -> Condition:
    """The condition for a grid and its primitives, or for arbitrary structures without a grid."""
    return GridContexts(grid, primitives) if grid else AnyStructure()
