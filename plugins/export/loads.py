"""A problem in the numbers of a consistent system: the length unit L of the part, N and s.

A stress is in N/L^2, a mass in N s^2/L (tonnes if L is mm) and a power in N L/s.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval2d, polyvander2d

from polycube.analysis.boundary_sets import is_edge, quads_of
from polycube.analysis.cyclic import cut_faces
from polycube.analysis.loads import NOTHING, at_points
from polycube.analysis.problem import Conduction, Material, Problem, Statics, Vibration
from polycube.errors import InputError
from polycube.hexmesh.named_sets import set_name
from polycube.spline.second_order import HexElements
from polycube.types import HexMesh
from polycube.units import METRES

MASSES = {"mm": "t", "m": "kg"}  # name of N s^2/L
STRESSES = {"mm": "MPa", "m": "Pa"}  # name of N/L^2
# corners, edges and centre of a face, each the mean of some corners, in [-1, 1]^2
CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
PLACES = np.vstack([CORNERS, (CORNERS + np.roll(CORNERS, -1, axis=0)) / 2, [[0, 0]]])
# terms x^i y^j of the nodal functions, numbered 3 i + j, by number of nodes
TERMS = {4: [0, 1, 3, 4], 8: [*range(8)], 9: [*range(9)]}
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(4)


class AtGaussPoints(NamedTuple):
    """Values at G Gauss points of Q faces."""

    values: np.ndarray  # (G, n) of the nodal functions
    points: np.ndarray  # (Q, G, 3)
    normals: np.ndarray  # (Q, G, 3) of length 1
    areas: np.ndarray  # (Q, G)


def at_gauss_points(faces: np.ndarray) -> AtGaussPoints:
    """The Gauss points of faces (Q, n, 3) of 4, 8 or 9 nodes."""
    n = faces.shape[1]
    grid = np.array(list(product(POINTS, repeat=2)))
    weights = np.prod(list(product(WEIGHTS, repeat=2)), axis=1)
    factors, (x, y), (u, v) = np.zeros((9, n)), grid.T, PLACES[:n].T
    factors[TERMS[n]] = np.linalg.inv(polyvander2d(u, v, [2, 2])[:, TERMS[n]])
    function = factors.reshape(3, 3, n)
    each = function, polyder(function), polyder(function, axis=1)
    values, along, across = (polyval2d(x, y, own).T for own in each)
    normals = np.cross(along @ faces, across @ faces)
    lengths = np.linalg.norm(normals, axis=2)
    units = normals / np.maximum(lengths, np.finfo(float).tiny)[..., None]
    return AtGaussPoints(values, values @ faces, units, lengths * weights)


class Support(NamedTuple):
    """The nodes at which one component has a prescribed value."""

    place: str | None  # the set of the mesh that has exactly these nodes
    label: str  # a name for them in any case
    component: int
    value: float
    nodes: np.ndarray


class Push(NamedTuple):
    """A load on the faces of a place."""

    place: str | None  # the set of the mesh, if it has a name
    label: str
    quads: np.ndarray
    pressure: float  # 0 if the load varies
    faces: AtGaussPoints
    traction: np.ndarray  # (Q, G, 3) without the pressure; with it, if the load varies


@dataclass(frozen=True, eq=False)
class Loads:
    """Material, supports and loads of a problem on the elements of a mesh.

    Raises InputError if a place does not exist on the boundary of the mesh.
    """

    problem: Problem
    mesh: HexMesh
    elements: HexElements

    @property
    def units(self) -> str:
        """One line that describes the units."""
        unit = self.problem.units
        mass, stress = MASSES.get(unit, f"N s^2/{unit}"), STRESSES.get(unit, f"N/{unit}^2")
        power = f", power N {unit}/s, temperature K" if isinstance(self.problem, Conduction) else ""
        return f"length {unit}, force N, time s, mass {mass}, stress {stress}{power}"

    @property
    def _metre(self) -> float:
        """Length unit in metres."""
        return METRES[self.problem.units]

    @property
    def elastic(self) -> tuple[float, ...]:
        """Young's modulus, Poisson's ratio and density; empty for conduction."""
        own = self.problem
        return self.values(own.material) if isinstance(own, Statics | Vibration) else ()

    def values(self, own: Material) -> tuple[float, float, float]:
        """Young's modulus, Poisson's ratio and density of a material."""
        return own.young * self._metre**2, own.poisson, own.density * self._metre**4

    @property
    def sections(self) -> list[tuple[str, str, Any]]:
        """Set of hexes, name and values of each material; for conduction its conductivity."""
        given, own = self.problem.materials, self.problem
        if not given:
            value = getattr(own, "material", getattr(own, "conductivity", None))
            return [("all", "material", value)]
        each = zip(self.mesh.primitives, given, strict=True)
        return [(f"primitive_{name}", f"material_{name}", value) for name, value in each]

    @cached_property
    def supports(self) -> list[Support]:
        """The supports; the last one of a node has precedence."""
        given = self.problem.supports
        nodes = [self._nodes(each.place) for each in given]
        ruler = np.full((len(self.elements.points), 3), -1)
        for k, support in enumerate(given):
            for component in support.components:
                ruler[nodes[k], component] = k
        for quads in self.cut_faces[:1]:  # these nodes follow from those of the other cut face
            ruler[self.elements.quads[quads]] = -1
        found = []
        for k, support in enumerate(given):
            for component, value in zip(support.components, support.values, strict=True):
                own = nodes[k][ruler[nodes[k], component] == k]
                is_set = not isinstance(support.place, Mapping) and len(own) == len(nodes[k])
                place = set_name(support.place) if is_set else None
                label = f"fixed_{k + 1}_{component + 1}"
                if len(own):
                    found.append(Support(place, label, component, value, own))
        return found

    @cached_property
    def pushes(self) -> list[Push]:
        """The loads on faces."""
        found = []
        for k, load in enumerate(getattr(self.problem, "loads", ()), start=1):
            place = None if isinstance(load.place, Mapping) else set_name(load.place)
            quads = self._quads(load.place)
            here = at_gauss_points(self.elements.points[self.elements.quads[quads]])
            pressure = float(load.pressure) if load.is_uniform else 0.0
            rest = replace(load, pressure=0.0) if load.is_uniform else load
            flat = here.points.reshape(-1, 3), here.normals.reshape(-1, 3), here.areas.ravel()
            traction = rest.traction_at(*flat, self._metre).reshape(here.points.shape)
            scale = self._metre**2
            found.append(Push(place, f"load_{k}", quads, pressure * scale, here, traction * scale))
        return found

    @cached_property
    def forces(self) -> np.ndarray:
        """(N, 3) forces at the nodes: integrals of their functions over the faces."""
        at_nodes = np.zeros_like(self.elements.points)
        for push in self.pushes:
            force = push.faces.areas[..., None] * push.traction
            own = np.einsum("gn,qgi->qni", push.faces.values, force)
            np.add.at(at_nodes, self.elements.quads[push.quads], own)
        return at_nodes

    @property
    def forced(self) -> list[list[int]]:
        """Node and component of each force."""
        return np.argwhere(self.forces).tolist()

    @property
    def gravity(self) -> np.ndarray:
        """(3,) acceleration."""
        own = self.problem.acceleration if isinstance(self.problem, Statics) else NOTHING
        return np.array(own) / self._metre

    @cached_property
    def temperature(self) -> np.ndarray:
        """(N,) temperature of the nodes; empty if there is none."""
        found = at_points(getattr(self.problem, "temperature", 0.0), self.elements.points)
        return found if found.any() else np.zeros(0)

    @cached_property
    def cut_faces(self) -> list[np.ndarray]:
        """Quads of the two cut faces of a sector with cyclic symmetry; empty without it."""
        cyclic = self.problem.cyclic_symmetry
        if cyclic is None:
            return []
        if cyclic.sectors == 2:
            what = "a deck needs at least three sectors; mesh a smaller part, or the whole"
            raise InputError(what)
        return [*cut_faces(self.mesh.vertices, self.mesh.quads, cyclic)]

    @property
    def has_step(self) -> bool:
        """Whether there is something to compute."""
        acting = self.forces.any() or self.gravity.any() or any(p.pressure for p in self.pushes)
        moves = any(support.value for support in self.supports)
        others = any(getattr(self.problem, name, None) for name in ("rotation", "preloads"))
        others |= len(self.temperature) > 0
        return bool(acting or moves or others) or not isinstance(self.problem, Statics)

    @property
    def fluxes(self) -> list[tuple[np.ndarray, float]]:
        """Quads, and the flux of heat into the solid through them."""
        flows = self.problem.flows if isinstance(self.problem, Conduction) else ()
        return [(self._quads(flow.place), flow.flux * self._metre) for flow in flows]

    @property
    def source(self) -> float:
        """Heat source in the whole part."""
        return self.problem.source * self._metre**2 if isinstance(self.problem, Conduction) else 0.0

    def _nodes(self, place: object) -> np.ndarray:
        """The nodes at a place; on an edge, those of both its sets."""
        names = place["edge"] if is_edge(place) else [place]
        each = (np.unique(self.elements.quads[self._quads(name)]) for name in names)
        return reduce(np.intersect1d, each)

    def _quads(self, place: object) -> np.ndarray:
        return np.unique(quads_of(self.mesh, place))
