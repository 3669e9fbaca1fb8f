"""Parts of the boundary by what users call them: sides, holes, patch numbers, faces of a CAD model.

Names come from the geometry, so that a hex mesh of another program has them too.  `x_min` is the
patch, or all patches equally far, farthest out among those that face -x; `hole_1` is a set of
patches that meet at inner angles and face each other in two directions, such as the four walls of a
hole.  Exports, analyses and report all take the sets from here.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from polycube.hexmesh.connectivity import quad_sides
from polycube.types import HexMesh, Spline

ENDS = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")
FACING = 0.6  # cosine between a patch's mean normal and the axis it faces along, at least
FLAT = 0.3  # length of a patch's mean normal, at least, to face some way at all
OPPOSITE = 0.7  # minus the cosine between normals of patches that face each other, at least
INNER = 0.02  # sine of the angle at which two patches turn inwards, at least, on average
LEVEL = 1e-3  # of the diagonal: patches that lie equally far out
GAUSS = (0.5 - np.sqrt(1 / 12), 0.5 + np.sqrt(1 / 12))  # of two points on the unit interval

Sets = Mapping[str, np.ndarray]  # numbers of boundary faces (N,) by name


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Measures of faces or patches."""

    area: np.ndarray  # (N,)
    normal: np.ndarray  # (N, 3) mean, of length 1 where flat
    middle: np.ndarray  # (N, 3)
    outwards: np.ndarray  # (N,) mean of normal . (x - middle)


def boundary_sets(mesh: HexMesh) -> dict[str, np.ndarray]:
    """Numbers of the boundary quads of each name: ends, holes, then `patch_n` of every patch."""
    return sets_of_quads(mesh.vertices, mesh.quads, mesh.patch)


def sets_of_quads(
    points: np.ndarray, quads: np.ndarray, patch: np.ndarray
) -> dict[str, np.ndarray]:
    """The same of a closed surface: quads (Q, 4) into points (N, 3), and the patch of each (Q,)."""
    names = patch_names(points, quads, patch)
    names |= {f"patch_{number}": (number,) for number in np.unique(patch).tolist()}
    return {name: np.flatnonzero(np.isin(patch, own)) for name, own in names.items()}


def sets_of_spline(spline: Spline, mesh: HexMesh) -> dict[str, np.ndarray]:
    """Numbers of the sides (N,) of a spline that came from the quads of each set of its mesh."""
    owner, side = quad_sides(mesh)
    quad = np.full((len(mesh.hexes), 6), -1)
    quad[owner, side] = np.arange(len(owner))
    element, face = spline.sides.T
    from_quad = quad[spline.element_hex[element], face]
    return {name: np.flatnonzero(np.isin(from_quad, own)) for name, own in mesh.sets.items()}


def listed(sets: Sets) -> str:
    """The names in a sentence; numbered ones by their first and last."""
    said: list[str] = []
    numbered: dict[str, list[str]] = {}
    for name in sets:
        kind, _, number = name.rpartition("_")
        if kind in ("patch", "cad_face") and number.isdigit():
            numbered.setdefault(kind, []).append(name)
        else:
            said.append(name)
    said += [f"{n[0]} to {n[-1]}" if len(n) > 1 else n[0] for n in numbered.values()]
    return ", ".join(said)


def set_name(place: object) -> str:
    """The set that a place names: itself, or `patch_7` for the number 7."""
    text = str(place)
    return f"patch_{int(text)}" if text.isdigit() else text


def may_name(place: object) -> bool:
    """Whether some part could have a set of this name."""
    ends = "|".join(ENDS)
    return bool(re.fullmatch(rf"{ends}|hole_\d+|patch_\d+|cad_\w+", set_name(place)))


def patch_names(
    points: np.ndarray, quads: np.ndarray, patch: np.ndarray
) -> dict[str, tuple[int, ...]]:
    """The numbers of the patches of each name: six ends, then holes from low to high."""
    faces = _face_pieces(points[quads])
    numbers, patch = np.unique(patch, return_inverse=True)
    pieces = _joined(faces, patch, len(numbers))
    used = points[np.unique(quads)]
    size = float(np.linalg.norm(np.ptp(used, axis=0)))
    names = {}
    length = np.linalg.norm(pieces.normal, axis=1)
    for end, name in enumerate(ENDS):
        axis, sign = end // 2, 2 * (end % 2) - 1
        facing = sign * pieces.normal[:, axis] > FACING * length
        far = np.where(facing & (length > FLAT), sign * pieces.middle[:, axis], -np.inf)
        if np.isfinite(far).any():
            names[name] = tuple(numbers[far >= far.max() - LEVEL * size].tolist())
    ends = np.isin(numbers, np.concatenate([[], *names.values()]))
    for k, hole in enumerate(_holes(quads, faces, pieces, patch, ends, size), start=1):
        names[f"hole_{k}"] = tuple(numbers[hole].tolist())
    return names


def _face_pieces(corners: np.ndarray) -> _Pieces:
    """Measures of bilinear faces (Q, 4, 3), at 2 x 2 Gauss points of each."""
    u, v = np.array([(u, v) for v in GAUSS for u in GAUSS]).T
    shape = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v])  # (4, 4)
    across = np.stack([v - 1, 1 - v, v, -v])
    along = np.stack([u - 1, -u, u, 1 - u])
    normal = np.cross(
        np.einsum("kg,qkd->qgd", across, corners), np.einsum("kg,qkd->qgd", along, corners)
    ).reshape(-1, 3)
    length = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(length, np.finfo(float).tiny)[:, None]
    points = np.einsum("kg,qkd->qgd", shape, corners).reshape(-1, 3)
    piece = np.repeat(np.arange(len(corners)), 4)
    return _measured(length / 4, normal, points, np.zeros(len(piece)), piece)


def _joined(faces: _Pieces, patch: np.ndarray, count: int) -> _Pieces:
    return _measured(faces.area, faces.normal, faces.middle, faces.outwards, patch, count)


def _measured(
    area: np.ndarray,
    normal: np.ndarray,
    middle: np.ndarray,
    outwards: np.ndarray,
    piece: np.ndarray,
    count: int | None = None,
) -> _Pieces:
    """Measures of unions of parts; piece : (n,) union that each part goes to."""
    count = piece.max() + 1 if count is None else count
    add = coo_matrix((area, (piece, np.arange(len(piece)))), (count, len(piece))).tocsr()
    total = np.asarray(add.sum(axis=1)).ravel().clip(np.finfo(float).tiny)
    centre = add @ middle / total[:, None]
    away = ((middle - centre[piece]) * normal).sum(axis=1) + outwards
    return _Pieces(total, add @ normal / total[:, None], centre, add @ away / total)


def _holes(
    quads: np.ndarray,
    faces: _Pieces,
    pieces: _Pieces,
    patch: np.ndarray,
    ends: np.ndarray,
    size: float,
) -> list[np.ndarray]:
    """Sets of patches (indices into `pieces`), no ends, that are the walls of a hole or pocket."""
    n = len(pieces.area)
    a, b = _neighbours(quads)
    step = faces.middle[b] - faces.middle[a]
    inwards = ((faces.normal[a] - faces.normal[b]) * step).sum(axis=1)
    inwards /= np.linalg.norm(step, axis=1).clip(np.finfo(float).tiny)
    between = patch[a] != patch[b]
    pair = np.sort(patch[np.stack([a, b], axis=1)[between]], axis=1) @ [n, 1]
    pairs, which = np.unique(pair, return_inverse=True)
    mean = np.bincount(which, inwards[between]) / np.bincount(which).clip(1)
    first, second = np.divmod(pairs[mean > INNER], n)
    joined = np.stack([first, second])[:, ~(ends[first] | ends[second])]
    graph = coo_matrix((np.ones(joined.shape[1]), joined), (n, n))
    group = connected_components(graph, directed=False)[1]
    found = [np.flatnonzero(group == k) for k in range(group.max() + 1)]
    found = [walls for walls in found if _encloses(pieces, walls)]
    places = np.array([pieces.middle[walls].mean(axis=0) for walls in found]).reshape(-1, 3)
    order = np.lexsort(np.round(places / (LEVEL * size)).T[::-1])
    return [found[k] for k in order]


def _neighbours(quads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of boundary faces that share an edge; faces beside refined ones may have none."""
    edges = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], -1).reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)
    edges, face = edges[order], order // 4
    same = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1))
    return face[same], face[same + 1]


def _encloses(pieces: _Pieces, walls: np.ndarray) -> bool:
    """Whether the patches face each other in two directions, or one of them curves inwards."""
    length = np.linalg.norm(pieces.normal[walls], axis=1)
    if len(walls) == 1:
        return bool(length[0] < FLAT and pieces.outwards[walls[0]] < 0)
    normal = pieces.normal[walls] / length.clip(1e-12)[:, None]
    middle = pieces.middle[walls]
    step = middle[None] - middle[:, None]
    facing = (normal @ normal.T < -OPPOSITE) & (np.einsum("ai,abi->ab", normal, step) > 0)
    ways = normal[np.nonzero(facing & facing.T)[0]]
    return len(ways) > 0 and bool(np.abs(ways @ ways.T).min() < 0.5)
