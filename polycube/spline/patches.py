"""Boundary faces by what users call them: a patch's number or name, a box, a plane.

Names come from the geometry, so that a hex mesh of another program has them too.  `x_min` is the
patch, or all patches equally far, farthest out among those that face -x; `hole_1` is a set of
patches that meet at inner angles and face each other in two directions, such as the four walls of a
hole.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from polycube.errors import InputError
from polycube.geometry.cubic import FACES
from polycube.spline.trace import trace
from polycube.types import Spline

ENDS = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")
FACING = 0.6  # cosine between a patch's mean normal and the axis it faces along, at least
FLAT = 0.3  # length of a patch's mean normal, at least, to face some way at all
OPPOSITE = 0.7  # minus the cosine between normals of patches that face each other, at least
INNER = 0.02  # sine of the angle at which two patches turn inwards, at least, on average
LEVEL = 1e-3  # of the diagonal: patches that lie equally far out, faces that lie in a plane
CORNERS = [0, 3, 15, 12]  # of the 16 nodes of a face, in a circle


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Measures of faces or patches."""

    area: np.ndarray  # (N,)
    normal: np.ndarray  # (N, 3) mean, of length 1 where flat
    middle: np.ndarray  # (N, 3)
    outwards: np.ndarray  # (N,) mean of normal . (x - middle)


def faces_of(spline: Spline, where: object) -> np.ndarray:
    """(F,) numbers into `spline.sides` of the faces that `where` names.

    where : patch number, name, {"box": [x, y, z, x, y, z]} for the faces with all corners in it,
        or {"plane": [a, b, c, d]} for those with all corners on a x + b y + c z = d
    Raises InputError naming the patches there are.
    """
    if isinstance(where, Mapping):
        return _within(spline, where)
    names = patch_names(spline)
    text = str(where)
    numbers = names.get(text, (int(text),) if text.isdigit() else ())
    found = np.flatnonzero(np.isin(spline.patch, numbers))
    if len(found) == 0:
        known = [f"{name} ({' '.join(map(str, own))})" for name, own in names.items()]
        numbers = np.unique(spline.patch)
        known += [
            f"number {numbers[0]}"
            if len(numbers) == 1
            else f"{len(numbers)} numbers from {numbers[0]} to {numbers[-1]}"
        ]
        raise InputError(
            f"no boundary patch {where!r}; there are {', '.join(known)}; {{box: ...}} and "
            "{plane: ...} choose faces by their place"
        )
    return found


def check_place(where: object) -> None:
    """Raise ValueError unless `where` is written as `faces_of` reads it."""
    lengths = {"box": 6, "plane": 4}
    if isinstance(where, Mapping):
        good = len(where) == 1 and all(
            lengths.get(key) == len(np.atleast_1d(value)) for key, value in where.items()
        )
    else:
        good = isinstance(where, int | str) and not isinstance(where, bool)
    if not good:
        raise ValueError(
            "boundary faces are a patch number, a name such as x_min, {box: [x, y, z, x, y, z]} "
            f"or {{plane: [a, b, c, d]}}; got {where!r}"
        )


def place_name(where: object) -> str:
    """The place in one word, for tables."""
    if not isinstance(where, Mapping):
        return str(where)
    [(kind, numbers)] = where.items()
    return f"{kind} {' '.join(f'{number:g}' for number in numbers)}"


def patch_names(spline: Spline) -> dict[str, tuple[int, ...]]:
    """The numbers of the patches of each name: six ends, then holes from low to high."""
    faces = _face_pieces(spline)
    numbers, patch = np.unique(spline.patch, return_inverse=True)
    pieces = _joined(faces, patch, len(numbers))
    size = np.linalg.norm(np.ptp(spline.control, axis=0))
    names = {}
    length = np.linalg.norm(pieces.normal, axis=1)
    for end, name in enumerate(ENDS):
        axis, sign = end // 2, 2 * (end % 2) - 1
        facing = sign * pieces.normal[:, axis] > FACING * length
        far = np.where(facing & (length > FLAT), sign * pieces.middle[:, axis], -np.inf)
        if np.isfinite(far).any():
            names[name] = tuple(numbers[far >= far.max() - LEVEL * size].tolist())
    ends = np.isin(numbers, np.concatenate([[], *names.values()]))
    for k, hole in enumerate(_holes(spline, faces, pieces, patch, ends), start=1):
        names[f"hole_{k}"] = tuple(numbers[hole].tolist())
    return names


def _within(spline: Spline, where: Mapping[str, object]) -> np.ndarray:
    [(kind, numbers)] = where.items()
    numbers = np.asarray(numbers, dtype=np.float64)
    element, side = spline.sides.T
    corners = spline.nodes[element[:, None], FACES[side][:, CORNERS]]
    corners = (spline.extraction @ spline.control)[corners]
    slack = LEVEL * np.linalg.norm(np.ptp(spline.control, axis=0))
    if kind == "plane":
        off = np.abs(corners @ numbers[:3] - numbers[3]) / np.linalg.norm(numbers[:3])
        inside = off <= slack
    else:
        inside = ((corners >= numbers[:3] - slack) & (corners <= numbers[3:] + slack)).all(axis=2)
    found = np.flatnonzero(inside.all(axis=1))
    if len(found) == 0:
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        raise InputError(
            f"no boundary face lies in {place_name(where)}; the part fills "
            f"{' '.join(f'{x:.4g}' for x in low)} to {' '.join(f'{x:.4g}' for x in high)}"
        )
    return found


def _face_pieces(spline: Spline) -> _Pieces:
    here = trace(spline, np.arange(len(spline.sides)), 2)
    piece = np.repeat(np.arange(len(spline.sides)), 4)
    return _measured(here.area, here.normals, here.points, np.zeros(len(piece)), piece)


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
    spline: Spline, faces: _Pieces, pieces: _Pieces, patch: np.ndarray, ends: np.ndarray
) -> list[np.ndarray]:
    """Sets of patches (indices into `pieces`), no ends, that are the walls of a hole or pocket."""
    n = len(pieces.area)
    a, b = _neighbours(spline)
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
    size = np.linalg.norm(np.ptp(spline.control, axis=0))
    order = np.lexsort(np.round(places / (LEVEL * size)).T[::-1])
    return [found[k] for k in order]


def _neighbours(spline: Spline) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of boundary faces that share an edge."""
    element, side = spline.sides.T
    corners = spline.nodes[element[:, None], FACES[side][:, CORNERS]]
    edges = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], -1).reshape(-1, 2), axis=1)
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
