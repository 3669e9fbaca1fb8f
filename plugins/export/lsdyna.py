"""LS-DYNA keywords."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh

from .format import TextFormat, WithProblem
from .groups import blocks, legend, node_sets, primitive_sets, renamed, side_sets
from .text import count, lines, wrapped

if TYPE_CHECKING:
    from .loads import Loads

TITLE = 80  # longest title
STATICS = ["*CONTROL_IMPLICIT_GENERAL", "1,1.", "*CONTROL_IMPLICIT_SOLUTION", "1"]
STATICS += ["*DATABASE_BINARY_D3PLOT", "1."]


@register("export", "lsdyna")
@dataclass(frozen=True)
class LsDyna(WithProblem, TextFormat):
    """LS-DYNA keywords (.k): mesh, sets, and statics or modes of `analysis`, ready to run.

    There is a part for each grid cell, and named sets of nodes, segments and parts. Of heat
    conduction the file has only mesh and sets. Without a problem, parts, their section and their
    material are defined in the file that includes this one.

    Parameters
    ----------
    step : also write parts, material, supports and loads of `analysis`; false: only mesh and sets
    """

    suffix: ClassVar[str] = ".k"

    def parts(self, hexes: HexMesh) -> list[str]:
        """The text of the file, in parts."""
        elements = count(np.column_stack([hexes.cell + 1, hexes.hexes + 1]))
        loads, known = self.loads(hexes), list(side_sets(hexes))
        hexes = renamed(hexes, TITLE)
        nodes = list(node_sets(hexes).items())
        segments = [(name, hexes.quads[own]) for name, own in side_sets(hexes).items()]
        cells = {hexes.cell[own[0]] + 1: name for name, own in blocks(hexes).items()}
        parts = ["*KEYWORD\n", legend(hexes, "$ ")]
        parts += [f"$ part {number}: {name}\n" for number, name in cells.items()]
        parts += ["*NODE\n", lines(count(hexes.vertices), "%8d" + 3 * "%16.9E")]
        parts += ["*ELEMENT_SOLID\n", lines(elements, 10 * "%8d")]
        problem = _problem(loads, known, nodes, segments, cells) if loads else ""
        for k, (name, own) in enumerate(nodes, start=1):
            parts.append(_set("NODE_LIST", name, k) + wrapped(own + 1, 8, "%10d"))
        for k, (name, quads) in enumerate(segments, start=1):
            parts.append(_set("SEGMENT", name, k) + lines(quads + 1, 4 * "%10d"))
        for k, (name, own) in enumerate(primitive_sets(hexes).items(), start=1):
            in_set = np.unique(hexes.cell[own]) + 1
            parts.append(_set("PART_LIST", name, k) + wrapped(in_set, 8, "%10d"))
        return [*parts, problem, "*END\n"]


def _problem(
    loads: Loads,
    known: list[str],
    nodes: list[tuple[str, np.ndarray]],
    segments: list[tuple[str, np.ndarray]],
    cells: Mapping[int, str],
) -> str:
    """Cards of a problem, with numbers between commas.

    A base acceleration acts on the part in the opposite direction. Curve 1 grows from 0 to 1 in the
    only step.

    Parameters
    ----------
    known : names of the sets of the mesh, whose numbers start at one
    nodes, segments : sets in the file, to which new ones are appended
    cells : name of each part
    """
    from polycube.analysis.problem import Vibration
    from polycube.io.lsdyna_deck import modal_cards

    if not loads.elastic:
        return ""
    young, poisson, density = loads.elastic
    cards = [f"$ {loads.units}"]
    for number, name in cells.items():
        cards += ["*PART", name, f"{number},1,1"]
    cards += ["*SECTION_SOLID", "1,-1", "*MAT_ELASTIC"]
    cards += [f"1,{density:.9g},{young:.9g},{poisson:.9g}"]
    cards += ["*DEFINE_CURVE", "1", "0.,0.", "1.,1."]
    cards += ["*CONTROL_TERMINATION", "1."]
    if isinstance(loads.problem, Vibration):
        cards += modal_cards(loads.problem.modes, loads.problem.is_lumped)
    else:
        cards += STATICS
    for support in loads.supports:
        if support.place is None:
            nodes.append((support.label, support.nodes))
        number = known.index(support.place) + 1 if support.place else len(nodes)
        if support.value:
            card = f"{number},{support.component + 1},2,1,{support.value:.9g}"
            cards += ["*BOUNDARY_PRESCRIBED_MOTION_SET", card]
        else:
            held = ",".join(str(int(i == support.component)) for i in range(6))
            cards += ["*BOUNDARY_SPC_SET", f"{number},0,{held}"]
    for push in loads.pushes:
        if push.pressure and push.place is None:
            segments.append((push.label, loads.mesh.quads[push.quads]))
        number = known.index(push.place) + 1 if push.place else len(segments)
        if push.pressure:
            cards += ["*LOAD_SEGMENT_SET", f"{number},1,{push.pressure:.9g}"]
    for axis, name in enumerate("XYZ"):
        if loads.gravity[axis]:
            cards += [f"*LOAD_BODY_{name}", f"1,{-loads.gravity[axis]:.9g}"]
    rows = [
        f"{n + 1},{i + 1},1,{loads.forces[n, i]:.9g}" for n, i in np.argwhere(loads.forces).tolist()
    ]
    cards += ["*LOAD_NODE_POINT", *rows] if rows else []
    return "\n".join([*cards, ""])


def _set(kind: str, name: str, number: int) -> str:
    return f"*SET_{kind}_TITLE\n{name}\n{number:10d}\n"
