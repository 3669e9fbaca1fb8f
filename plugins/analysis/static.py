"""Linear elastic statics."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from polycube.analysis.loads import Load, check_expression
from polycube.analysis.preloads.preload import Preload
from polycube.analysis.problem import Rotation, Statics, Vector, material
from polycube.analysis.supports import prescribed, split, supports
from polycube.registry import register
from polycube.types import Deformation, Spline
from polycube.types.checks import options_of

from .places import OfProblem, check_items, check_supports, check_vector

logger = logging.getLogger(__name__)

WEIGHT = (0.0, 0.0, -9.81)  # m/s^2
VECTORS = ("traction", "force", "moment", "bearing")


@register("analysis", "static")
@dataclass(frozen=True)
class Static(OfProblem):
    """Linear elasticity: displacement, stress, reactions; the default load is the weight.

    Parameters
    ----------
    material : steel, aluminium, titanium, brass, abs, or {young: 210e9, poisson: 0.3, density:
        7850}, in Pa and kg/m^3
    fixed : supports: [x_min, 7], [{at: x_max, components: [x], value: 0.1}]; see
        docs/reference/analysis.md
    loads : [{at: x_max, force: [0, 0, -100]}] in N, moment: [N m, N m, N m], both at point: [x, y,
        z] if it is given; pressure: Pa, or an expression of x, y, z; traction: [Pa, Pa, Pa];
        bearing: [N, N, N], a pressure on the half of a hole or shaft that resists
    rotation : {axis: [0, 0, 1], point: [0, 0, 0], rpm: 3000}; centrifugal forces
    temperature : in K above that without stress: a number or an expression of x, y, z
    preloads : [{point: [x, y, z], axis: [0, 0, 1], force: 10e3}], in N, such as of a bolt: the part
        is cut at the point across the axis, and the two sides are pulled together with this force
    gravity : acceleration in m/s^2; null: [0, 0, -9.81] if nothing else loads or moves
        the part
    away : distance as a share of the diagonal; places closer to sharp inner edges, borders of
        supports and loads on small areas, where the stress is unbounded, are excluded from the
        largest stress
    """

    material: str | Mapping[str, float] = "steel"
    fixed: tuple[object, ...] = ("z_min",)
    loads: tuple[object, ...] = ()
    rotation: Rotation | None = None
    temperature: float | str = 0.0
    preloads: tuple[Preload, ...] = ()
    gravity: tuple[float, ...] | None = None
    away: float = 0.02

    def __post_init__(self) -> None:
        super().__post_init__()
        material(self.material)
        check_supports("fixed", self.fixed, {"components", "value"})
        for _, item in check_items("loads", self.loads, {"pressure", "point", *VECTORS}, needed=1):
            check_expression("loads: pressure", item.get("pressure", 0.0))
            for name in {*VECTORS, "point"} & {*item}:
                check_vector(f"loads: {name}", item[name], is_field=name == "traction")
            if "point" in item and not {"force", "moment"} & {*item}:
                raise ValueError(f"loads: point is where a force or a moment acts; got {item!r}")
        check_expression("temperature", self.temperature)
        if self.temperature and not material(self.material).expansion:
            raise ValueError("temperature needs the expansion of the material, in 1/K")
        if self.rotation is not None:
            object.__setattr__(self, "rotation", options_of("rotation", Rotation, self.rotation))
        given = self.preloads
        if isinstance(given, Mapping) or not all(isinstance(x, Mapping | Preload) for x in given):
            raise ValueError(f"preloads are [{{point, axis, force}}, ...]; got {given!r}")
        preloads = tuple(options_of("preloads", Preload, each) for each in given)
        object.__setattr__(self, "preloads", preloads)
        if self.gravity is not None:
            check_vector("gravity", self.gravity)
        if self.cyclic is not None:
            along = [self._acceleration]
            if self.rotation is not None:
                apart = np.subtract(self.rotation.point, self.cyclic.point)
                along += [self.rotation.axis, apart.tolist()]
            if not all(map(self.cyclic.is_along, along)):
                raise ValueError("gravity and the axis of rotation must be along that of cyclic")
        if not 0 <= self.away < 1:
            what = f"away must be a share of the diagonal, 0 <= away < 1; got {self.away}"
            raise ValueError(what)

    @property
    def _acceleration(self) -> Vector:
        """Gravity; without an option, loads and prescribed displacements, along -z."""
        if self.gravity is not None:
            return self.gravity
        is_moved = any(item.get("value") for _, item in map(split, self.fixed))
        is_loaded = self.loads or self.rotation or self.temperature or self.preloads
        return (0.0, 0.0, 0.0) if is_loaded or is_moved else WEIGHT

    @property
    def problem(self) -> Statics:
        """The problem, for input files of other solvers."""
        solid, fixed = material(self.material), prescribed(self.fixed)
        loads = tuple(Load(place, **item) for place, item in map(split, self.loads))
        body = self._acceleration, self.rotation, self.temperature, self.preloads
        return Statics(self.units, fixed, solid, loads, *body, cyclic_symmetry=self.cyclic)

    def __call__(self, spline: Spline) -> Deformation:
        """The deformed solid; logs the resultant of the loads."""
        from polycube.analysis.static import deform

        problem = self.problem
        found = deform(
            spline,
            self.of_elements or problem.material,
            supports(spline, problem.supports),
            problem.loads,
            problem.acceleration,
            problem.units,
            self.gauss,
            self.away,
            problem.rotation,
            problem.temperature,
            problem.cyclic_symmetry,
            problem.preloads,
        )
        logger.info("load %s N", " ".join(f"{force:.4g}" for force in found.load))
        return found
