"""What the formats have in common that also hold the problem of `analysis`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from polycube.registry import BY_RUN
from polycube.types import HexMesh

if TYPE_CHECKING:
    from polycube.analysis.problem import Problem
    from polycube.spline.second_order import HexElements

    from .loads import Loads


@dataclass(frozen=True)
class WithProblem:
    """A format with a problem, unless `step` is false."""

    step: bool = True
    problem: Problem | None = field(default=None, metadata=BY_RUN)

    @property
    def places(self) -> list[object]:
        """Boundary sets that the file needs."""
        return self.problem.places if self.step and self.problem else []

    def loads(self, hexes: HexMesh, elements: HexElements) -> Loads | None:
        """The problem on the elements of a mesh; None if it is absent or not written.

        Raises
        ------
        InputError
            If a place of the problem does not exist on the boundary of the mesh.
        """
        from .loads import Loads

        return Loads(self.problem, hexes, elements) if self.step and self.problem else None
