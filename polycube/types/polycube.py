"""Polycubes, and maps from them to a model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polycube.types.checks import freeze

PerAxis = tuple[np.ndarray, np.ndarray, np.ndarray]  # one array for each of x, y and z
OVERLAY = "overlay"  # family of the lattices as fine as the hexes
DRAWN = "drawn"  # family of the structures drawn by a network without a grid
SWEEP = "sweep"  # family of sections swept along an axis
SPARE = "spare"  # family of those with another genus than the part's, where nothing else will do
AXES = ("+x", "-x", "+y", "-y", "+z", "-z")  # the axis labels 0..5


@dataclass(frozen=True, eq=False)
class Polycube:
    """Union of axis-aligned boxes on a rectilinear lattice; the one source of its faces and genus.

    Box (i, j, k) fills [x_i, x_i+1] x [y_j, y_j+1] x [z_k, z_k+1]; a grid cell has edge 1.
    """

    occupancy: np.ndarray  # (X, Y, Z) bool
    x: np.ndarray  # (X + 1,) knots, ascending
    y: np.ndarray
    z: np.ndarray
    grid: tuple[int, int, int]
    context: tuple[str | None, ...]  # primitive per grid cell, x slowest; None where empty

    def __post_init__(self) -> None:
        freeze(self, occupancy=("X Y Z", bool))
        for name, size in zip("xyz", self.occupancy.shape, strict=True):
            freeze(self, **{name: (str(size + 1), np.float64)})
            if (np.diff(getattr(self, name)) <= 0).any():
                raise ValueError(f"Polycube.{name} must ascend; got {getattr(self, name)}")
        if len(self.context) != np.prod(self.grid):
            raise ValueError(
                f"Polycube.context must name {np.prod(self.grid)} cells of grid {self.grid}; "
                f"got {self.context}"
            )

    @property
    def knots(self) -> PerAxis:
        """The three knot vectors."""
        return self.x, self.y, self.z


@dataclass(frozen=True, eq=False)
class RoughMap:
    """Where points of a polycube lie in the model, roughly: trilinear between control positions."""

    x: np.ndarray  # (X,) polycube coordinates of the control planes, ascending
    y: np.ndarray  # (Y,)
    z: np.ndarray  # (Z,)
    positions: np.ndarray  # (X, Y, Z, 3) in the user's units

    def __post_init__(self) -> None:
        freeze(
            self,
            x=("X", np.float64),
            y=("Y", np.float64),
            z=("Z", np.float64),
            positions=("X Y Z 3", np.float64),
        )


@dataclass(frozen=True, eq=False)
class Labels:
    """Polycube face that each face of the input surface belongs to."""

    axis: np.ndarray  # (F,) 0..5, see AXES
    patch: np.ndarray  # (F,) maximal planar connected face of the polycube

    def __post_init__(self) -> None:
        freeze(self, axis=("F", np.int64), patch=("F", np.int64))


@dataclass(frozen=True, eq=False)
class Parametrization:
    """Where each input vertex lies on the polycube."""

    positions: np.ndarray  # (V, 3), cell edge 1

    def __post_init__(self) -> None:
        freeze(self, positions=("V 3", np.float64))
