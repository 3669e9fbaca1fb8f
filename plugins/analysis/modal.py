"""Vibration modes."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from polycube.analysis.problem import Vibration, material
from polycube.analysis.supports import prescribed, supports
from polycube.registry import register
from polycube.types import Modes, Spline
from polycube.types.options import Count

from .places import OfProblem, check_supports

logger = logging.getLogger(__name__)


@register("analysis", "modal")
@dataclass(frozen=True)
class Modal(OfProblem):
    """Lowest vibration modes of the elastic solid, free or with supports; frequencies in Hz.

    Parameters
    ----------
    material : steel, aluminium, titanium, brass, abs, or {young: 210e9, poisson: 0.3, density:
        7850}, in Pa and kg/m^3
    modes : number of modes, including rigid ones (six without supports)
    fixed : supports: [x_min], [hole_1, 7], [{at: z_min, components: [z]}]; see
        docs/reference/analysis.md
    mass : mass matrix: consistent, or lumped (row sums; much less accurate)
    enrich : compute frequencies in all continuous tricubic functions, with errors; false, and with
        a lumped mass: in the functions of the spline
    """

    material: str | Mapping[str, float] = "steel"
    modes: Count = 20
    fixed: tuple[object, ...] = ()
    mass: Literal["consistent", "lumped"] = "consistent"
    enrich: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        material(self.material)
        check_supports("fixed", self.fixed, {"components"})

    @property
    def problem(self) -> Vibration:
        """The problem, for input files of other solvers."""
        fixed, lumped = prescribed(self.fixed), self.mass == "lumped"
        solid = material(self.material)
        return Vibration(self.units, fixed, solid, self.modes, lumped, cyclic_symmetry=self.cyclic)

    def __call__(self, spline: Spline) -> Modes:
        """The modes in SI units; logs mass and the elastic frequencies."""
        from polycube.analysis.modal import free_modes

        problem = self.problem
        modes = free_modes(
            spline,
            self.of_elements or problem.material,
            problem.modes,
            problem.units,
            self.gauss,
            problem.is_lumped,
            supports(spline, problem.supports),
            self.enrich and not problem.is_lumped,
            problem.cyclic_symmetry,
        )
        elastic = " ".join(f"{f:.5g}" for f in modes.frequency[modes.rigid :]) or "none requested"
        logger.info("mass %.6g kg; elastic modes at %s Hz", modes.mass, elastic)
        return modes
