"""JAXIGA."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from polycube.io.atomic import atomic_write
from polycube.registry import BY_RUN, register
from polycube.types import HexMesh, Spline

from .groups import side_sets

Arrays = dict[str, Any]


@register("export", "jaxiga")
@dataclass(frozen=True)
class Jaxiga:
    """JAXIGA (.npz): arrays of a function space, that of the spline or of trilinear hexes.

    Elements with fewer functions than others are padded as in JAXIGA: with the number of functions
    in `elem_dofs`, and with rows of zeros in `extraction`.
    """

    spline: Spline | None = field(default=None, metadata=BY_RUN)

    suffix: ClassVar[str] = ".npz"

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """Write a file at `path`, with the suffix of this format, and return its path."""
        named = replace(hexes, sets=side_sets(hexes))
        space = _trilinear(named) if self.spline is None else _tricubic(self.spline, named)
        path = path.with_suffix(self.suffix)
        with atomic_write(path) as temporary, open(temporary, "wb") as file:
            np.savez_compressed(file, **space)
        return path


def _tricubic(spline: Spline, mesh: HexMesh) -> Arrays:
    from polycube.hexmesh.named_sets import sets_of_spline
    from polycube.spline.boundary import FACES

    functions = spline.element_functions()
    dofs, extraction = functions.padded(np.arange(len(spline.nodes)), len(spline.control))
    sides = {name: spline.sides[own] for name, own in sets_of_spline(spline, mesh).items()}
    return _space(dofs, extraction, spline.control, 3) | _boundaries(dofs, extraction, sides, FACES)


def _trilinear(mesh: HexMesh) -> Arrays:
    from polycube.hexmesh.connectivity import FACES, PLACES, quad_sides

    order = np.argsort(PLACES @ [1, 2, 4])  # xi fastest
    dofs = mesh.hexes[:, order]
    extraction = np.tile(np.eye(8), (len(dofs), 1, 1))
    owner = np.stack(quad_sides(mesh), axis=1)
    sides = {name: owner[own] for name, own in mesh.sets.items()}
    faces = np.argsort(order)[FACES]
    return _space(dofs, extraction, mesh.vertices, 1) | _boundaries(dofs, extraction, sides, faces)


def _space(dofs: np.ndarray, extraction: np.ndarray, points: np.ndarray, degree: int) -> Arrays:
    """The fields of `FunctionSpace`; each element has its own parameter cube."""
    return {
        "elem_dofs": dofs,
        "extraction": extraction,
        "cpts": points,
        "wgts": np.ones(len(points)),
        "elem_vertex": np.tile([0.0, 0.0, 0.0, 1.0, 1.0, 1.0], (len(dofs), 1)),
        "degree": np.full(3, degree),
    }


def _boundaries(
    dofs: np.ndarray, extraction: np.ndarray, sets: Arrays, faces: np.ndarray
) -> Arrays:
    """Elements, sides and functions of each named set, the fields of `BoundarySet`.

    sets : (n, 2) element and side, faces : (6, m) Bezier points on each side
    """
    found = {}
    for name, own in sets.items():
        elements, sides = own.T
        on_side = np.take_along_axis(extraction[elements], faces[sides][:, None], axis=2)
        found[f"boundaries/{name}/elems"] = elements
        found[f"boundaries/{name}/sides"] = sides
        found[f"boundaries/{name}/dofs"] = np.unique(dofs[elements][on_side.any(axis=2)])
    return found
