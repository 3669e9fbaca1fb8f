"""Polycubes and maps from them to a model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from polycube.types.checks import Arrays, freeze

PerAxis = tuple[np.ndarray, np.ndarray, np.ndarray]  # one array for each of x, y and z
AXES = ("+x", "-x", "+y", "-y", "+z", "-z")  # the axis labels 0..5


@dataclass(frozen=True, eq=False)
class Polycube(Arrays):
    """Union of axis-aligned boxes on a rectilinear lattice.

    Box (i, j, k) is [x_i, x_i+1] x [y_j, y_j+1] x [z_k, z_k+1]. A grid cell has edges of length 1.

    Parameters
    ----------
    occupancy : (X, Y, Z) bool, True for full boxes
    x, y, z : (X + 1,), (Y + 1,), (Z + 1,) ascending coordinates of the lattice planes
    grid : number of grid cells along each axis
    context : primitive of each grid cell, x varies slowest; None for an empty cell

    Raises
    ------
    ValueError
        If shapes do not match, knots do not ascend, or the context has a wrong length.
    """

    occupancy: Annotated[np.ndarray, "X Y Z bool"]
    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    grid: tuple[int, int, int]
    context: tuple[str | None, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, size in zip("xyz", self.occupancy.shape, strict=True):
            freeze(self, **{name: str(size + 1)})
            if (np.diff(getattr(self, name)) <= 0).any():
                raise ValueError(f"Polycube.{name} must ascend; got {getattr(self, name)}")
        if len(self.context) != np.prod(self.grid):
            what = f"Polycube.context must name {np.prod(self.grid)} cells of grid {self.grid}"
            raise ValueError(f"{what}; got {self.context}")

    @property
    def knots(self) -> PerAxis:
        """The three knot vectors."""
        return self.x, self.y, self.z


@dataclass(frozen=True, eq=False)
class RoughMap(Arrays):
    """Approximate map from a polycube to the model, trilinear between control positions.

    Parameters
    ----------
    x, y, z : (X,), (Y,), (Z,) ascending polycube coordinates of the control planes
    positions : (X, Y, Z, 3) positions in the model, in the user's units
    """

    x: Annotated[np.ndarray, "X"]
    y: Annotated[np.ndarray, "Y"]
    z: Annotated[np.ndarray, "Z"]
    positions: Annotated[np.ndarray, "X Y Z 3"]


@dataclass(frozen=True, eq=False)
class Labels(Arrays):
    """Polycube face of each triangle of the input surface.

    Parameters
    ----------
    axis : (F,) direction of the face, 0 to 5, see `AXES`
    patch : (F,) number of the maximal connected plane face of the polycube
    """

    axis: Annotated[np.ndarray, "F int"]
    patch: Annotated[np.ndarray, "F int"]

    bounds: ClassVar = {"axis": 6}


@dataclass(frozen=True, eq=False)
class Parametrization(Arrays):
    """Place of each vertex of the surface on the polycube.

    Parameters
    ----------
    positions : (V, 3) polycube coordinates; a grid cell has edges of length 1
    """

    positions: Annotated[np.ndarray, "V 3"]
