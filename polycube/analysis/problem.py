"""The problem that an analysis solves: materials, and supports and loads at places of the boundary.

Lengths and displacements are in the unit of the part; all other quantities are in SI units.
"""

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation as Rotation3

from polycube.analysis.loads import Load, Vector
from polycube.analysis.preloads.preload import Preload
from polycube.surface.measures import unit
from polycube.types.checks import is_number

EQUAL = np.array([1, 1, 1, 0, 0, 0], np.float32)  # a stress that is equal in all directions


@dataclass(frozen=True)
class Material:
    """Isotropic linear elastic material in SI units; values (E,) are those of each element."""

    young: float  # Pa
    poisson: float
    density: float  # kg/m^3
    expansion: float = 0.0  # linear thermal expansion, 1/K

    def __post_init__(self) -> None:
        is_stable = (self.young > 0) & (-1 < self.poisson) & (self.poisson < 0.5)
        if not np.all(is_stable & (self.density > 0)):
            raise ValueError(
                f"material needs young > 0, density > 0 and -1 < poisson < 0.5; got "
                f"young={self.young:g}, poisson={self.poisson:g}, density={self.density:g}"
            )

    @classmethod
    def of_elements(cls, materials: Sequence["Material"], solid: np.ndarray) -> "Material":
        """The materials of elements, by the number (E,) of the solid of each."""
        return cls(*np.array([astuple(each) for each in materials])[solid].T)

    def at(self, elements: np.ndarray | slice = slice(None)) -> "Material":
        """The material of some elements (e,), with values (e, 1) if they differ."""
        values: Any = [np.asarray(each) for each in astuple(self)]
        return Material(*(each[elements, None] if each.ndim else each for each in values))

    def scaled(self) -> tuple["Material", float, float]:
        """The material divided by a mean Young's modulus and a mean density, and these."""
        young, density = float(np.mean(self.young)), float(np.mean(self.density))
        own = replace(self, young=self.young / young, density=self.density / density)
        return own, young, density

    @property
    def shear(self) -> float:
        """Shear modulus in Pa."""
        return self.young / (2 * (1 + self.poisson))

    @property
    def lame(self) -> float:
        """First parameter of Lame in Pa."""
        return 2 * self.shear * self.poisson / (1 - 2 * self.poisson)

    def stress(self, slope: np.ndarray, elements: np.ndarray | slice = slice(None)) -> np.ndarray:
        """(..., 6) stresses xx yy zz yz zx xy of gradients (..., 3, 3), or (e, q, 3, 3)."""
        own = self.at(elements)
        shear, lame = (np.asarray(each)[..., None] for each in (own.shear, own.lame))
        double = (slope + slope.swapaxes(-1, -2))[..., [0, 1, 2, 1, 2, 0], [0, 1, 2, 2, 0, 1]]
        return shear * double + lame * np.trace(slope, axis1=-2, axis2=-1)[..., None] * EQUAL

    def work(self, stress: np.ndarray) -> np.ndarray:
        """(...) products of stress and elastic strain, of stresses (..., 6), or (E, q, 6)."""
        own = self.at()
        squares, trace = stress**2 @ (2 - EQUAL), stress @ EQUAL
        return ((1 + own.poisson) * squares - own.poisson * trace**2) / own.young

    def gain(self, fields: np.ndarray) -> np.ndarray:
        """(E, q) density times the last of fields (E, q, 7), minus the work of the stresses."""
        return self.at().density * fields[..., 6] - self.work(fields[..., :6])

    @property
    def thermal(self) -> float:
        """Pressure per kelvin of a solid that cannot expand, Pa/K."""
        return (3 * self.lame + 2 * self.shear) * self.expansion


MATERIALS = {
    "steel": Material(210e9, 0.30, 7850, 12e-6),
    "aluminium": Material(70e9, 0.33, 2700, 23e-6),
    "titanium": Material(114e9, 0.34, 4430, 8.6e-6),
    "brass": Material(105e9, 0.34, 8500, 19e-6),
    "abs": Material(2.3e9, 0.35, 1050, 90e-6),
}


def material(value: str | Mapping[str, float]) -> Material:
    """A material by its name or its values; raises ValueError."""
    if value in list(MATERIALS):
        return MATERIALS[value]
    if isinstance(value, str) or set(value) - {"expansion"} != {"young", "poisson", "density"}:
        raise ValueError(
            f"material must be one of {', '.join(MATERIALS)} or "
            f"{{young, poisson, density}}, with expansion if needed; got {value!r}"
        )
    return Material(**value)


@dataclass(frozen=True)
class Prescribed:
    """Prescribed values of some components at a place; the last one of a place has precedence."""

    place: object  # in a form that `polycube.analysis.boundary_sets.quads_of` accepts
    components: tuple[int, ...]
    values: tuple[float, ...]  # one for each component


@dataclass(frozen=True)
class Rotation:
    """Rotation of the whole part with a constant speed; it is at rest in the rotating frame."""

    axis: Vector
    rpm: float  # revolutions per minute
    point: Vector = (0.0, 0.0, 0.0)  # on the axis, in the unit of the part

    def __post_init__(self) -> None:
        numbers = (*self.axis, *self.point, self.rpm)
        if len(numbers) != 7 or not all(map(is_number, numbers)) or not any(self.axis):
            raise ValueError("rotation has an axis [x, y, z] that is not zero, rpm, and a point")

    @property
    def speed(self) -> float:
        """Angular speed in rad/s."""
        return self.rpm * np.pi / 30

    def acceleration(self, points: np.ndarray) -> np.ndarray:
        """(P, 3) centrifugal acceleration at points (P, 3), in their length unit per s^2."""
        axis = np.divide(self.axis, np.linalg.norm(self.axis))
        arm = points - self.point
        return self.speed**2 * (arm - (arm @ axis)[:, None] * axis)


@dataclass(frozen=True)
class Cyclic:
    """The part is one of several equal sectors, which a rotation about an axis maps to the next."""

    sectors: int = 0
    axis: Vector = (0.0, 0.0, 1.0)
    point: Vector = (0.0, 0.0, 0.0)  # on the axis, in the unit of the part

    def __post_init__(self) -> None:
        numbers = (*self.axis, *self.point)
        is_place = len(numbers) == 6 and all(map(is_number, numbers)) and any(self.axis)
        if not is_place or not isinstance(self.sectors, int) or self.sectors < 2:
            what = "cyclic has a number of sectors, 2 or more, an axis [x, y, z] that is not zero,"
            raise ValueError(f"{what} and a point")

    @property
    def line(self) -> list[float]:
        """Coordinates of two points on the axis."""
        return [*self.point, *np.add(self.point, self.axis).tolist()]

    @property
    def turn(self) -> np.ndarray:
        """(3, 3) rotation of vectors from a sector to the next."""
        angle = 2 * np.pi / self.sectors
        return Rotation3.from_rotvec(angle * unit(np.array(self.axis))).as_matrix()

    def turned(self, points: np.ndarray) -> np.ndarray:
        """(P, 3) points (P, 3) of a sector in the next."""
        return self.point + (points - self.point) @ self.turn.T

    def is_along(self, vector: Vector) -> bool:
        """Whether a vector is parallel to the axis, or zero."""
        across = np.linalg.norm(np.cross(vector, self.axis))
        return bool(across <= 1e-9 * np.linalg.norm(vector) * np.linalg.norm(self.axis))


@dataclass(frozen=True)
class Flow:
    """Flux into the solid through the faces of a place."""

    place: object
    flux: Any  # W/m^2; or a function of points and normals (P, 3)


@dataclass(frozen=True)
class Problem:
    """Common properties of all problems: the length unit of the part, and the supports."""

    units: str
    supports: tuple[Prescribed, ...]
    # those, or the conductivities, of the solids of an assembly; empty if there is one solid
    materials: tuple[Any, ...] = field(default=(), kw_only=True)
    cyclic_symmetry: Cyclic | None = field(default=None, kw_only=True)

    @property
    def places(self) -> list[object]:
        """The places on the boundary that are needed."""
        acting = (*getattr(self, "loads", ()), *getattr(self, "flows", ()))
        return [each.place for each in (*self.supports, *acting)]


@dataclass(frozen=True)
class Statics(Problem):
    """Statics of an elastic solid."""

    material: Material
    loads: tuple[Load, ...]
    acceleration: Vector  # of gravity, m/s^2
    rotation: Rotation | None = None
    temperature: float | str = 0.0  # K above that without stress, see `loads.at_points`
    preloads: tuple[Preload, ...] = ()

    @property
    def varying_loads(self) -> list[Load]:
        """Loads whose pressure or traction is not the same on all of their faces."""
        return [load for load in self.loads if not load.is_uniform]


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
