"""The problem that an analysis solves: materials, and supports and loads at places of the boundary.

Lengths and displacements are in the unit of the part; all other quantities are in SI units.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

Vector = tuple[float, float, float]
NOTHING: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic material in SI units."""

    young: float  # Pa
    poisson: float
    density: float  # kg/m^3

    def __post_init__(self) -> None:
        if not (self.young > 0 and self.density > 0 and -1 < self.poisson < 0.5):
            raise ValueError(
                f"material needs young > 0, density > 0 and -1 < poisson < 0.5; got "
                f"young={self.young:g}, poisson={self.poisson:g}, density={self.density:g}"
            )

    @property
    def shear(self) -> float:
        """Shear modulus in Pa."""
        return self.young / (2 * (1 + self.poisson))

    @property
    def lame(self) -> float:
        """First parameter of Lame in Pa."""
        return 2 * self.shear * self.poisson / (1 - 2 * self.poisson)

    def stress(self, slope: np.ndarray) -> np.ndarray:
        """(P, 6) stresses xx yy zz yz zx xy of displacement gradients (P, 3, 3)."""
        strain = (slope + slope.swapaxes(1, 2)) / 2
        dilation = np.trace(strain, axis1=1, axis2=2)[:, None, None]
        stress = 2 * self.shear * strain + self.lame * dilation * np.eye(3)
        return stress[:, [0, 1, 2, 1, 2, 0], [0, 1, 2, 2, 0, 1]]

    def work(self, slope: np.ndarray) -> np.ndarray:
        """(P, 1) products of stress and strain of displacement gradients (P, 3, 3)."""
        strain = (slope + slope.swapaxes(1, 2)) / 2
        square = (strain**2).sum(axis=(1, 2))
        found = 2 * self.shear * square + self.lame * np.trace(strain, axis1=1, axis2=2) ** 2
        return found[:, None]


MATERIALS = {
    "steel": Material(210e9, 0.30, 7850),
    "aluminium": Material(70e9, 0.33, 2700),
    "titanium": Material(114e9, 0.34, 4430),
    "brass": Material(105e9, 0.34, 8500),
    "abs": Material(2.3e9, 0.35, 1050),
}


def material(value: str | Mapping[str, float]) -> Material:
    """A material by its name or its values {young, poisson, density}; raises ValueError."""
    if value in list(MATERIALS):
        return MATERIALS[value]
    if isinstance(value, str) or set(value) != {"young", "poisson", "density"}:
        raise ValueError(
            f"material must be one of {', '.join(MATERIALS)} or "
            f"{{young, poisson, density}}; got {value!r}"
        )
    return Material(**value)


@dataclass(frozen=True)
class Prescribed:
    """Prescribed values of some components at a place; the last one of a place has precedence."""

    place: object  # in a form that `polycube.analysis.boundary_sets.quads_of` accepts
    components: tuple[int, ...]
    values: tuple[float, ...]  # one for each component


@dataclass(frozen=True)
class Applied:
    """Forces on the faces of a place; the contributions are added."""

    place: object
    pressure: float = 0.0  # Pa, positive towards the solid
    traction: Vector = NOTHING  # Pa
    force: Vector = NOTHING  # N, total force, distributed evenly by area


@dataclass(frozen=True)
class Flow:
    """Flux into the solid through the faces of a place."""

    place: object
    flux: float  # W/m^2


@dataclass(frozen=True)
class Problem:
    """Common properties of all problems: the length unit of the part, and the supports."""

    units: str
    supports: tuple[Prescribed, ...]

    @property
    def places(self) -> list[object]:
        """The places on the boundary that are needed."""
        return [each.place for each in self.supports]


@dataclass(frozen=True)
class Statics(Problem):
    """Statics of an elastic solid."""

    material: Material
    loads: tuple[Applied, ...]
    acceleration: Vector  # of gravity, m/s^2

    @property
    def places(self) -> list[object]:
        """The places on the boundary that are needed."""
        return [*super().places, *(each.place for each in self.loads)]


@dataclass(frozen=True)
class Vibration(Problem):
    """The lowest vibration modes of an elastic solid."""

    material: Material
    modes: int
    is_lumped: bool = False  # lumped mass matrix


@dataclass(frozen=True)
class Conduction(Problem):
    """Heat conduction; component 0 is the temperature."""

    conductivity: float  # W/(m K)
    flows: tuple[Flow, ...]
    source: float  # W/m^3

    @property
    def places(self) -> list[object]:
        """The places on the boundary that are needed."""
        return [*super().places, *(each.place for each in self.flows)]
