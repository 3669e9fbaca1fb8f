"""Heat conduction and other problems of the form -div k grad u = f."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass

from polycube.analysis.problem import Conduction, Flow, Prescribed
from polycube.analysis.supports import is_number, split, supports
from polycube.registry import register
from polycube.types import Potential, Spline
from polycube.types.options import Positive

from .places import OfProblem, check_items

logger = logging.getLogger(__name__)

ENDS = ({"at": "z_min", "value": 0.0}, {"at": "z_max", "value": 1.0})


@register("analysis", "poisson")
@dataclass(frozen=True)
class Poisson(OfProblem):
    """Poisson's equation -div k grad u = f, such as heat conduction.

    On boundary sets, u or the flux is prescribed. On the rest of the boundary the flux is zero.

    Parameters
    ----------
    conductivity : k in W/(m K)
    fixed : places where u is prescribed, in K (or another unit of u): [{at: z_min, value: 0}]; see
        docs/reference/analysis.md
    flux : flux into the solid in W/m^2: [{at: x_max, value: 1000}]
    source : f in W/m^3
    """

    conductivity: Positive = 50.0
    fixed: tuple[Mapping[str, object], ...] = ENDS
    flux: tuple[Mapping[str, object], ...] = ()
    source: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, items in {"fixed": self.fixed, "flux": self.flux}.items():
            for _, item in check_items(name, items, {"value"}, needed=1):
                if not is_number(item["value"]):
                    raise ValueError(f"{name}: value must be a number; got {item['value']!r}")

    @property
    def problem(self) -> Conduction:
        """The problem, for input files of other solvers."""
        fixed = tuple(Prescribed(at, (0,), (item["value"],)) for at, item in map(split, self.fixed))
        flows = tuple(Flow(at, item["value"]) for at, item in map(split, self.flux))
        given = self.units, fixed, self.conductivity, flows, self.source
        return Conduction(*given, cyclic_symmetry=self.cyclic)

    def __call__(self, spline: Spline) -> Potential:
        """u with its flux; logs the heat flow through the places with prescribed u."""
        from polycube.analysis.poisson import conduct

        problem = self.problem
        found = conduct(
            spline,
            problem.conductivity if self.of_elements is None else self.of_elements,
            supports(spline, problem.supports),
            problem.flows,
            problem.source,
            problem.units,
            self.gauss,
            problem.cyclic_symmetry,
        )
        flows = zip(found.supports, found.flows, strict=True)
        listed = ", ".join(f"{flow:.4g} W at {name}" for name, flow in flows)
        logger.info("heat flow into the solid: %s, supplied %.4g W", listed, found.supplied)
        return found
