"""Nastran bulk data."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh

from .format import TextFormat, WithProblem
from .groups import blocks, legend, node_sets, primitive_sets, renamed, side_sets
from .text import count, lines, rendered

NAME = 48  # longest name in a comment, whose lines have 80 characters


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

    def parts(self, hexes: HexMesh) -> Iterator[str]:
        """The text of the file, in parts."""
        from polycube.hexmesh.connectivity import quad_sides

        loads, named = self.loads(hexes), renamed(hexes, NAME)
        return rendered(
            "nastran.bdf",
            loads=loads,
            kind=loads and type(loads.problem).__name__,
            legend=legend(named, "$ "),
            cells={hexes.cell[own[0]] + 1: name for name, own in blocks(hexes).items()},
            nodes=count(hexes.vertices),
            elements=count(np.column_stack([hexes.cell + 1, hexes.hexes + 1])),
            owner=quad_sides(hexes)[0] + 1,
            quads=hexes.quads + 1,
            node_sets=node_sets(named),
            hex_sets=primitive_sets(named),
            sides=side_sets(named),
            cards=_cards,
            set1=_set,
        )


def _cards(form: str, *columns: object) -> str:
    """Cards with numbers that are equal or differ from card to card."""
    arrays = [np.atleast_1d(np.asarray(column, float)) for column in columns]
    return lines(np.column_stack(np.broadcast_arrays(*arrays)), form)


def _set(number: int, own: np.ndarray) -> str:
    """A SET1 of nodes or elements: seven in the first line, then eight."""
    fields = [f"{n:8d}" for n in (number, *(own + 1).tolist())]
    rows = ["".join(fields[i : i + 8]) for i in range(0, len(fields), 8)]
    return "SET1    " + "\n+       ".join(rows) + "\n"
