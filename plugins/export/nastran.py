"""Nastran bulk data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh

from .format import TextFormat, WithProblem
from .groups import blocks, legend, node_sets, primitive_sets, renamed, side_sets
from .text import count, lines

if TYPE_CHECKING:
    from .loads import Loads

NAME = 48  # longest name in a comment, whose lines have 80 characters
GRID = "GRID*   %16d                %16.9E%16.9E\n*       %16.9E"
CHEXA = "CHEXA   " + 8 * "%8d" + "\n+       " + 2 * "%8d"
PLOAD4 = "PLOAD4* %16d%16d%16.9E" + 16 * " " + "\n*       " + 32 * " " + "%16d%16d"
FORCE = "FORCE*  %16d%16d               0              1.\n*       " + 3 * "%16.9E"
SPC = "SPC*    %16d%16d%16d%16.9E\n*"
GRAV = "GRAV*   %16d               0              1.%16.9E\n*       %16.9E%16.9E"
LOAD = "LOAD*   %16d              1.              1.%16d\n*                     1.%16d"
QVOL = "QVOL*   %16d%16.9E" + 16 * " " + "%16d\n*"
QHBDY = "QHBDY*  %16d           AREA4%16.9E" + 16 * " " + "\n*       " + 4 * "%16d"


@register("export", "nastran")
@dataclass(frozen=True)
class Nastran(WithProblem, TextFormat):
    """Nastran bulk data (.bdf): mesh, sets, and the problem of `analysis`, ready to run.

    There is a property PSOLID for each grid cell. Each set of the boundary is a SET1 of nodes and
    unit pressures PLOAD4 with the same number; each primitive is a SET1 of elements. A comment
    before each contains its name.

    Parameters
    ----------
    step : also write material, supports and loads of `analysis`; false: only mesh and sets, without
        the material 1
    """

    suffix: ClassVar[str] = ".bdf"

    def parts(self, hexes: HexMesh) -> list[str]:
        """The text of the file, in parts."""
        from polycube.hexmesh.connectivity import quad_sides

        owner, named = quad_sides(hexes)[0], renamed(hexes, NAME)
        nodes, sides = node_sets(named), side_sets(named)
        parts = []
        for name, own in blocks(hexes).items():
            number = hexes.cell[own[0]] + 1
            parts.append(f"$ property {number}: {name}\nPSOLID  {number:8d}       1\n")
        parts.append(lines(count(hexes.vertices), GRID))
        parts.append(lines(count(np.column_stack([hexes.cell + 1, hexes.hexes + 1])), CHEXA))
        for k, (name, own) in enumerate(nodes.items(), start=1):
            parts.append(f"$ set {k}, nodes: {name}\n{_set(k, own)}")
        for k, (name, own) in enumerate(primitive_sets(named).items(), start=1 + len(nodes)):
            parts.append(f"$ set {k}, elements: {name}\n{_set(k, own)}")
        for k, (name, quads) in enumerate(sides.items(), start=1):
            faces = owner[quads] + 1, hexes.quads[quads]
            parts.append(f"$ load {k}, pressure 1 on faces: {name}\n{_pressure(k, *faces, 1.0)}")
        case = "SOL 101\nCEND\n"
        loads = self.loads(hexes)
        if loads is not None:
            case, rows = _problem(loads, owner + 1, 1 + len(sides))
            parts += [f"$ {loads.units}\n", *rows]
        title = f"TITLE = hex mesh of polycube\n{legend(named, '$ ')}BEGIN BULK\n"
        return [case, title, *parts, "ENDDATA\n"]


def _problem(loads: Loads, owner: np.ndarray, first: int) -> tuple[str, list[str]]:
    """Executive and case control, and the bulk data of a problem.

    Parameters
    ----------
    owner : (Q,) number of the element of each boundary quad
    first : number of the first set of loads
    """
    from polycube.analysis.problem import Conduction, Vibration

    problem, quads = loads.problem, loads.mesh.quads
    solution, case = 101, ["DISPLACEMENT = ALL", "SPCFORCES = ALL", "STRESS = ALL"]
    if isinstance(problem, Conduction):
        solution, case = 153, ["ANALYSIS = HEAT", "NLPARM = 1", "THERMAL = ALL", "FLUX = ALL"]
        rows = ["NLPARM         1       1\n", f"MAT4*   {1:16d}{problem.conductivity:16.9E}\n*\n"]
    else:
        young, poisson, density = loads.elastic
        rows = [f"MAT1*   {1:16d}{young:16.9E}{'':16}{poisson:16.9E}\n*       {density:16.9E}\n"]
    if isinstance(problem, Vibration):
        solution, case = 103, ["METHOD = 1", "DISPLACEMENT = ALL"]
        rows.append(f"EIGRL          1                {problem.modes:8d}\n")
    rows += [_rows(SPC, 1, s.nodes + 1, s.component + 1, s.value) for s in loads.supports]
    acting = [_pressure(first, owner[q], quads[q], p) for *_, q, p, _ in loads.pushes if p]
    forced = np.flatnonzero(loads.forces.any(axis=1))
    acting += [_rows(FORCE, first, forced + 1, *loads.forces[forced].T)] if len(forced) else []
    acting += [_rows(QHBDY, first, flux, *(quads[q] + 1).T) for q, flux in loads.fluxes]
    if loads.source:
        acting.append(_rows(QVOL, first, loads.source, np.arange(len(loads.mesh.hexes)) + 1))
    sets = [first] if acting else []
    if loads.gravity.any():  # in a set of its own
        sets.append(first + 1)
        acting.append(_rows(GRAV, first + 1, *loads.gravity[:, None]))
    if len(sets) == 2:
        acting.append(_rows(LOAD, first + 2, *sets))
        sets = [first + 2]
    case += ["SPC = 1"] * bool(loads.supports) + [f"LOAD = {k}" for k in sets]
    return "\n".join([f"SOL {solution}", "CEND", *case, ""]), rows + acting


def _rows(form: str, *columns: object) -> str:
    """Cards with numbers that are equal or differ from card to card."""
    arrays = [np.atleast_1d(np.asarray(column, float)) for column in columns]
    return lines(np.column_stack(np.broadcast_arrays(*arrays)), form)


def _pressure(number: int, owner: np.ndarray, quads: np.ndarray, value: float) -> str:
    """Pressure on the faces of hexes, each given by two opposite corners."""
    return _rows(PLOAD4, number, owner, value, quads[:, 0] + 1, quads[:, 2] + 1)


def _set(number: int, own: np.ndarray) -> str:
    """A SET1 of nodes or elements: seven in the first line, then eight."""
    fields = [f"{n:8d}" for n in (number, *(own + 1).tolist())]
    rows = ["".join(fields[i : i + 8]) for i in range(0, len(fields), 8)]
    return "SET1    " + "\n+       ".join(rows) + "\n"
