"""Linear elastic statics."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass

from polycube.analysis.problem import Applied, Statics, Vector, material
from polycube.analysis.supports import is_number, prescribed, split, supports
from polycube.registry import register
from polycube.types import Deformation, Spline
from polycube.units import AUTO, checked_unit

from .places import OfProblem, check_items, check_supports, check_vector

logger = logging.getLogger(__name__)

WEIGHT = (0.0, 0.0, -9.81)  # m/s^2


@register("analysis", "static")
@dataclass(frozen=True)
class Static(OfProblem):
    """Linear elasticity: displacement, stress, reactions; the default load is the weight.

    Parameters
    ----------
    material : steel, aluminium, titanium, brass, abs, or {young: 210e9, poisson: 0.3, density:
        7850}, in Pa and kg/m^3
    units : length unit of the part: auto (that of the file, or mm if it states none), m, cm, mm,
        um, in, ft, dm, km, nm, mil, yd, mi
    fixed : supports: [x_min, 7], [{at: x_max, components: [x], value: 0.1}]; see
        docs/reference/analysis.md
    loads : [{at: x_max, force: [0, 0, -100]}] in N, or pressure: Pa, or traction: [Pa, Pa, Pa]
    gravity : acceleration in m/s^2; null: [0, 0, -9.81] if there are no loads and no prescribed
        displacements
    gauss : Gauss points per direction and element
    away : distance as a share of the diagonal; places closer to sharp inner edges, borders of
        supports and loads on small areas, where the stress is unbounded, are excluded from the
        largest stress
    """

    material: str | Mapping[str, float] = "steel"
    units: str = AUTO
    fixed: tuple[object, ...] = ("z_min",)
    loads: tuple[object, ...] = ()
    gravity: tuple[float, ...] | None = None
    gauss: int = 4
    away: float = 0.02

    def __post_init__(self) -> None:
        material(self.material)
        object.__setattr__(self, "units", checked_unit(self.units))
        check_supports("fixed", self.fixed, {"components", "value"})
        loads = check_items("loads", self.loads, {"pressure", "traction", "force"}, needed=1)
        for _, item in loads:
            if not is_number(item.get("pressure", 0.0)):
                raise ValueError(f"loads: pressure must be a number; got {item['pressure']!r}")
            for name in ("traction", "force"):
                check_vector(f"loads: {name}", item.get(name, (0, 0, 0)))
        if self.gravity is not None:
            check_vector("gravity", self.gravity)
        if self.gauss < 2:
            raise ValueError(f"gauss >= 2 is needed; got {self.gauss}")
        if not 0 <= self.away < 1:
            raise ValueError(
                f"away must be a share of the diagonal, 0 <= away < 1; got {self.away}"
            )

    @property
    def _acceleration(self) -> Vector:
        """Gravity; without an option, loads and prescribed displacements, along -z."""
        if self.gravity is not None:
            x, y, z = self.gravity
            return x, y, z
        is_moved = any(item.get("value") for _, item in map(split, self.fixed))
        return (0.0, 0.0, 0.0) if self.loads or is_moved else WEIGHT

    @property
    def problem(self) -> Statics:
        """The problem, for input files of other solvers."""
        loads = tuple(Applied(place, **item) for place, item in map(split, self.loads))
        fixed = prescribed(self.fixed)
        return Statics(self.units, fixed, material(self.material), loads, self._acceleration)

    def __call__(self, spline: Spline) -> Deformation:
        """The deformed solid; logs the resultant of the loads."""
        from polycube.analysis.boundary_sets import faces_of
        from polycube.analysis.static import Load, deform

        problem = self.problem
        found = deform(
            spline,
            problem.material,
            supports(spline, problem.supports),
            [
                Load(faces_of(spline, each.place), each.pressure, each.traction, each.force)
                for each in problem.loads
            ],
            problem.acceleration,
            problem.units,
            self.gauss,
            self.away,
        )
        logger.info("load %s N", " ".join(f"{force:.4g}" for force in found.load))
        return found
