"""Vibration modes."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass

from polycube.analysis.material import check_units, material
from polycube.analysis.modal import free_modes
from polycube.registry import register
from polycube.types import Modes, Spline

from .places import check_supports, places, supports

logger = logging.getLogger(__name__)


@register("analysis", "modal")
@dataclass(frozen=True)
class Modal:
    """Lowest vibration modes of the elastic solid, rigid ones first; free, or held on patches."""

    material: str | Mapping[str, float] = "steel"  # a name, or {young, poisson, density} in SI
    units: str = "mm"  # length unit of the part
    modes: int = 20  # with the rigid ones
    fixed: tuple[object, ...] = ()  # places held, see `places`
    gauss: int = 4  # points per direction
    mass: str = "consistent"  # or lumped: row sums

    def __post_init__(self) -> None:
        material(self.material)
        check_units(self.units)
        if self.mass not in ("consistent", "lumped"):
            raise ValueError(f"mass must be consistent or lumped; got {self.mass!r}")
        if self.modes < 1 or self.gauss < 2:
            raise ValueError(
                f"modes >= 1 and gauss >= 2 are needed; got {self.modes}, {self.gauss}"
            )
        check_supports("fixed", self.fixed, {"components"})

    @property
    def places(self) -> list[object]:
        """What it needs to find on the boundary."""
        return [place for place, _ in places(self.fixed)]

    def __call__(self, spline: Spline) -> Modes:
        """The modes in SI units; logs mass and the elastic frequencies."""
        modes = free_modes(
            spline,
            material(self.material),
            self.modes,
            self.units,
            self.gauss,
            self.mass == "lumped",
            supports(spline, self.fixed),
        )
        logger.info(
            "mass %.6g kg; elastic modes at %s Hz",
            modes.mass,
            " ".join(f"{f:.5g}" for f in modes.frequency[modes.rigid :]) or "none asked for",
        )
        return modes
