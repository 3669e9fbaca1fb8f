"""Results of an analysis."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from polycube.types.checks import freeze


@dataclass(frozen=True, eq=False)
class Modes:
    """Vibration modes, ascending."""

    eigenvalues: np.ndarray  # (K,) omega^2 in 1/time^2
    shapes: np.ndarray  # (K, C, 3) displacement of each control point, mass-normalised
    mass: float
    units: dict[str, str] = field(default_factory=dict)  # of length, mass, time, frequency
    rigid: int = 6  # of them, the first ones, are motions that deform nothing

    def __post_init__(self) -> None:
        freeze(self, eigenvalues=("K", np.float64), shapes=("K C 3", np.float64))

    @property
    def frequency(self) -> np.ndarray:
        """(K,) cycles per unit of time; rounding below zero counts as zero."""
        return np.sqrt(np.maximum(self.eigenvalues, 0)) / (2 * np.pi)


@dataclass(frozen=True)
class Peak:
    """A largest von Mises stress."""

    value: float
    at: tuple[float, ...]  # (3,) place
    error: float  # estimate of how far off the value is
    on: str = ""  # name of the boundary face there
    what: str = ""  # singular place that it is near, where the stress has no bound


@dataclass(frozen=True, eq=False)
class Deformation:
    """Elastic solid at rest under load.  Stresses are Bezier coefficients, as the geometry's."""

    displacement: np.ndarray  # (C, 3) of the control points, in the part's length unit
    stress: np.ndarray  # (B, 6) xx yy zz yz zx xy
    von_mises: np.ndarray  # (B,)
    supports: tuple[str, ...]
    reactions: np.ndarray  # (S, 3) force of each support on the solid
    load: np.ndarray  # (3,) resultant of everything applied
    strain_energy: float
    mass: float
    units: dict[str, str] = field(default_factory=dict)  # of length, stress, force, energy, mass
    peak: Peak | None = None  # the largest stress away from singular places
    singular: Peak | None = None  # a larger one near a singular place
    poor: int = 0  # elements of so bad a shape that their stress does not count
    stress_error: float | None = None  # estimated, in the energy norm, share of the stress

    def __post_init__(self) -> None:
        freeze(
            self,
            displacement=("C 3", np.float64),
            stress=("B 6", np.float64),
            von_mises=("B", np.float64),
            reactions=("S 3", np.float64),
            load=("3", np.float64),
        )


@dataclass(frozen=True, eq=False)
class Potential:
    """Solution u of -div k grad u = f, such as a temperature, and its flux -k grad u."""

    values: np.ndarray  # (C,) of the control points
    flux: np.ndarray  # (B, 3) Bezier coefficients, as the geometry's
    supports: tuple[str, ...]  # where u is given
    flows: np.ndarray  # (S,) into the solid through each
    supplied: float  # into the solid by everything else, sources and given fluxes
    units: dict[str, str] = field(default_factory=dict)  # of length, u, flux, flow

    def __post_init__(self) -> None:
        freeze(
            self,
            values=("C", np.float64),
            flux=("B 3", np.float64),
            flows=("S", np.float64),
        )


Solution = Modes | Deformation | Potential  # what an analysis may give
