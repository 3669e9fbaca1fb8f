"""LS-DYNA keywords."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from polycube.analysis.problem import Vibration
from polycube.registry import register
from polycube.types import HexMesh

from .format import TextFormat, WithProblem
from .groups import blocks, legend, node_sets, primitive_sets, renamed, side_sets
from .text import count, lines, rendered

TITLE = 80  # longest title


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

    def parts(self, hexes: HexMesh) -> Iterator[str]:
        """The text of the file, in parts.

        A base acceleration acts on the part in the opposite direction. Curve 1 grows from 0 to 1 in
        the only step.
        """
        from polycube.io.lsdyna_deck import modal_cards

        elements = count(np.column_stack([hexes.cell + 1, hexes.hexes + 1]))
        loads, known = self.loads(hexes), list(side_sets(hexes))
        problem, modal = loads and loads.problem, []
        if isinstance(problem, Vibration):
            modal = modal_cards(problem.modes, problem.is_lumped)
        hexes = renamed(hexes, TITLE)
        nodes = list(node_sets(hexes).items())
        segments = [(name, hexes.quads[own]) for name, own in side_sets(hexes).items()]
        supports, pressed = [], []
        for each in loads.supports if loads is not None and loads.elastic else ():
            if each.place is None:
                nodes.append((each.label, each.nodes))
            supports.append((known.index(each.place) + 1 if each.place else len(nodes), each))
        for push in loads.pushes if loads is not None and loads.elastic else ():
            if push.pressure and push.place is None:
                segments.append((push.label, hexes.quads[push.quads]))
            if push.pressure:
                number = known.index(push.place) + 1 if push.place else len(segments)
                pressed.append((number, push))
        primitives = primitive_sets(hexes).items()
        return rendered(
            "lsdyna.k",
            loads=loads,
            modal=modal,
            legend=legend(hexes, "$ "),
            cells={hexes.cell[own[0]] + 1: name for name, own in blocks(hexes).items()},
            nodes=lines(count(hexes.vertices), "%8d" + 3 * "%16.9E"),
            elements=lines(elements, 10 * "%8d"),
            node_sets=nodes,
            segments=segments,
            part_sets=[(name, np.unique(hexes.cell[own])) for name, own in primitives],
            supports=supports,
            pressed=pressed,
        )
