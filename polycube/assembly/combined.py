"""The meshes of several solids as one mesh, conforming where they agree."""

from collections.abc import Mapping, Sequence
from itertools import accumulate

import numpy as np

from polycube.hexmesh.connectivity import unique_rows
from polycube.names import unique
from polycube.surface.measures import connected
from polycube.types import HexMesh

Joint = tuple[int, int, np.ndarray]  # two solids, and the vertices (K, 2) of both that are merged


def combined(
    meshes: Mapping[int, HexMesh], names: Sequence[str], joints: Sequence[Joint]
) -> HexMesh:
    """Merge meshes into one; merged vertices are at the midpoint of both.

    Parameters
    ----------
    meshes : meshes by the number of their solid, from 0, ascending
    names : names of all solids; boundary sets are named by the solid and the set

    Returns
    -------
    The mesh. `cell` is the number of the solid of each hex, and `primitives` are the names. Sets of
    patches and the quads between merged solids are omitted.
    """
    parts = meshes.values()
    start = _starts(meshes, [len(mesh.vertices) for mesh in parts])
    links = [pairs + np.array([start[i], start[j]]) for i, j, pairs in joints]
    ends = np.concatenate([np.zeros((0, 2), np.int64), *links])
    places = np.concatenate([mesh.vertices for mesh in parts])
    group = connected(ends[:, 0], ends[:, 1], len(places))
    first = np.unique(group, return_index=True)[1][group]
    first_ones, number, count = np.unique(first, return_inverse=True, return_counts=True)
    vertices, several = places[first_ones], count > 1
    for axis, place in enumerate(places.T):
        vertices[several, axis] = (np.bincount(number, place) / count)[several]
    quads = np.concatenate([number[mesh.quads + start[k]] for k, mesh in meshes.items()])
    _, row, times = unique_rows(np.sort(quads, axis=1))
    is_outside = times[row] == 1
    found = _sets(meshes, is_outside)
    sets = dict(zip(found, unique(f"{names[k]}_{name}" for k, name in found), strict=True))
    return HexMesh(
        vertices,
        np.concatenate([number[mesh.hexes + start[k]] for k, mesh in meshes.items()]),
        quads[is_outside],
        np.concatenate([mesh.patch for mesh in parts])[is_outside],
        np.repeat(list(meshes), [len(mesh.hexes) for mesh in parts]),
        primitives=tuple(names),
        sets={sets[key]: own for key, own in found.items()},
        cad_names={
            sets[k, name]: mesh.cad_names[name]
            for k, mesh in meshes.items()
            for name in mesh.cad_names
            if (k, name) in sets
        },
        node_sets={
            f"{names[k]}_{name}": np.unique(number[own + start[k]])
            for k, mesh in meshes.items()
            for name, own in mesh.node_sets.items()
        },
        unit=next((mesh.unit for mesh in parts), ""),
    )


def _sets(
    meshes: Mapping[int, HexMesh], is_outside: np.ndarray
) -> dict[tuple[int, str], np.ndarray]:
    """Quads of the whole boundary by solid and name of the set, without empty ones."""
    start = _starts(meshes, [len(mesh.quads) for mesh in meshes.values()])
    place = np.cumsum(is_outside) - 1
    found = {
        (k, name): own[is_outside[own + start[k]]] + start[k]
        for k, mesh in meshes.items()
        for name, own in mesh.sets.items()
        if not name.startswith("patch_")
    }
    return {key: place[own] for key, own in found.items() if len(own)}


def _starts(meshes: Mapping[int, HexMesh], counts: Sequence[int]) -> dict[int, int]:
    """Index of the first item of each mesh among those of all meshes."""
    return dict(zip(meshes, accumulate(counts, initial=0), strict=False))
