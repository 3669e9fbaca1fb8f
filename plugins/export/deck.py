"""Material, section and step of a problem in the format of Abaqus and CalculiX."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from polycube.analysis.problem import Conduction, Statics, Vibration
from polycube.hexmesh.connectivity import quad_sides
from polycube.types import HexMesh

from .loads import Loads
from .text import lines, narrow, wrapped

SIDES = np.array([6, 4, 3, 5, 1, 2])  # numbers of the faces -xi +xi -eta +eta -zeta +zeta in Abaqus
TEMPERATURE = 11  # degree of freedom
PRINTED = {  # content of the result files
    Statics: "*NODE FILE\nU, RF\n*EL FILE\nS, E\n",
    Vibration: "*NODE FILE\nU\n",
    Conduction: "*NODE FILE\nNT, RFL\n*EL FILE\nHFL\n",
}


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


def deck(loads: Loads, sides: np.ndarray, called: Mapping[str, str]) -> list[str]:
    """Everything after the mesh and its sets: material, section, supports and a step with loads.

    Parameters
    ----------
    sides : (Q, 2) of the boundary quads, see `sides_of`
    called : names of the sets of the mesh in the file
    """
    return _Deck(loads, sides, called).parts()


@dataclass(frozen=True, eq=False)
class _Deck:
    loads: Loads
    sides: np.ndarray
    called: Mapping[str, str]

    def parts(self) -> list[str]:
        sets, boundary = self._supports()
        section = "*SOLID SECTION, ELSET=all, MATERIAL=material\n"
        before = ["*MATERIAL, NAME=material\n", *self._material(), section, *sets]
        named, pressed = self._pressures()
        if not self.loads.has_step:
            reason = "without loads, gravity and prescribed displacements there is no step"
            return [*before, *named, f"** {reason}\n", *boundary]
        last = [*boundary, *pressed, *self._forces(), *self._heat()]
        last += [PRINTED[type(self.loads.problem)], "*END STEP\n"]
        return [*before, *named, "*STEP\n", *self._procedure(), *last]

    def _material(self) -> list[str]:
        problem = self.loads.problem
        if isinstance(problem, Conduction):
            return [f"*CONDUCTIVITY\n{_number(problem.conductivity)}\n"]
        young, poisson, density = map(_number, self.loads.elastic)
        return [f"*ELASTIC\n{young}, {poisson}\n", f"*DENSITY\n{density}\n"]

    def _procedure(self) -> list[str]:
        problem = self.loads.problem
        if isinstance(problem, Vibration):
            modes = f"*FREQUENCY\n{problem.modes}\n"
            note = "** the mass matrix is that of the element, not analysis.mass=lumped\n"
            return [note, modes] if problem.is_lumped else [modes]
        if isinstance(problem, Conduction):
            return ["*HEAT TRANSFER, STEADY STATE\n1., 1.\n"]
        return ["*STATIC\n"]

    def _supports(self) -> tuple[list[str], list[str]]:
        """New sets of nodes, and their prescribed values."""
        sets, rows = [], []
        first = TEMPERATURE if isinstance(self.loads.problem, Conduction) else 1
        for each in self.loads.supports:
            name, at = self.called.get(each.place or "", each.label), first + each.component
            if each.place is None:
                sets.append(node_set(name, each.nodes))
            rows.append(f"{name}, {at}, {at}, {_number(each.value)}\n")
        return sets, ["*BOUNDARY\n", *rows] if rows else []

    def _pressures(self) -> tuple[list[str], list[str]]:
        """New surfaces, and the pressures on surfaces."""
        named, rows = [], []
        for push in self.loads.pushes:
            name = self.called.get(push.place or "", push.label)
            if push.pressure and push.place is None:
                named.append(surface(name, self.sides[push.quads]))
            if push.pressure:
                rows.append(f"{name}, P, {_number(push.pressure)}\n")
        return named, ["*DSLOAD\n", *rows] if rows else []

    def _forces(self) -> list[str]:
        found: list[str] = []
        node, axis = np.nonzero(self.loads.forces)
        if len(node):
            values = self.loads.forces[node, axis].tolist()
            rows = zip(node.tolist(), axis.tolist(), values, strict=True)
            found += ["*CLOAD\n", *(f"{n + 1}, {i + 1}, {narrow(f)}\n" for n, i, f in rows)]
        size = float(np.linalg.norm(self.loads.gravity))
        if size:
            direction = ", ".join(_number(x) for x in self.loads.gravity / size)
            found.append(f"*DLOAD\nall, GRAV, {_number(size)}, {direction}\n")
        return found

    def _heat(self) -> list[str]:
        rows = []
        for quads, flux in self.loads.fluxes:
            values = np.full(len(quads), flux)
            rows.append(
                lines(np.column_stack([self.sides[quads], values]), ["%d", "S%d", "%.9g"], ", ")
            )
        if self.loads.source:
            rows.append(f"all, BF, {_number(self.loads.source)}\n")
        return ["*DFLUX\n", *rows] if rows else []


def _number(value: float) -> str:
    """Nine digits with a decimal point."""
    text = f"{value:.9g}"
    return text if set(text) & set(".e") else f"{text}."
