"""One spline of several solids, continuous where their meshes share vertices.

Each solid has a spline with one function for each vertex of its mesh, sharp at the borders of the
interfaces, so that on an interface it depends only on the vertices there. The solids share the
functions of shared vertices, and on an interface all have the extraction of the first.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import accumulate

import numpy as np
from scipy.sparse import block_diag, csr_matrix

from polycube.errors import InputError
from polycube.hexmesh.connectivity import quad_edges, quad_sides, unique_rows
from polycube.spline.spaces.extraction import TENSOR, bezier_nodes
from polycube.spline.spaces.sharp_features import is_among
from polycube.surface.measures import half_edges
from polycube.types import HexMesh, Spline

# the spline of a solid, by its number, its mesh, sharp edges (S, 2), and further edges (T, 2) that
# are sharp if det J allows it
Make = Callable[[int, HexMesh, np.ndarray, np.ndarray], Spline]


def united(
    meshes: Mapping[int, HexMesh], mesh: HexMesh, make: Make, held: Sequence[np.ndarray] = ()
) -> Spline:
    """The spline of all solids; its elements are numbered as the hexes.

    Each solid has its own Bezier nodes (`Spline.place`), because stresses differ on both sides of
    an interface. Raises InputError if a spline does not have one function for each vertex.

    meshes : meshes by the number of their solid, ascending
    mesh : the mesh of all, from `combined`
    held : edges (S, 2) of it with ascending ends that are sharp if possible
    """
    numbers = [np.zeros(len(own.vertices), np.int64) for own in meshes.values()]
    pairs = [(k, own, number) for (k, own), number in zip(meshes.items(), numbers, strict=True)]
    for k, own, number in pairs:  # of its vertices among all
        number[own.hexes] = mesh.hexes[mesh.cell == k]
    quads = np.concatenate([number[own.quads] for _, own, number in pairs])
    _, face, times = unique_rows(np.sort(quads, axis=1))
    distinct, is_outside = quads[np.unique(face, return_index=True)[1]], times[face] == 1
    edges, _, count = unique_rows(np.sort(half_edges(distinct), axis=1))
    chosen, splines = (edges[count != 2], np.concatenate([edges[:0], *held])), []
    for k, own, number in pairs:
        sides, _ = quad_edges(own.quads)
        sharp = (sides[is_among(np.sort(number[sides], axis=1), each)] for each in chosen)
        splines.append(make(k, replace(own, vertices=mesh.vertices[number]), *sharp))
        if len(splines[-1].control) != len(own.vertices) or splines[-1].level.any():
            what = "solids are analysed together if their splines have a function for each vertex"
            raise InputError(f"{what}; use spline=h2s without refinement")
    every = np.concatenate(numbers)
    share = csr_matrix((np.ones(len(every)), every, np.arange(len(every) + 1)))
    rows = csr_matrix(block_diag([own.extraction for own in splines]) @ share)
    start = [0, *accumulate(own.extraction.shape[0] for own in splines)]
    nodes = np.concatenate([own.nodes + n for own, n in zip(splines, start, strict=False)])
    start = [0, *accumulate(len(own.sides) for own in splines)]
    inner = np.concatenate([own.inner_edges + n for own, n in zip(splines, start, strict=False)])
    at = np.zeros(rows.shape[0], np.int64)
    at[nodes], _ = bezier_nodes(mesh.hexes[:, TENSOR])
    _, first, which = np.unique(at, return_index=True, return_inverse=True)
    return Spline(
        control=share.T @ np.concatenate([s.control for s in splines]) / share.sum(axis=0).T,
        extraction=rows[first[which]],
        nodes=nodes,
        element_hex=np.arange(len(nodes)),
        level=np.zeros(len(nodes)),
        sides=np.stack(quad_sides(mesh), axis=1),
        patch=mesh.patch,
        sets=mesh.sets,
        inner_edges=(np.cumsum(is_outside) - 1)[inner[is_outside[inner].all(axis=1)]],
        offset=np.concatenate([own.offset for own in splines])[is_outside],
        tilt=np.concatenate([own.tilt for own in splines])[is_outside],
        place=first[which],
    )
