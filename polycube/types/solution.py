"""Results of an analysis."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from polycube.types.checks import Arrays


@dataclass(frozen=True, eq=False)
class Modes(Arrays):
    """Vibration modes in ascending order of frequency.

    Parameters
    ----------
    eigenvalues : (K,) omega^2 in 1/time^2
    shapes : (K, C, 3) displacement coefficients of the control points, mass-normalised
    mass : mass of the part
    units : units of length, mass, time and frequency
    rigid : number of rigid modes, which come first
    errors : estimated relative errors of the frequencies of the first elastic modes
    """

    eigenvalues: Annotated[np.ndarray, "K"]
    shapes: Annotated[np.ndarray, "K C 3"]
    mass: float
    units: dict[str, str] = field(default_factory=dict)
    rigid: int = 6
    errors: tuple[float, ...] = ()

    @property
    def frequency(self) -> np.ndarray:
        """(K,) frequencies in cycles per unit of time; negative eigenvalues count as zero."""
        return np.sqrt(np.maximum(self.eigenvalues, 0)) / (2 * np.pi)


@dataclass(frozen=True)
class Peak:
    """A maximum of the von Mises stress.

    Parameters
    ----------
    value : stress
    at : (3,) place in the units of the part
    error : estimated error of the value
    on : name of the boundary set at this place
    what : kind of the singular place near the maximum, where the exact stress is unbounded
    distance : from that place, in the units of the part
    """

    value: float
    at: tuple[float, ...]
    error: float
    on: str = ""
    what: str = ""
    distance: float = 0.0


@dataclass(frozen=True, eq=False)
class Deformation(Arrays):
    """Elastic solid in static equilibrium; the fields are Bezier coefficients.

    Parameters
    ----------
    displacement : (B, 3) at the Bezier nodes, in the length unit of the part
    stress : (B, 6) components xx, yy, zz, yz, zx, xy at the Bezier nodes
    von_mises : (B,) von Mises stress at the Bezier nodes
    supports : names of the supports
    reactions : (S, 3) force of each support on the solid
    load : (3,) resultant of all loads
    strain_energy : strain energy
    mass : mass of the part
    units : units of length, stress, force, energy and mass
    peak : largest stress away from singular places
    singular : larger stress near a singular place, if any
    poor : number of elements whose stress is ignored because of their bad shape
    stress_error : estimated error of the stress, relative, in the energy norm
    displacement_error : estimated error of the displacement, in the length unit of the part
    sections : (P, 3) preload, resultant of the stress over its section, and tightening of each
    """

    displacement: Annotated[np.ndarray, "B 3"]
    stress: Annotated[np.ndarray, "B 6"]
    von_mises: Annotated[np.ndarray, "B"]
    supports: tuple[str, ...]
    reactions: Annotated[np.ndarray, "S 3"]
    load: Annotated[np.ndarray, "3"]
    strain_energy: float
    mass: float
    units: dict[str, str] = field(default_factory=dict)
    peak: Peak | None = None
    singular: Peak | None = None
    poor: int = 0
    stress_error: float | None = None
    displacement_error: float | None = None
    sections: Annotated[np.ndarray, "P 3"] = field(default_factory=lambda: np.zeros((0, 3)))


@dataclass(frozen=True, eq=False)
class Potential(Arrays):
    """Solution u of -div k grad u = f, such as a temperature, and its flux -k grad u.

    Parameters
    ----------
    values : (C,) coefficients of u at the control points
    flux : (B, 3) Bezier coefficients of the flux
    flux_error : estimated error of the flux, relative, in the energy norm
    u_error : estimated error of u
    supports : names of the places where u is prescribed
    flows : (S,) flow into the solid through each of these places
    supplied : flow into the solid from sources and prescribed fluxes
    units : units of length, u, flux and flow
    """

    values: Annotated[np.ndarray, "C"]
    flux: Annotated[np.ndarray, "B 3"]
    supports: tuple[str, ...]
    flows: Annotated[np.ndarray, "S"]
    supplied: float
    units: dict[str, str] = field(default_factory=dict)
    flux_error: float | None = None
    u_error: float | None = None


Solution = Modes | Deformation | Potential  # what an analysis may give
