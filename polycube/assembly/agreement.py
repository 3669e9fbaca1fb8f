"""Agreement of two hex meshes where their solids touch: equal vertices and quads."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from polycube.assembly.contacts import Contact
from polycube.hexmesh.face_groups import measure
from polycube.hexmesh.named_sets import cad_faces
from polycube.types import HexMesh

ONE_PLACE = 0.02  # of the shortest quad side at a vertex: closer vertices are equal
COVERED = 0.99  # of the area of a contact: smallest share of common quads for agreeing meshes


@dataclass(frozen=True, eq=False)
class Agreement:
    """Agreement of two meshes at a contact.

    Parameters
    ----------
    quads : number of quads of each mesh on its face, including those outside the contact
    pairs : (N, 2) quads of the first and the second mesh with equal vertices
    area : area of these quads, in squared model units
    is_covered : whether they cover the contact, so that the meshes agree there
    vertices : (K, 2) vertices of these quads, of the first and the second mesh
    """

    quads: tuple[int, int]
    pairs: np.ndarray
    area: float
    is_covered: bool
    vertices: np.ndarray


def agreements(first: HexMesh, second: HexMesh, contacts: Sequence[Contact]) -> list[Agreement]:
    """Compare two meshes with sets `cad_face_1` etc. at the contacts of their solids."""
    vertices, quads = _common(first, second)
    faces = cad_faces(first), cad_faces(second)
    areas = [measure(mesh.vertices[mesh.quads]).area for mesh in (first, second)]
    found = []
    for contact in contacts:
        f, g = contact.first, contact.second
        own = quads[(faces[0][quads[:, 0]] == f) & (faces[1][quads[:, 1]] == g)]
        area = float(areas[0][own[:, 0]].sum())
        meshed = areas[0][faces[0] == f].sum(), areas[1][faces[1] == g].sum()
        is_covered = 0 < COVERED * min(contact.area, *meshed) <= area
        counts = int((faces[0] == f).sum()), int((faces[1] == g).sum())
        ends = vertices[np.isin(vertices[:, 0], first.quads[own[:, 0]])]
        found.append(Agreement(counts, own, area, bool(is_covered), ends))
    return found


def _common(first: HexMesh, second: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (K, 2) of equal boundary vertices, and (N, 2) of quads with equal corners."""
    (own, reach), (other, span) = _places(first), _places(second)
    tree = cKDTree(second.vertices[other])
    off, nearest = tree.query(first.vertices[own])
    back = cKDTree(first.vertices[own]).query(second.vertices[other])[1]
    same = off <= ONE_PLACE * np.minimum(reach, span[nearest])
    same &= back[nearest] == np.arange(len(own))
    pairs = np.stack([own[same], other[nearest[same]]], axis=1)
    partner = np.full(len(first.vertices), -1)
    partner[pairs[:, 0]] = pairs[:, 1]
    moved = partner[first.quads]
    known = np.flatnonzero((moved >= 0).all(axis=1))
    rows = np.concatenate([np.sort(second.quads, axis=1), np.sort(moved[known], axis=1)])
    _, number = np.unique(rows, axis=0, return_inverse=True)
    number = number.ravel()
    there = np.full(number.max() + 1, -1)
    there[number[: len(second.quads)]] = np.arange(len(second.quads))
    partners = there[number[len(second.quads) :]]
    return pairs, np.stack([known, partners], axis=1)[partners >= 0]


def _places(mesh: HexMesh) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (N,) of the boundary, and the length (N,) of the shortest quad side at each."""
    corners = mesh.vertices[mesh.quads]
    length = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    shortest = np.full(len(mesh.vertices), np.inf)
    np.minimum.at(shortest, mesh.quads, length)
    np.minimum.at(shortest, np.roll(mesh.quads, -1, axis=1), length)
    own = np.unique(mesh.quads)
    return own, shortest[own]
