"""Vertex blends made square: faces at a wall in which the roundings of several edges meet.

Where a rounded edge of a wall turns from a cap into a concave rounding, and on into an upright
edge, its rounding turns as well, in a face whose borders have no constant height. One half of such
a face comes into the wall, and the other half continues the face opposite up to the wall. The
upright roundings next to it become square as well.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from polycube.numerics.harmonic import harmonic
from polycube.surface.arc_length import lengths
from polycube.surface.curves.creases import chains_of, vertices_of
from polycube.surface.measures import edges, half_edges, triangle_vectors, unit
from polycube.types import TriMesh

from .leaning import Leaning, divided
from .squared import STRAIGHT

if TYPE_CHECKING:
    from polycube.hexmesh.background.curves import Sizes

TANGENT = 0.7  # smallest mean cosine between the normals of a blend and of its wall
ACROSS = 0.5  # smallest sine of the angle in the section between a wall and the face opposite


class Blend(NamedTuple):
    """A face between a wall and an opposite face, and the vertices of its borders."""

    number: int
    faces: np.ndarray  # (F,) its triangles
    wall: int  # the face to which it is tangent
    other: int  # the face opposite
    beside: tuple[int, ...]  # the faces at its ends; one if it ends in a tip
    at_wall: np.ndarray  # (N,) vertices from the first end to the last
    at_other: np.ndarray  # (M,) in the same direction
    across: tuple[np.ndarray, np.ndarray]  # (N - 1,), (M - 1,) triangles beyond both borders
    ends: tuple[np.ndarray, ...]  # (L,) vertices from the wall to the face opposite


def blend(
    surface: TriMesh,
    at: np.ndarray,
    across: np.ndarray,
    number: int,
    walls: np.ndarray,
    near: float,
) -> Blend | None:
    """The borders of a face that is tangent to one of some walls; None if it is no blend.

    at : (V, 3) vertices in the frame
    across : (3 F,) the triangle on the other side of each edge
    near : distance below which heights are equal
    """
    own = np.flatnonzero(surface.region == number)
    ends, there = half_edges(surface.faces[own]), across.reshape(-1, 3)[own].ravel()
    other = surface.region[there]
    normals = (unit(triangle_vectors(at[surface.faces[f]])) for f in (np.repeat(own, 3), there))
    cosine = np.einsum("nd,nd->n", *normals)
    found: list[tuple[int, np.ndarray, np.ndarray]] = []
    at_wall = []
    for n in np.setdiff1d(other, [number]).tolist():
        edge = np.flatnonzero(other == n)
        for chain in chains_of(ends[edge]):
            curve = vertices_of(ends[edge], chain)
            if n in walls and cosine[edge].mean() > TANGENT and np.ptp(at[curve, 2]) > 10 * near:
                at_wall.append(len(found))
            found.append((n, curve, there[edge[np.array(chain) // 2]]))
    if len(at_wall) != 1 or len(found) not in (3, 4):
        return None
    wall, line, inner = found.pop(at_wall[0])
    meets = np.unique(surface.region[across.reshape(-1, 3)[surface.region == wall]])
    beside: list[tuple[int, np.ndarray]] = []
    opposite = []
    for n, curve, triangles in found:
        place = np.flatnonzero(np.isin(line[[0, -1]], curve[[0, -1]]))
        if len(place) == 1 and (len(found) == 3 or n in meets):
            beside.insert(place[0], (n, curve if curve[0] == line[-place[0]] else curve[::-1]))
        else:
            opposite.append((n, curve, triangles))
    if len(opposite) != 1:
        return None
    there_face, curve, triangles = opposite[0]
    names, sides = zip(*beside, strict=True)
    if curve[0] != (sides[0][-1] if line[0] in sides[0] else line[0]):
        curve, triangles = curve[::-1], triangles[::-1]
    return Blend(number, own, wall, there_face, names, line, curve, (inner, triangles), sides)


def upright_roundings(
    surface: TriMesh,
    at: np.ndarray,
    across: np.ndarray,
    blends: list[Blend],
    faces: dict[int, Leaning],
    is_wall: np.ndarray,
    near: float,
) -> list[Blend]:
    """The upright roundings at the ends of blends, and at inner corners of rounded edges.

    faces : leaning faces by their numbers
    """
    pairs = {(n, one.wall) for one in blends for n in one.beside if is_wall[n]}
    for number, face in faces.items():
        own = np.flatnonzero(surface.region == number)
        ends, there = half_edges(surface.faces[own]), across.reshape(-1, 3)[own].ravel()
        for border, side in product(face.borders, face.sides if len(face.sides) == 2 else ()):
            walls = np.unique(border.beyond)
            beyond = np.unique(surface.region[there[np.isin(ends, side).all(axis=1)]])
            beyond = beyond[beyond != number]
            if len(walls) == len(beyond) == 1 and is_wall[[walls[0], beyond[0]]].all():
                end, far = at[side[[0, -1] if side[0] in border.vertices else [-1, 0]], :2]
                if (far - end) @ (end - at[border.vertices, :2].mean(axis=0)) < 0:
                    pairs.add((int(beyond[0]), int(walls[0])))
    found = (blend(surface, at, across, n, np.array([wall]), near) for n, wall in sorted(pairs))
    return [one for one in found if one is not None]


def _ridge(surface: TriMesh, at: np.ndarray, before: np.ndarray, one: Blend) -> np.ndarray | None:
    """(M, 3) where lines across a wall, from the border of a blend opposite, meet the wall.

    None if the wall is not plane, or if the face opposite does not go across it.
    """
    walls, others = (surface.faces[triangles] for triangles in one.across)
    out = unit(triangle_vectors(before[walls])[:, :2].sum(axis=0))
    lies = triangle_vectors(at[others])[:, :2]
    along = np.linalg.eigh(lies.T @ lies)[1][:, 0]
    off = (before[one.at_wall[0], :2] - before[one.at_other, :2]) @ out
    uneven = np.ptp(before[one.at_wall, :2] @ out)
    if abs(along @ out) < ACROSS or uneven > STRAIGHT * abs(off).max():
        return None
    off = (at[one.at_wall[0], :2] - at[one.at_other, :2]) @ out
    place = at[one.at_other].copy()
    place[:, :2] += np.multiply.outer(off / (along @ out), along)
    return place


def squared_blends(
    surface: TriMesh,
    at: np.ndarray,
    before: np.ndarray,
    blends: list[Blend],
    leans: list[int],
    sizes: Sizes,
) -> tuple[np.ndarray, np.ndarray] | None:
    """Make blends square in place.

    Returns (F,) the face of each triangle afterwards, and (P, 3) places in the section at the edges
    of upright roundings, with the lengths of edges there; None if one cannot be set so.

    at, before : (V, 3) vertices in the frame, now and before any face was set
    leans : faces that leaned
    """
    done = set(leans) - {one.number for one in blends}
    share, lines, turns = np.full(len(at), np.nan), [], []
    for one in blends:
        if (line := _ridge(surface, at, before, one)) is None:
            return None
        lines.append(line)
        turns.append(_coordinates(surface, at, before, one, line, done, share))
    every = np.concatenate([one.faces for one in blends])
    upper = np.isin(np.arange(len(surface.faces)), every[divided(share, surface.faces[every], 0.5)])
    now, region, fine = at.copy(), surface.region.copy(), [np.zeros((0, 3))]
    for one, line, turn in zip(blends, lines, turns, strict=True):
        region[one.faces], outer = one.wall, one.faces[upper[one.faces]]
        knots, kind = _parts(before[one.at_other]), surface.region[one.across[1]]
        region[outer] = kind[0]
        for change in np.flatnonzero(kind[1:] != kind[:-1]) + 1:
            region[outer[divided(turn, surface.faces[outer], knots[change])]] = kind[change]
        for n in set(one.beside) & done:
            region[region == n] = one.wall
        used = np.unique(surface.faces[one.faces])
        curves = (_parts(before[one.at_wall]), at[one.at_wall]), (knots, line)
        first, middle, last = (
            np.stack([np.interp(turn[used], parts, d) for d in places.T], axis=1)
            for parts, places in (*curves, (knots, at[one.at_other]))
        )
        part = 2 * share[used, None]
        now[used] = first + np.minimum(part, 1) * (middle - first)
        now[used] += np.maximum(part - 1, 0) * (last - middle)
        if one.number not in leans:
            width = np.linalg.norm(line - at[one.at_other], axis=1).mean()
            rows = max(1, round(sizes.in_quarter(width) / 2))
            fine.append(np.column_stack([line[:, :2], np.full(len(line), width / rows)]))
    at[:] = now
    return region, np.concatenate(fine)


def _coordinates(
    surface: TriMesh,
    at: np.ndarray,
    before: np.ndarray,
    one: Blend,
    line: np.ndarray,
    done: set[int],
    share: np.ndarray,
) -> np.ndarray:
    """(V,) parts of the way from the first end of a blend to the last one, harmonic inside.

    line : (M, 3) the ridge, where the halves of the blend will meet
    done : faces that are square, whose halves meet at the ridge already
    share : (V,) parts of the way from the wall to the face opposite; changed in place
    """
    turn = np.full(len(at), np.nan)
    for border, value in ((one.at_wall, 0), (one.at_other, 1)):
        share[border], turn[border] = value, _parts(before[border])
    if len(one.ends) == 1:  # towards the tip, the border at the wall becomes a sharp edge
        inner, is_last = one.at_wall[1:-1], one.ends[0][0] == one.at_wall[-1]
        share[inner] = 0.5 * abs(turn[inner] - is_last)
    for curve, n in zip(one.ends, one.beside, strict=True):
        place = -int(curve[0] == one.at_wall[-1])
        turn[curve] = -place
        share[curve] = _on_corner(at[curve], line[place]) if n in done else _parts(before[curve])
    used, faces = np.unique(surface.faces[one.faces], return_inverse=True)
    given = np.isin(used, np.concatenate([one.at_wall, one.at_other, *one.ends]))
    values, sides = np.stack([share, turn], axis=1)[used], edges(faces.reshape(-1, 3))[0]
    share[used], turn[used] = harmonic(before[used], sides, np.flatnonzero(~given), values).T
    return turn


def _parts(curve: np.ndarray) -> np.ndarray:
    """(N,) length of a curve (N, 3) up to each of its points, relative to its length."""
    arc = lengths(curve)
    return arc / arc[-1]


def _on_corner(points: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """(N,) parts of the way from the first point to the last one; at the corner they are a half."""
    ends = points[0], points[-1], corner
    first, last, off = (np.linalg.norm(points - end, axis=1) for end in ends)
    is_first = first + off - off[0] < last + off - off[-1]
    return 0.5 + 0.5 * np.where(is_first, -off / max(off[0], 1e-300), off / max(off[-1], 1e-300))
