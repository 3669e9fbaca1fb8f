"""FEBio."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar
from xml.sax.saxutils import quoteattr

import numpy as np

from polycube.registry import BY_RUN, register
from polycube.types import HexMesh, Spline

from .groups import blocks, legend, node_sets, primitive_sets, renamed
from .text import count, lines, wrapped, write

if TYPE_CHECKING:
    from polycube.analysis.problem import Problem

NAME = 255  # longest name


@register("export", "febio")
@dataclass(frozen=True)
class Febio:
    """FEBio 4 (.feb): a part for each grid cell, named sets of nodes, faces and hexes, material.

    Steps, supports and loads are defined in FEBio Studio, or in a file that includes this one.

    Parameters
    ----------
    nodes : number of nodes of a hex: 8 or 20; the additional ones are on the spline if there is one
    """

    nodes: int = 8
    spline: Spline | None = field(default=None, metadata=BY_RUN)
    problem: Problem | None = field(default=None, metadata=BY_RUN)

    def __post_init__(self) -> None:
        if self.nodes not in (8, 20):
            raise ValueError(f"nodes must be 8 or 20; got {self.nodes!r}")

    suffix: ClassVar[str] = ".feb"

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write a file at `path`, with the suffix of this format, and return its path."""
        from polycube.spline.second_order import hex_elements

        from .loads import Loads

        own, parts = hex_elements(hexes, self.spline, self.nodes), blocks(hexes)
        hexes = renamed(hexes, NAME, ascii_only=False)
        quad = f"quad{own.quads.shape[1]}"
        text = []
        for part, rows in parts.items():
            cells = lines(
                np.column_stack([rows + 1, own.hexes[rows] + 1]), _tag("elem", self.nodes)
            )
            text.append(_named("Elements", part, cells, f' type="hex{self.nodes}"'))
        for name, rows in node_sets(hexes, own.quads).items():
            text.append(_named("NodeSet", name, _list(rows)))
        for name, rows in primitive_sets(hexes).items():
            text.append(_named("ElementSet", name, _list(rows)))
        for name, quads in hexes.sets.items():
            faces = lines(count(own.quads[quads] + 1), _tag(quad, own.quads.shape[1]))
            text.append(_named("Surface", name, faces))
        elastic = Loads(self.problem, hexes, own).elastic if self.problem else ()
        values = zip(("density", "E", "v"), np.roll(elastic, 1), strict=False)
        material = "".join(f"<{tag}>{value:.9g}</{tag}>\n" for tag, value in values)
        kind = ' id="1" type="isotropic elastic"'
        solids = "".join(f'<SolidDomain name="{part}" mat="material"/>\n' for part in parts)
        units = f"{Loads(self.problem, hexes, own).units}\n" if material and self.problem else ""
        return write(
            path.with_suffix(self.suffix),
            '<?xml version="1.0" encoding="UTF-8"?>\n<febio_spec version="4.0">\n',
            f"<!--\n{units}{legend(hexes).replace('--', '- -')}-->\n",
            '<Module type="solid"/>\n',
            f"<Material>\n{_named('material', 'material', material, kind)}</Material>\n"
            if material
            else "",
            '<Mesh>\n<Nodes name="all">\n',
            lines(count(own.points), '<node id="%d">%.17g,%.17g,%.17g</node>'),
            "</Nodes>\n",
            *text,
            "</Mesh>\n",
            f"<MeshDomains>\n{solids}</MeshDomains>\n" if material else "",
            "</febio_spec>\n",
        )


def _tag(kind: str, nodes: int) -> str:
    return f'<{kind} id="%d">' + ",".join(nodes * ["%d"]) + f"</{kind}>"


def _named(kind: str, name: str, content: str, more: str = "") -> str:
    return f"<{kind} name={quoteattr(name)}{more}>\n{content}</{kind}>\n"


def _list(rows: np.ndarray) -> str:
    """Numbers, from one, separated by commas."""
    return wrapped(rows + 1, 16, between=",").strip().replace("\n", ",\n") + "\n"
