"""The meshes of several solids as one mesh, conforming where they agree.

Two meshes agree where their solids touch if they have equal vertices and quads there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

import numpy as np
from scipy.spatial import cKDTree

from polycube.assembly.contacts import Contact
from polycube.hexmesh.connectivity import unique_rows
from polycube.hexmesh.face_groups import ENDS, LEVEL, measure
from polycube.hexmesh.named_sets import cad_faces
from polycube.names import unique
from polycube.surface.measures import connected
from polycube.types import HexMesh

Joint = tuple[int, int, np.ndarray]  # two solids, and the vertices (K, 2) of both that are merged
Place = tuple[int, str]  # a solid and one of its sets
ONE_PLACE = 0.02  # of the shortest quad side at a vertex: closer vertices are equal
ALIKE = 0.9  # areas that are about equal; otherwise the smaller faces are bound in ties
COVERED = 0.97  # of the area of a contact: smallest share of common quads, which have chords


def combined(
    meshes: Mapping[int, HexMesh],
    names: Sequence[str],
    joints: Sequence[Joint],
    ties: Sequence[tuple[Place, Place]] = (),
    friction: float | None = None,
) -> HexMesh:
    """Merge meshes into one; merged vertices are at the midpoint of both.

    Returns the mesh. `cell` is the number of the solid of each hex, and `primitives` are the names.
    Sets of patches and the quads between merged solids are omitted; `x_min` etc. are the ends of
    the whole.

    meshes : meshes by the number of their solid, from 0, ascending
    names : names of all solids; boundary sets are named by the solid and the set
    ties : sets of different solids that move together, see `HexMesh`
    friction : coefficient if they are in contact instead
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
        sets={sets[key]: own for key, own in found.items()}
        | _ends(vertices, quads[is_outside], found),
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
        ties=tuple((sets[a], sets[b]) for a, b in ties if a in sets and b in sets),
        friction=friction,
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


def _ends(
    vertices: np.ndarray, quads: np.ndarray, sets: Mapping[Place, np.ndarray]
) -> dict[str, np.ndarray]:
    """Quads of the ends of the whole: of the ends of those solids that reach farthest."""
    slack = LEVEL * np.linalg.norm(np.ptp(vertices, axis=0))
    found = {}
    for end, name in enumerate(ENDS):
        out = (2 * (end % 2) - 1) * vertices[:, end // 2]
        least = out.max() - slack
        own = [q for (_, each), q in sets.items() if each == name and out[quads[q]].max() > least]
        if own:
            found[name] = np.concatenate(own)
    return found


def _starts(meshes: Mapping[int, HexMesh], counts: Sequence[int]) -> dict[int, int]:
    """Index of the first item of each mesh among those of all meshes."""
    return dict(zip(meshes, accumulate(counts, initial=0), strict=False))


@dataclass(frozen=True, eq=False)
class Agreement:
    """Agreement of two meshes at a contact."""

    # number of quads of each mesh on its face, including those outside the contact
    quads: tuple[int, int]
    pairs: np.ndarray  # (N, 2) quads of the first and the second mesh with equal vertices
    area: float  # area of these quads, in squared model units
    is_covered: bool  # whether they cover the contact, so that the meshes agree there
    vertices: np.ndarray  # (K, 2) vertices of these quads, of the first and the second mesh
    binds_first: bool = False  # whether ties bind nodes of the first mesh, not of the second


def agreements(first: HexMesh, second: HexMesh, contacts: Sequence[Contact]) -> list[Agreement]:
    """Compare two meshes with sets `cad_face_1` etc. at the contacts of their solids."""
    vertices, quads = _common(first, second)
    faces = cad_faces(first), cad_faces(second)
    areas = [measure(mesh.vertices[mesh.quads]).area for mesh in (first, second)]
    found, total = [], np.zeros(2)
    for contact in contacts:
        f, g = contact.first, contact.second
        own = quads[(faces[0][quads[:, 0]] == f) & (faces[1][quads[:, 1]] == g)]
        area = float(areas[0][own[:, 0]].sum())
        meshed = areas[0][faces[0] == f].sum(), areas[1][faces[1] == g].sum()
        is_covered = 0 < COVERED * min(contact.area, *meshed) <= area
        counts = int((faces[0] == f).sum()), int((faces[1] == g).sum())
        total += meshed
        ends = vertices[np.isin(vertices[:, 0], first.quads[own[:, 0]])]
        found.append(Agreement(counts, own, area, bool(is_covered), ends))
    number = np.sum([each.quads for each in found], axis=0)
    is_alike = total.min() > ALIKE * total.max()
    # the same for all contacts, so that no node is bound in one tie and binds others in another
    binds_first = bool(number[0] > number[1] if is_alike else total[0] < total[1])
    return [replace(each, binds_first=binds_first) for each in found]


def _common(first: HexMesh, second: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (K, 2) of equal boundary vertices, and (N, 2) of quads with equal corners."""
    (own, reach), (other, span) = _places(first), _places(second)
    off, nearest = cKDTree(second.vertices[other]).query(first.vertices[own])
    back = cKDTree(first.vertices[own]).query(second.vertices[other])[1]
    same = off <= ONE_PLACE * np.minimum(reach, span[nearest])
    same &= back[nearest] == np.arange(len(own))
    pairs = np.stack([own[same], other[nearest[same]]], axis=1)
    partner = np.full(len(first.vertices), -1)
    partner[pairs[:, 0]] = pairs[:, 1]
    moved = partner[first.quads]
    known = np.flatnonzero((moved >= 0).all(axis=1))
    apart, partners = cKDTree(np.sort(second.quads, axis=1)).query(np.sort(moved[known], axis=1))
    return pairs, np.stack([known, partners], axis=1)[apart == 0]


def _places(mesh: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (N,) of the boundary, and the length (N,) of the shortest quad side at each."""
    corners = mesh.vertices[mesh.quads]
    length = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    shortest = np.full(len(mesh.vertices), np.inf)
    np.minimum.at(shortest, np.stack([mesh.quads, np.roll(mesh.quads, -1, axis=1)]), length)
    own = np.unique(mesh.quads)
    return own, shortest[own]
