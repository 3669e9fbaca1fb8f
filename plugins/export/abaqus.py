"""Abaqus and CalculiX."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from polycube.analysis.preloads.preload import Preload
from polycube.analysis.problem import Conduction, Statics
from polycube.errors import InputError
from polycube.registry import BY_RUN, register
from polycube.types import HexMesh, Spline

from .format import TextFormat, WithProblem
from .groups import blocks, legend, node_sets, primitive_sets, renamed, side_sets
from .text import count, lines, narrow, rendered

if TYPE_CHECKING:
    from .loads import Loads

# hybrid, incompatible modes, reduced integration; coupled with temperature or pore pressure
OF_8 = "", "H", "I", "IH", "R", "RH", "T", "HT", "RT", "RHT", "P", "PH", "RP", "RPH"
OF_20 = "", "H", "R", "RH", "T", "HT", "RT", "RHT", "P", "PH", "RP", "RPH"
ELEMENTS = tuple(f"C3D8{each}" for each in OF_8) + tuple(f"C3D20{each}" for each in OF_20)
NAME = 80  # longest name; both programs ignore the case of letters
GAP = 0.1  # of the diagonals of quads: largest distance of tied nodes
STIFF = 100  # pressure for a penetration of a diagonal of the quads, in Young's moduli
SIDES = np.array([6, 4, 3, 5, 1, 2])  # numbers of the faces -xi +xi -eta +eta -zeta +zeta
ROW_8 = "%d" + 8 * ", %d"
ROW_20 = "%d" + 10 * ", %d" + ",\n" + ", ".join(10 * ["%d"])


@register("export", "abaqus")
@dataclass(frozen=True)
class Abaqus(WithProblem, TextFormat):
    """Abaqus and CalculiX (.inp): mesh, sets, and the problem of `analysis`, ready to run.

    Parameters
    ----------
    element : element type: C3D8I, C3D8, C3D8R, C3D20R, C3D20 and others; nodes of 20-node elements
        are on the spline if there is one; heat conduction uses DC3D8 or DC3D20 instead
    step : also write material, section, supports and loads of `analysis`; false: only mesh and sets
    """

    element: str = "C3D8I"
    spline: Spline | None = field(default=None, metadata=BY_RUN)

    def __post_init__(self) -> None:
        if self.element not in ELEMENTS:
            what = f"element must be one of {', '.join(ELEMENTS)}, the hexahedra of 8 and 20 nodes"
            raise ValueError(f"{what}; got {self.element!r}")

    suffix: ClassVar[str] = ".inp"
    lacks: ClassVar[tuple[str, ...]] = ()

    @property
    def states_assemblies(self) -> bool:
        """Whether the file states a problem of several solids, which ties join."""
        return self.step

    @property
    def _nodes(self) -> int:
        return 20 if self.element.startswith("C3D20") else 8

    def parts(self, hexes: HexMesh) -> Iterator[str]:
        """The text of the file, in parts."""
        from polycube.hexmesh.connectivity import quad_sides
        from polycube.spline.second_order import hex_elements

        own, (owner, side) = hex_elements(hexes, self.spline, self._nodes), quad_sides(hexes)
        loads, named = self.loads(hexes, own), renamed(hexes, NAME)
        is_heat = loads is not None and isinstance(loads.problem, Conduction)
        return rendered(
            "abaqus.inp",
            step=self.step,
            loads=loads,
            kind=loads and type(loads.problem).__name__,
            legend=legend(named, "** "),
            nodes="".join(map(_node, count(own.points).tolist())),
            element=f"DC3D{self._nodes}" if is_heat else self.element,
            elements=lines(count(own.hexes + 1), ROW_20 if self._nodes == 20 else ROW_8),
            hex_sets=blocks(named) | primitive_sets(named),
            node_sets=node_sets(named, own.quads),
            surfaces=named.sets,
            joints=_joints(named, owner, loads),
            friction=named.friction,
            sides=_sides(np.column_stack([owner, side])),
            preloads=[(each, _sides(faces)) for each, faces in _sections(loads)],
            first=len(own.points) + 1,
            called=dict(zip(side_sets(hexes), named.sets, strict=True)),
        )


def _sections(loads: Loads | None) -> Iterator[tuple[Preload, np.ndarray]]:
    """The preloads, and hexes and local faces (N, 2) of the section of each.

    Raises InputError if a deck cannot hold one: solvers cut only hexes with a face in the section.
    """
    from polycube.analysis.preloads.sections import sections
    from polycube.hexmesh.connectivity import FACES

    if loads is None or not isinstance(loads.problem, Statics) or not loads.problem.preloads:
        return
    mesh, given = loads.mesh, loads.problem.preloads
    solid = mesh.cell if loads.problem.materials else None
    found = sections(mesh.vertices, mesh.hexes, given, solid)
    for preload, (section, layer) in zip(given, found, strict=True):
        nodes = mesh.hexes[section[:, :1], FACES[section[:, 1]]]
        bound = [each.nodes for each in loads.supports if preload.direction[each.component]]
        tied = [name for tie in mesh.ties for name in tie if mesh.friction is None]
        bound += [mesh.quads[mesh.sets[name]] for name in tied]
        if any(np.isin(nodes, each).any() for each in bound):
            raise InputError(f"{preload} has a section at a support or at a tied surface")
        layer[section[:, 0]] = False
        if np.isin(mesh.hexes[layer], nodes).any():
            what = "is where the hexes are not in one layer across the axis, as a deck needs it"
            raise InputError(f"{preload} {what}; move the point, or write the deck with step=false")
        yield preload, section


def _sides(faces: np.ndarray) -> np.ndarray:
    """(N, 2) numbers of hexes and their faces in the file, from those in this program."""
    return np.column_stack([faces[:, 0] + 1, SIDES[faces[:, 1]]])


def _joints(
    mesh: HexMesh, owner: np.ndarray, loads: Loads | None
) -> Iterator[tuple[str, str, float, float | None]]:
    """The two surfaces of each tie or contact, the largest gap, and the stiffness of a contact.

    This is the pressure for each unit of penetration; it depends on the softer solid.

    owner : (Q,) hex of each quad
    """
    for one, other in mesh.ties if mesh.friction is None or loads else ():
        corners, stiffness = mesh.vertices[mesh.quads[mesh.sets[other]]], None
        size = float(np.linalg.norm(corners[:, 2] - corners[:, 0], axis=1).mean())
        if loads and mesh.friction is not None:
            solid = mesh.cell[owner] * bool(loads.problem.materials)
            named = [loads.sections[solid[mesh.sets[name][0]]] for name in (one, other)]
            stiffness = STIFF * min(loads.values(material)[0] for _, _, material in named) / size
        yield one, other, GAP * size, stiffness


def _node(row: list[float]) -> str:
    """Number and coordinates; both programs read numbers of at most 20 characters."""
    return ", ".join([f"{row[0]:.0f}", *map(narrow, row[1:])]) + "\n"
