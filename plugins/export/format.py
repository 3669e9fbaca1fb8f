"""What the formats have in common: files of text, the nodes of a hex, the problem of `analysis`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from polycube.errors import InputError
from polycube.io.atomic import write_parts
from polycube.registry import BY_RUN
from polycube.types import HexMesh, Spline
from polycube.types.options import Such

if TYPE_CHECKING:
    from polycube.analysis.problem import Problem
    from polycube.spline.second_order import HexElements

    from .loads import Loads


class TextFormat(ABC):
    """A format that consists of text."""

    suffix: ClassVar[str]

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write a file at `path`, with the suffix of this format, and return its path.

        Raises InputError if a place of the problem does not exist on the boundary of the mesh.
        """
        return write_parts(path.with_suffix(self.suffix), self.parts(hexes))

    @abstractmethod
    def parts(self, hexes: HexMesh) -> Iterable[str]:
        """The text of the file, in parts."""


@dataclass(frozen=True)
class WithNodes:
    """A format with a choice of the nodes of a hex.

    Parameters
    ----------
    nodes : number of nodes of a hex: 8, 20 or 27; the additional nodes are on the spline if there
        is one
    """

    nodes: Annotated[int, Such((8, 20, 27).__contains__, "8, 20 or 27")] = 8
    spline: Spline | None = field(default=None, metadata=BY_RUN)

    def elements(self, hexes: HexMesh) -> HexElements:
        """The hexes with all their nodes."""
        from polycube.spline.second_order import hex_elements

        return hex_elements(hexes, self.spline, self.nodes)


@dataclass(frozen=True)
class WithProblem:
    """A format with a problem, unless `step` is false."""

    step: bool = True
    problem: Problem | None = field(default=None, metadata=BY_RUN)

    # what the files cannot hold: properties of a problem with other values than by default
    lacks: ClassVar[tuple[str, ...]] = ("rotation", "temperature", "cyclic_symmetry", "preloads")

    def __post_init__(self) -> None:
        lacking = [name for name in self.lacks if self.step and getattr(self.problem, name, None)]
        if lacking:
            what = f"{type(self).__name__} files cannot hold the {lacking[0].replace('_', ' ')}"
            remedy = "use export=[abaqus], or step=false for the mesh alone"
            raise InputError(what, "export", remedy)

    @property
    def places(self) -> list[object]:
        """Boundary sets that the file needs."""
        return self.problem.places if self.step and self.problem else []

    def loads(self, hexes: HexMesh, elements: HexElements | None = None) -> Loads | None:
        """The problem on the elements of a mesh; None if it is absent or not written.

        Raises InputError if a place of the problem does not exist on the boundary of the mesh.

        elements : default: the hexes themselves
        """
        from polycube.spline.second_order import hex_elements

        from .loads import Loads

        if not self.step or self.problem is None:
            return None
        return Loads(self.problem, hexes, elements or hex_elements(hexes, None, 8))
