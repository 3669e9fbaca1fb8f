"""Material, section and step of a problem in the format of Abaqus and CalculiX.

The units are consistent: the length unit L of the part, N and s. A stress is in N/L^2, a mass in N
s^2/L (tonnes if L is mm) and a power in N L/s.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from polycube.analysis.boundary_sets import quads_of
from polycube.analysis.material import Material
from polycube.analysis.problem import Conduction, Flow, Problem, Statics, Vibration
from polycube.hexmesh.connectivity import quad_sides
from polycube.hexmesh.named_sets import set_name
from polycube.spline.second_order import HexElements
from polycube.types import HexMesh
from polycube.units import METRES

from .nodal_forces import shares
from .text import lines, narrow, wrapped

SIDES = np.array([6, 4, 3, 5, 1, 2])  # numbers of the faces -xi +xi -eta +eta -zeta +zeta in Abaqus
MASSES = {"mm": "t", "m": "kg"}  # name of N s^2/L
STRESSES = {"mm": "MPa", "m": "Pa"}  # name of N/L^2
TEMPERATURE = 11  # degree of freedom
PRINTED = {  # content of the result files
    Statics: "*NODE FILE\nU, RF\n*EL FILE\nS, E\n",
    Vibration: "*NODE FILE\nU\n",
    Conduction: "*NODE FILE\nNT, RFL\n*EL FILE\nHFL\n",
}


def units_of(problem: Problem) -> str:
    """One line that describes the units."""
    unit = problem.units
    mass, stress = MASSES.get(unit, f"N s^2/{unit}"), STRESSES.get(unit, f"N/{unit}^2")
    heat = f", power N {unit}/s, temperature K" if isinstance(problem, Conduction) else ""
    return f"length {unit}, force N, time s, mass {mass}, stress {stress}{heat}"


def sides_of(mesh: HexMesh) -> np.ndarray:
    """(Q, 2) numbers of the element, from one, and of its face for the boundary quads."""
    owner, side = quad_sides(mesh)
    return np.column_stack([owner + 1, SIDES[side]])


def surface(name: str, sides: np.ndarray) -> str:
    """A named set of element faces (N, 2)."""
    return f"*SURFACE, TYPE=ELEMENT, NAME={name}\n{lines(sides, ['%d', 'S%d'], ', ')}"


def node_set(name: str, nodes: np.ndarray) -> str:
    """A named set of nodes; their numbers start at zero."""
    return f"*NSET, NSET={name}\n{wrapped(nodes + 1, 16, between=', ')}"


def deck(problem: Problem, mesh: HexMesh, elements: HexElements, sides: np.ndarray) -> list[str]:
    """Everything after the mesh and its sets: material, section, supports and a step with loads.

    sides : (Q, 2) of the boundary quads, see `sides_of`

    Raises
    ------
    InputError
        If a place does not exist on the boundary of the mesh.
    """
    return _Deck(problem, mesh, elements, sides).parts()


@dataclass(frozen=True, eq=False)
class _Deck:
    problem: Problem
    mesh: HexMesh
    elements: HexElements
    sides: np.ndarray

    @property
    def metre(self) -> float:
        """Length unit in metres."""
        return METRES[self.problem.units]

    def parts(self) -> list[str]:
        sets, boundary = self._supports()
        section = "*SOLID SECTION, ELSET=all, MATERIAL=material\n"
        before = ["*MATERIAL, NAME=material\n", *self._material(), section, *sets]
        named, loads = self._loads()
        if isinstance(self.problem, Statics) and not (loads or self._moves):
            reason = "without loads, gravity and prescribed displacements there is no step"
            return [*before, *named, f"** {reason}\n", *boundary]
        last = [*boundary, *loads, PRINTED[type(self.problem)], "*END STEP\n"]
        return [*before, *named, "*STEP\n", *self._procedure(), *last]

    @property
    def _moves(self) -> bool:
        return any(any(support.values) for support in self.problem.supports)

    def _material(self) -> list[str]:
        if isinstance(self.problem, Conduction):
            return [f"*CONDUCTIVITY\n{_number(self.problem.conductivity)}\n"]
        assert isinstance(self.problem, Statics | Vibration)
        own: Material = self.problem.material
        young, density = own.young * self.metre**2, own.density * self.metre**4
        return [
            f"*ELASTIC\n{_number(young)}, {_number(own.poisson)}\n",
            f"*DENSITY\n{_number(density)}\n",
        ]

    def _procedure(self) -> list[str]:
        if isinstance(self.problem, Vibration):
            modes = f"*FREQUENCY\n{self.problem.modes}\n"
            note = "** the mass matrix is that of the element, not analysis.mass=lumped\n"
            return [note, modes] if self.problem.is_lumped else [modes]
        if isinstance(self.problem, Conduction):
            return ["*HEAT TRANSFER, STEADY STATE\n1., 1.\n"]
        return ["*STATIC\n"]

    def _supports(self) -> tuple[list[str], list[str]]:
        """New sets of nodes, and their prescribed values; the last support has precedence."""
        supports = self.problem.supports
        nodes = [np.unique(self.elements.quads[self._quads(each.place)]) for each in supports]
        ruler = np.full((len(self.elements.points), 3), -1)
        for k, support in enumerate(supports):
            for component in support.components:
                ruler[nodes[k], component] = k
        sets, rows = [], []
        first = TEMPERATURE if isinstance(self.problem, Conduction) else 1
        for k, support in enumerate(supports):
            for component, value in zip(support.components, support.values, strict=True):
                own = nodes[k][ruler[nodes[k], component] == k]
                if len(own) == 0:
                    continue
                name, at = set_name(support.place), first + component
                if isinstance(support.place, Mapping) or len(own) < len(nodes[k]):
                    name = f"fixed_{k + 1}_{component + 1}"
                    sets.append(node_set(name, own))
                rows.append(f"{name}, {at}, {at}, {_number(value)}\n")
        return sets, ["*BOUNDARY\n", *rows] if rows else []

    def _quads(self, place: object) -> np.ndarray:
        return np.unique(quads_of(self.mesh, place))

    def _loads(self) -> tuple[list[str], list[str]]:
        """New surfaces, and the loads of the step."""
        if isinstance(self.problem, Conduction):
            return [], self._heat(self.problem)
        if isinstance(self.problem, Statics):
            return self._forces(self.problem)
        return [], []

    def _forces(self, problem: Statics) -> tuple[list[str], list[str]]:
        named, pressures = [], []
        at_nodes = np.zeros_like(self.elements.points)
        for k, load in enumerate(problem.loads):
            quads = self._quads(load.place)
            if load.pressure:
                name = set_name(load.place)
                if isinstance(load.place, Mapping):
                    name = f"load_{k + 1}"
                    named.append(surface(name, self.sides[quads]))
                pressures.append(f"{name}, P, {_number(load.pressure * self.metre**2)}\n")
            faces = self.elements.quads[quads]
            areas = shares(self.elements.points[faces])
            traction = np.array(load.traction) * self.metre**2 + np.array(load.force) / areas.sum()
            np.add.at(at_nodes, faces, areas[..., None] * traction)
        loads = ["*DSLOAD\n", *pressures] if pressures else []
        node, axis = np.nonzero(at_nodes)
        if len(node):
            rows = zip(node.tolist(), axis.tolist(), at_nodes[node, axis].tolist(), strict=True)
            loads += ["*CLOAD\n", *(f"{n + 1}, {i + 1}, {narrow(f)}\n" for n, i, f in rows)]
        gravity = np.array(problem.acceleration) / self.metre
        size = float(np.linalg.norm(gravity))
        if size:
            direction = ", ".join(_number(x) for x in gravity / size)
            loads.append(f"*DLOAD\nall, GRAV, {_number(size)}, {direction}\n")
        return named, loads

    def _heat(self, problem: Conduction) -> list[str]:
        rows = [self._flux(flow) for flow in problem.flows]
        if problem.source:
            rows.append(f"all, BF, {_number(problem.source * self.metre**2)}\n")
        return ["*DFLUX\n", *rows] if rows else []

    def _flux(self, flow: Flow) -> str:
        sides = self.sides[self._quads(flow.place)]
        value = np.full(len(sides), flow.flux * self.metre)
        return lines(np.column_stack([sides, value]), ["%d", "S%d", "%.9g"], ", ")


def _number(value: float) -> str:
    """Nine digits with a decimal point."""
    text = f"{value:.9g}"
    return text if set(text) & set(".e") else f"{text}."
