"""What an analysis solves, in places of the boundary: what the deck of another program needs.

Lengths, and displacements with them, are in the unit of the part; everything else is in SI.
"""

from __future__ import annotations

from dataclasses import dataclass

from polycube.analysis.material import Material

Vector = tuple[float, float, float]
NOTHING: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Prescribed:
    """Given values of some components at a place; the last one that names a place rules there."""

    place: object  # as `polycube.analysis.boundary_sets.quads_of` reads it
    components: tuple[int, ...]
    values: tuple[float, ...]  # one for each component


@dataclass(frozen=True)
class Applied:
    """Forces on the faces of a place; what is given adds up."""

    place: object
    pressure: float = 0.0  # Pa, towards the solid
    traction: Vector = NOTHING  # Pa
    force: Vector = NOTHING  # N in all, evenly per area


@dataclass(frozen=True)
class Flow:
    """Flux into the solid through the faces of a place."""

    place: object
    flux: float  # W/m^2


@dataclass(frozen=True)
class Problem:
    """What all problems have: the length unit of the part, and what is held."""

    units: str
    supports: tuple[Prescribed, ...]

    @property
    def places(self) -> list[object]:
        """What it needs to find on the boundary."""
        return [each.place for each in self.supports]


@dataclass(frozen=True)
class Statics(Problem):
    """An elastic solid at rest."""

    material: Material
    loads: tuple[Applied, ...]
    acceleration: Vector  # of gravity, m/s^2

    @property
    def places(self) -> list[object]:
        """What it needs to find on the boundary."""
        return [*super().places, *(each.place for each in self.loads)]


@dataclass(frozen=True)
class Vibration(Problem):
    """The lowest modes of an elastic solid."""

    material: Material
    modes: int
    is_lumped: bool = False  # the mass matrix


@dataclass(frozen=True)
class Conduction(Problem):
    """Heat conduction; component 0 is the temperature."""

    conductivity: float  # W/(m K)
    flows: tuple[Flow, ...]
    source: float  # W/m^3

    @property
    def places(self) -> list[object]:
        """What it needs to find on the boundary."""
        return [*super().places, *(each.place for each in self.flows)]
