"""Regions in which a hex mesh has product structure, and the faces across which it does not.

At a vertex, half-edges that are opposite each other across a face form a class. The mesh has
product structure in the direction of a class if either all hexes at the vertex contain one of its
two half-edges and these are opposite each other (a line passes), or all contain its only one (a
line ends at the boundary). This holds in all directions at regular vertices, and only along the
line at an extraordinary edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polycube.hexmesh.connectivity import PLACES, neighbours
from polycube.spline.spaces.extraction import NO_INDICES, TENSOR
from polycube.surface.measures import connected
from polycube.types import HexMesh

SIDES = np.array(
    [[t for t in range(8) if t >> axis & 1 == side] for axis in range(3) for side in range(2)]
)  # (6, 4) tensor corners of -xi, +xi, -eta, +eta, -zeta, +zeta


@dataclass(frozen=True)
class HalfEdges:
    """Edges of a hex mesh seen from each end, numbered by vertex."""

    number: np.ndarray  # (H, 8, 3) from each corner, in tensor order, along each axis
    vertex: np.ndarray  # (N,) start vertex
    end: np.ndarray  # (N,) end vertex
    pairs: np.ndarray  # (P, 2) equal faces as 6 hex + side
    across: np.ndarray  # (P, 4, 2) opposite half-edges at each

    @classmethod
    def of(cls, hexes: np.ndarray) -> HalfEdges:
        """Half-edges of hexes (H, 8) in VTK order."""
        corners = hexes[:, TENSOR]
        base = np.int64(corners.max() + 1)
        ends = np.stack([corners[:, np.arange(8) ^ (1 << axis)] for axis in range(3)], axis=-1)
        key, number = np.unique(corners[:, :, None] * base + ends, return_inverse=True)
        number = number.reshape(ends.shape)
        pairs = np.stack(neighbours(hexes), axis=1)
        hex_, side = np.divmod(pairs, 6)
        places = SIDES[side]  # (P, 2, 4)
        order = np.argsort(corners[hex_[..., None], places], axis=-1)
        places = np.take_along_axis(places, order, axis=-1)
        across = number[hex_[..., None], places, side[..., None] // 2].swapaxes(1, 2)
        return cls(number, key // base, key % base, pairs, across)

    def classes(self, linked: np.ndarray) -> np.ndarray:
        """(N,) smallest half-edge of the class of each, across the given pairs (P,) of faces."""
        links = self.across[linked].reshape(-1, 2)
        group = connected(links[:, 0], links[:, 1], len(self.vertex))
        _, least, label = np.unique(group, return_index=True, return_inverse=True)
        return least[label]


def cut_faces(
    mesh: HexMesh,
    sharp_edges: np.ndarray,
    corner_vertices: np.ndarray = NO_INDICES,
    rings: int | None = 0,
) -> np.ndarray:
    """(H, 6) sides of hexes across which a spline is only continuous.

    These are the boundary, and faces with a corner where the mesh or its sharp edges have no
    product structure across them.

    sharp_edges : (S, 2) and corner_vertices, as for `volumetric_spline`
    rings : rings of faces by which cuts that end inside are continued as sheets; None: to their
        ends
    """
    half = HalfEdges.of(mesh.hexes)
    label = half.classes(np.ones(len(half.pairs), bool))
    size = len(half.vertex)
    n_hexes = np.bincount(mesh.hexes.ravel())[half.vertex]
    members = np.bincount(label, minlength=size)
    uses = np.bincount(label[half.number].ravel(), minlength=size)
    across = label[half.across[..., 0]]  # (P, 4) class at each corner of a face
    links = np.bincount(across.ravel(), minlength=size)
    ends = members == 1
    passes = (members == 2) & (2 * links == uses)
    is_product = (uses == n_hexes) & np.where(ends, links == 0, passes)
    is_product &= ends | _follows(half, label, sharp_edges, corner_vertices)
    pairs = _carried_on(~is_product[across].all(axis=1), across, rings)
    cut = np.ones((len(mesh.hexes), 6), bool)
    cut.reshape(-1)[half.pairs[~pairs]] = False
    return cut


def _carried_on(cut: np.ndarray, across: np.ndarray, rings: int | None) -> np.ndarray:
    """(P,) faces that are cut; each ring adds faces that share a class with the earlier ones."""
    while rings is None or rings > 0:
        has = np.zeros(across.max(initial=0) + 1, bool)
        has[across[cut]] = True
        more = has[across].any(axis=1)
        if np.array_equal(more, cut):
            break
        cut, rings = more, None if rings is None else rings - 1
    return cut


def _follows(
    half: HalfEdges, label: np.ndarray, sharp_edges: np.ndarray, corner_vertices: np.ndarray
) -> np.ndarray:
    """(N,) by class: whether nothing at the vertex is sharp except the whole line itself."""
    base = half.vertex.max() + 1
    keys = np.concatenate([sharp_edges, sharp_edges[:, ::-1]]) @ [base, 1]
    sharp = np.isin(half.vertex * base + half.end, keys)
    at_vertex = np.bincount(half.vertex[sharp], minlength=base)
    in_class = np.bincount(label[sharp], minlength=len(label))
    at_vertex[np.asarray(corner_vertices, np.int64)] = -1
    return (at_vertex[half.vertex] == in_class) & (in_class != 1)


def children(sides: np.ndarray) -> np.ndarray:
    """(8 H, 6) flags of the sides of the children in VTK corner order, from those of (H, 6)."""
    outer = np.stack([1 - PLACES, PLACES], axis=-1).reshape(8, 6).astype(bool)
    return (sides[:, None] & outer).reshape(-1, 6)
