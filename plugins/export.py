"""The hex mesh in the formats of other programs, plain text.

Coordinates are exact to the last bit, in Nastran and LS-DYNA to ten digits: their columns end.

`patch` numbers the faces of the polycube: they become node sets, surfaces, physical groups or
references, so that loads and supports can be put on them.  The primitive of each grid cell, where
it is known, is a set, part of a name or a comment.  The order of the nodes of a hexahedron is VTK's
in all formats.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np

from polycube.geometry.hexes import quad_sides
from polycube.geometry.quality import scaled_jacobian
from polycube.io.atomic import whole
from polycube.io.vtk import numbered_primitives
from polycube.registry import register
from polycube.types import HexMesh

_SIDES = (6, 4, 3, 5, 1, 2)  # Abaqus' numbers of the faces -xi +xi -eta +eta -zeta +zeta


@register("export", "vtk")
@dataclass(frozen=True)
class LegacyVtk:
    """Legacy VTK, `.vtk`: what research codes and HexaLab read."""

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write next to `path`, with this format's suffix; returns the file written."""
        n = len(hexes.hexes)
        quality = scaled_jacobian(hexes.vertices, hexes.hexes)
        names, primitive = numbered_primitives(hexes.primitives)
        legend = ", ".join(f"{i} {name}" for i, name in enumerate(names))
        title = f"hex mesh of polycube{'; primitive: ' if names else ''}{legend}"[:255]
        of_hex = (
            []
            if not names
            else [
                "SCALARS primitive int 1\nLOOKUP_TABLE default\n",
                _integers(primitive[hexes.cell][:, None]),
            ]
        )
        return _write(
            path.with_suffix(".vtk"),
            f"# vtk DataFile Version 3.0\n{title}\nASCII\nDATASET UNSTRUCTURED_GRID\n",
            f"POINTS {len(hexes.vertices)} double\n",
            _floats(hexes.vertices),
            f"CELLS {n} {9 * n}\n",
            _integers(np.insert(hexes.hexes, 0, 8, axis=1)),
            f"CELL_TYPES {n}\n" + "12\n" * n,
            f"CELL_DATA {n}\nSCALARS cell int 1\nLOOKUP_TABLE default\n",
            _integers(hexes.cell[:, None]),
            *of_hex,
            "SCALARS scaled_jacobian double 1\nLOOKUP_TABLE default\n",
            _floats(quality[:, None]),
        )


@register("export", "abaqus")
@dataclass(frozen=True)
class Abaqus:
    """Abaqus and CalculiX, `.inp`: ELSET CELL_c and PRIMITIVE_name, NSET and SURFACE PATCH_p."""

    element: str = "C3D8"  # C3D8, or a variant such as C3D8R, C3D8I

    def __post_init__(self) -> None:
        if not self.element.startswith("C3D8"):
            raise ValueError(f"element must be C3D8 or a variant of it; got {self.element!r}")

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write next to `path`, with this format's suffix; returns the file written."""
        owner, side = quad_sides(hexes)
        names, primitive = numbered_primitives(hexes.primitives)
        parts = ["*HEADING\nhex mesh of polycube, lengths in the units of the input\n*NODE\n"]
        parts += [_numbered(hexes.vertices), f"*ELEMENT, TYPE={self.element}, ELSET=ALL\n"]
        parts.append(_integers(_count(hexes.hexes + 1), ", "))
        for cell in np.unique(hexes.cell):
            parts += [f"*ELSET, ELSET=CELL_{cell}\n", _list(np.flatnonzero(hexes.cell == cell))]
        for number, name in enumerate(names):
            own = np.flatnonzero(primitive[hexes.cell] == number)
            parts += [f"*ELSET, ELSET=PRIMITIVE_{name.upper()}\n", _list(own)]
        for patch in np.unique(hexes.patch):
            on = hexes.patch == patch
            parts += [f"*NSET, NSET=PATCH_{patch}\n", _list(np.unique(hexes.quads[on]))]
            parts.append(f"*SURFACE, TYPE=ELEMENT, NAME=PATCH_{patch}\n")
            parts += [f"{e + 1}, S{_SIDES[s]}\n" for e, s in zip(owner[on], side[on], strict=True)]
        return _write(path.with_suffix(".inp"), *parts)


@register("export", "gmsh")
@dataclass(frozen=True)
class Gmsh:
    """Gmsh 2.2, `.msh`: physical volume cell_c or cell_c_primitive, physical surface patch_p."""

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write next to `path`, with this format's suffix; returns the file written."""
        patches, cells = np.unique(hexes.patch), np.unique(hexes.cell)
        names = [f'2 {p + 1} "patch_{p}"\n' for p in patches]
        filled = {c: f"_{name}" for c, name in enumerate(hexes.primitives) if name}
        names += [f'3 {c + 1} "cell_{c}{filled.get(c, "")}"\n' for c in cells.tolist()]
        quads = _elements(3, hexes.patch, hexes.quads, 1)
        volumes = _elements(5, hexes.cell, hexes.hexes, 1 + len(quads))
        return _write(
            path.with_suffix(".msh"),
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n",
            f"$PhysicalNames\n{len(names)}\n{''.join(names)}$EndPhysicalNames\n",
            f"$Nodes\n{len(hexes.vertices)}\n",
            _numbered(hexes.vertices, " "),
            f"$EndNodes\n$Elements\n{len(quads) + len(volumes)}\n",
            _integers(quads),
            _integers(volumes),
            "$EndElements\n",
        )


@register("export", "medit")
@dataclass(frozen=True)
class Medit:
    """Medit, `.mesh`: the reference of a quad is its patch, that of a hex its grid cell."""

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write next to `path`, with this format's suffix; returns the file written."""
        flat = np.zeros((len(hexes.vertices), 1))
        return _write(
            path.with_suffix(".mesh"),
            f"MeshVersionFormatted 2\nDimension 3\nVertices\n{len(flat)}\n",
            _floats(np.hstack([hexes.vertices, flat])),
            f"Quadrilaterals\n{len(hexes.quads)}\n",
            _integers(np.column_stack([hexes.quads + 1, hexes.patch])),
            f"Hexahedra\n{len(hexes.hexes)}\n",
            _integers(np.column_stack([hexes.hexes + 1, hexes.cell])),
            "End\n",
        )


@register("export", "nastran")
@dataclass(frozen=True)
class Nastran:
    """Nastran bulk data, `.bdf`: CHEXA whose property is the grid cell, from one."""

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write next to `path`, with this format's suffix; returns the file written."""
        grid = "GRID*   %16d                %16.9E%16.9E\n*       %16.9E"
        first, last = "CHEXA   " + 8 * "%8d", "\n+       " + 2 * "%8d"
        return _write(
            path.with_suffix(".bdf"),
            "BEGIN BULK\n",
            *_comments("property", hexes),
            _text(_count(hexes.vertices), grid),
            _text(_count(np.column_stack([hexes.cell + 1, hexes.hexes + 1])), first + last),
            *(f"PSOLID  {cell + 1:8d}       1\n" for cell in np.unique(hexes.cell)),
            "ENDDATA\n",
        )


@register("export", "lsdyna")
@dataclass(frozen=True)
class LsDyna:
    """LS-DYNA keywords, `.k`: part is the grid cell, segment set the patch, both from one."""

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write next to `path`, with this format's suffix; returns the file written."""
        elements = _count(np.column_stack([hexes.cell + 1, hexes.hexes + 1]))
        parts = [
            "*KEYWORD\n",
            *_comments("part", hexes),
            "*NODE\n",
            _text(_count(hexes.vertices), "%8d" + 3 * "%16.9E"),
        ]
        parts += ["*ELEMENT_SOLID\n", _text(elements, 10 * "%8d")]
        for patch in np.unique(hexes.patch):
            parts.append(f"*SET_SEGMENT\n{patch + 1:10d}\n")
            parts.append(_text(hexes.quads[hexes.patch == patch] + 1, 4 * "%10d"))
        return _write(path.with_suffix(".k"), *parts, "*END\n")


def _comments(what: str, mesh: HexMesh) -> list[str]:
    """What fills each grid cell, where it is known."""
    named = [(c + 1, c, name) for c, name in enumerate(mesh.primitives) if name]
    return [f"$ {what} {number}: cell {cell}, {name}\n" for number, cell, name in named]


def _elements(kind: int, group: np.ndarray, nodes: np.ndarray, first: int) -> np.ndarray:
    """Rows of Gmsh: number, type, two tags (physical, elementary), nodes from one."""
    numbers = np.arange(first, first + len(nodes))
    tags = np.column_stack([numbers, np.full_like(numbers, kind), np.full_like(numbers, 2)])
    return np.column_stack([tags, group + 1, group + 1, nodes + 1])


def _count(rows: np.ndarray) -> np.ndarray:
    """Rows with their number, from one, in front."""
    return np.column_stack([np.arange(1, len(rows) + 1), rows])


def _floats(values: np.ndarray) -> str:
    return _text(values, "%.17g")


def _integers(values: np.ndarray, between: str = " ") -> str:
    return _text(values, "%d", between)


def _numbered(points: np.ndarray, between: str = ", ") -> str:
    return _text(_count(points), ["%d"] + 3 * ["%.17g"], between)


def _text(values: np.ndarray, form: str | list[str], between: str = " ") -> str:
    text = StringIO()
    np.savetxt(text, values, form, between)
    return text.getvalue()


def _list(numbers: np.ndarray) -> str:
    """Numbers from one, sixteen to a line."""
    rows = (numbers[i : i + 16] + 1 for i in range(0, len(numbers), 16))
    return "".join(", ".join(map(str, row)) + "\n" for row in rows)


def _write(path: Path, *parts: str | Iterable[str]) -> Path:
    with whole(path) as temporary, open(temporary, "w", encoding="ascii", newline="\n") as file:
        file.writelines(parts)
    return path
