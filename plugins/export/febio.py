"""FEBio 4."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar

from polycube.analysis.problem import Statics
from polycube.registry import register
from polycube.types import HexMesh
from polycube.types.options import Such

from .format import TextFormat, WithNodes, WithProblem
from .groups import blocks, legend, node_sets, primitive_sets, renamed, side_sets
from .text import count, lines, rendered

NAME = 255  # longest name


@register("export", "febio")
@dataclass(frozen=True)
class Febio(WithNodes, WithProblem, TextFormat):
    """FEBio 4 (.feb): mesh, sets, and the statics of `analysis`, ready to run.

    There is a part for each grid cell, and named sets of nodes, faces and hexes. FEBio solves
    neither modes nor heat conduction: for modes the file has material and supports and no step, for
    conduction only mesh and sets.

    Parameters
    ----------
    nodes : number of nodes of a hex: 8 or 20; the additional ones are on the spline if there is one
    step : also write material, supports and loads of `analysis`; false: only mesh and sets
    """

    nodes: Annotated[int, Such((8, 20).__contains__, "8 or 20")] = 8

    suffix: ClassVar[str] = ".feb"
    lacks: ClassVar[tuple[str, ...]] = (*WithProblem.lacks, "varying_loads")

    def parts(self, hexes: HexMesh) -> Iterator[str]:
        """The text of the file, in parts.

        The step is one increment, so loads need no curve.
        """
        own, named = self.elements(hexes), renamed(hexes, NAME, ascii_only=False)
        loads = self.loads(hexes, own)
        return rendered(
            "febio.feb",
            loads=loads,
            is_run=loads is not None and isinstance(loads.problem, Statics) and loads.has_step,
            legend=legend(named).replace("--", "- -"),
            nodes=lines(count(own.points), '<node id="%d">%.17g,%.17g,%.17g</node>'),
            elements=own.hexes,
            quads=own.quads,
            parts=blocks(hexes),
            node_sets=node_sets(named, own.quads),
            hex_sets=primitive_sets(named),
            surfaces=named.sets,
            called=dict(zip(side_sets(hexes), named.sets, strict=True)),
            # an element with a number and the numbers of its nodes
            tag=lambda kind, nodes: f'<{kind} id="%d">' + ",".join(nodes * ["%d"]) + f"</{kind}>",
        )
