"""What a denoiser knows of its structures: contexts on a grid of primitives, or any structure.

All of a denoiser that depends on it is here: what it is told of a part beside its points, what its
labels are, and how many points it sees.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from polycube.diffusion.encoding import context_length, context_vector, image_size
from polycube.diffusion.pairs.any_structure import LatticePair
from polycube.diffusion.pairs.lattices import MOST_HANDLES, MOST_SLABS
from polycube.diffusion.pairs.pairs import Pair, n_sample_points
from polycube.structure.primitives import Item, primitive_name

AXES = 6  # directions of a face


class Condition(ABC):
    """What all kinds of structures have in common; for structures without a grid it is empty.

    Attributes
    ----------
    grid : cells along x, y, z
    cells, primitives : what may fill a cell, as configured and by name, in the order of the vector
    length : of the vector that a network is told
    labels : number of classes of each label of a point, by name
    image : height and width of the points' image
    origin : (3,) of a polycube, seen from the middle of the learning frame, with its sign changed
    """

    grid: tuple[int, ...] = ()
    cells: tuple[Item, ...] = ()
    primitives: tuple[str, ...] = ()
    length: int
    labels: Mapping[str, int]
    image: tuple[int, int]
    origin: np.ndarray

    @abstractmethod
    def told(self, pair: Any) -> Any:
        """What a network is told of a pair: something for `vector`."""

    @abstractmethod
    def vector(self, told: Any) -> np.ndarray:
        """(length,) float32."""

    @abstractmethod
    def n_points(self, told: Any, pads: bool) -> int:
        """Sample points of a geometry; pads : single cells have 512 points and zeros."""


class GridContexts(Condition):
    """Fillings of a grid with primitives, each told as its context vector.

    A label is the axis of the polycube's face, its cell, and whether it is a hole's.
    """

    def __init__(self, grid: Sequence[int], primitives: Sequence[Item]) -> None:
        n_cells = int(np.prod(grid))
        self.grid, self.cells = tuple(grid), tuple(primitives)
        self.primitives = tuple(map(primitive_name, primitives))
        self.length = context_length(len(self.primitives), n_cells)
        self.labels = {"axis": AXES, "cell": n_cells, "wall": 2}
        self.image, self.origin = image_size(grid), np.array(grid) / 2

    def told(self, pair: Pair) -> Sequence[str | None]:
        """Its context."""
        return pair.context

    def vector(self, told: Sequence[str | None]) -> np.ndarray:
        """The context vector; raises LookupError for a primitive that was not trained."""
        return context_vector(told, self.primitives, int(np.prod(self.grid)))

    def n_points(self, told: Sequence[str | None], pads: bool) -> int:
        """512 for each cell."""
        return n_sample_points(tuple(told), pads)


class AnyStructure(Condition):
    """Any lattice, in the learning frame of its part; only the genus is told, or that none is.

    A label is the axis of the polycube's face and the number of its knot on that axis.
    """

    length = MOST_HANDLES + 2
    labels = MappingProxyType({"axis": AXES, "knot": MOST_SLABS + 1})
    image = (16, 16)
    origin = np.zeros(3)

    def told(self, pair: LatticePair) -> int | None:
        """Its genus, where it is known."""
        return pair.genus

    def vector(self, told: int | None) -> np.ndarray:
        """1 at the genus; at the end where it is unknown, or larger than any that is trained."""
        known = told is not None and 0 <= told <= MOST_HANDLES
        vector = np.zeros(self.length, np.float32)
        vector[told if known else -1] = 1
        return vector

    def n_points(self, told: int | None, pads: bool) -> int:
        """As many as the image has pixels."""
        return self.image[0] * self.image[1]


def condition(grid: Sequence[int] | None, primitives: Sequence[Item]) -> Condition:
    """That of a grid and its primitives, or of any structure where there is no grid."""
    return GridContexts(grid, primitives) if grid else AnyStructure()
