"""Abaqus and CalculiX."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from polycube.registry import register
from polycube.types import HexMesh

from .groups import blocks, node_sets, primitive_sets, side_sets
from .text import count, integers, numbered, wrapped, write

SIDES = (6, 4, 3, 5, 1, 2)  # Abaqus' numbers of the faces -xi +xi -eta +eta -zeta +zeta

# hybrid, incompatible modes, reduced integration; coupled with temperature or pore pressure
VARIANTS = "", "H", "I", "IH", "R", "RH", "T", "HT", "RT", "RHT", "P", "PH", "RP", "RPH"
ELEMENTS = tuple(f"C3D8{variant}" for variant in VARIANTS)


@register("export", "abaqus")
@dataclass(frozen=True)
class Abaqus:
    """Abaqus and CalculiX (.inp): ELSET of cells and primitives, NSET and SURFACE of each set.

    Parameters
    ----------
    element : element type: C3D8, C3D8R, C3D8I
    """

    element: str = "C3D8"

    def __post_init__(self) -> None:
        if self.element not in ELEMENTS:
            raise ValueError(
                f"element must be one of {', '.join(ELEMENTS)}, the hexahedra of eight nodes; "
                f"got {self.element!r}"
            )

    suffix: ClassVar[str] = ".inp"

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write next to `path`, with this format's suffix; returns the file written."""
        from polycube.hexmesh.connectivity import quad_sides

        owner, side = quad_sides(hexes)
        parts = ["*HEADING\nhex mesh of polycube, lengths in the units of the input\n"]
        parts += ["*NODE, NSET=all\n", numbered(hexes.vertices)]
        parts.append(f"*ELEMENT, TYPE={self.element}, ELSET=all\n")
        parts.append(integers(count(hexes.hexes + 1), ", "))
        for name, own in (blocks(hexes) | primitive_sets(hexes)).items():
            parts += [f"*ELSET, ELSET={name}\n", wrapped(own + 1, 16, between=", ")]
        for name, own in node_sets(hexes).items():
            parts += [f"*NSET, NSET={name}\n", wrapped(own + 1, 16, between=", ")]
        for name, quads in side_sets(hexes).items():
            parts.append(f"*SURFACE, TYPE=ELEMENT, NAME={name}\n")
            parts += [f"{owner[q] + 1}, S{SIDES[side[q]]}\n" for q in quads]
        return write(path.with_suffix(self.suffix), *parts)
