"""Test parts with known properties: a block, with or without a hole, and a ring.

They are far from the origin. The side lengths of the block are 100, 60 and 40; its polycube is a
unit cell, and the map to the part is affine.
"""

from dataclasses import dataclass, replace

import numpy as np

from polycube.hexmesh.connectivity import hex_mesh, quad_sides
from polycube.hexmesh.generation.template import counts, mesh
from polycube.structure.lattice import collapse, lattice
from polycube.structure.rough_map import affine_map
from polycube.types import Candidate, HexMesh, Polycube, RoughMap, TriMesh

SIDES = np.array([100.0, 60.0, 40.0])
PLACE = np.array([1000.0, -500.0, 20.0])
GRID = (2, 1, 1)  # grid of the requested structures


def _hole(axis: int) -> np.ndarray:
    voxels = np.ones((3, 3, 3), bool)
    np.moveaxis(voxels, axis, 2)[1, 1] = False
    return voxels


PRIMITIVES = {"cube": np.ones((3, 3, 3), bool)} | {f"hole_{'xyz'[i]}": _hole(i) for i in (2, 0, 1)}


@dataclass(frozen=True, eq=False)
class Solid:
    """A part with its polycube, the map between them and a good hex mesh."""

    surface: TriMesh
    polycube: Polycube
    rough_map: RoughMap
    hexes: HexMesh

    @property
    def candidate(self) -> Candidate:
        """The correct structure, as a proposal of a structure plugin."""
        return Candidate("given", self.polycube, self.rough_map, 0.0, "solid")


def solid(primitive: str = "cube", size: float = 15.0) -> Solid:
    """The block of one primitive, meshed with edges of about the length `size`."""
    polycube = collapse(lattice((1, 1, 1), (primitive,), PRIMITIVES))
    rough_map = affine_map(polycube, np.diag(SIDES), PLACE)
    hexes = mesh(polycube, rough_map, counts(polycube, rough_map, size))
    outer, faces = np.unique(hexes.quads[:, [[0, 1, 2], [0, 2, 3]]], return_inverse=True)
    return Solid(TriMesh(hexes.vertices[outer], faces.reshape(-1, 3)), polycube, rough_map, hexes)


def half_ring(inner: float = 20, height: float = 10, leg: float = 0) -> TriMesh:
    """A rectangle between the radii `inner` and 30, moved round half a turn.

    Every planar or cylindrical side is a CAD face.

    leg : length of a straight piece at each end
    """
    legs = np.array([leg] * (leg > 0))
    along = np.concatenate([-legs, np.linspace(0, np.pi, 17), np.pi + legs])
    angle = along.clip(0, np.pi)
    section = np.array([[inner, 0], [30, 0], [30, height], [inner, height]])
    turn = np.stack([np.cos(angle), np.sin(angle)], axis=1)[:, None]
    points = np.zeros((len(along), 4, 3))
    points[..., :2], points[..., 2] = turn * section[:, :1], section[:, 1]
    points[..., 1] -= np.abs(along - angle)[:, None]
    ends = np.arange(4 * len(along)).reshape(-1, 4)
    made = hex_mesh(points.reshape(-1, 3) + PLACE, np.hstack([ends[1:], ends[:-1]]))
    owner, side = quad_sides(made)
    piece = np.searchsorted([0, np.pi], along[:-1], "right")[owner]
    region = np.unique(side + 6 * piece * (side < 2), return_inverse=True)[1]
    faces = made.quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    return TriMesh(made.vertices, faces, 1 + np.repeat(region, 2))


def swollen(hexes: HexMesh, by: float = 0.05) -> HexMesh:
    """The mesh enlarged and bent slightly, as after a rough map."""
    middle = hexes.vertices.mean(0)
    offset = (hexes.vertices - middle) / SIDES
    bent = offset * (1 + by) + by * np.roll(offset, 1, axis=1) ** 2
    return replace(hexes, vertices=middle + bent * SIDES)


def claim(holds: bool | np.bool_, requirement: str, found: object = None) -> None:
    """Raise AssertionError with the requirement and the value found if it does not hold."""
    if not holds:
        raise AssertionError(requirement if found is None else f"{requirement}; got {found}")


def claim_array(value: object, dims: tuple[int | None, ...], what: str) -> None:
    """Require a finite numpy array with the sizes `dims`; None allows any size."""
    if not isinstance(value, np.ndarray):
        raise AssertionError(f"{what} is a numpy array; got {type(value).__name__}")
    sizes = zip(dims, value.shape, strict=True)
    fits = value.ndim == len(dims) and all(need in (None, size) for need, size in sizes)
    wanted = ", ".join("any" if d is None else str(d) for d in dims)
    claim(fits, f"{what} has shape ({wanted})", value.shape)
    claim(bool(np.isfinite(value).all()), f"{what} is finite")
