"""Free vibration modes."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass

from polycube.registry import register
from polycube.spline.modal import MATERIALS, METRES, Material, free_modes
from polycube.types import Modes, Spline

logger = logging.getLogger(__name__)


@register("analysis", "modal")
@dataclass(frozen=True)
class Modal:
    """Lowest free vibration modes of the elastic solid, the six rigid ones first."""

    material: str | Mapping[str, float] = "steel"  # a name, or {young, poisson, density} in SI
    units: str = "mm"  # length unit of the part
    modes: int = 20  # with the six rigid ones
    gauss: int = 4  # points per direction
    mass: str = "consistent"  # or lumped: row sums

    def __post_init__(self) -> None:
        self._material()
        if self.units not in METRES:
            raise ValueError(f"units must be one of {', '.join(METRES)}; got {self.units!r}")
        if self.mass not in ("consistent", "lumped"):
            raise ValueError(f"mass must be consistent or lumped; got {self.mass!r}")
        if self.modes < 1 or self.gauss < 2:
            raise ValueError(
                f"modes >= 1 and gauss >= 2 are needed; got {self.modes}, {self.gauss}"
            )

    def __call__(self, spline: Spline) -> Modes:
        """The modes in SI units; logs mass and the elastic frequencies."""
        modes = free_modes(
            spline, self._material(), self.modes, self.units, self.gauss, self.mass == "lumped"
        )
        logger.info(
            "mass %.6g kg; elastic modes at %s Hz",
            modes.mass,
            " ".join(f"{f:.5g}" for f in modes.frequency[6:]) or "none asked for",
        )
        return modes

    def _material(self) -> Material:
        if self.material in list(MATERIALS):
            return MATERIALS[self.material]
        if isinstance(self.material, str) or set(self.material) != {"young", "poisson", "density"}:
            raise ValueError(
                f"material must be one of {', '.join(MATERIALS)} or "
                f"{{young, poisson, density}}; got {self.material!r}"
            )
        return Material(**self.material)
