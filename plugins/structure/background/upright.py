"""Chamfers, fillets, drafts and countersinks set upright or flat, so that a part is a stack.

A face that leans has two borders at constant heights. If only one of them is at a wall, the face
becomes a wall over it. If both are, or if the face is shallow, it becomes a plane at the height of
one of them. The convex rounding of an edge between a wall and a cap becomes square, and so do the
round end of a lug between two caps, the back of a rib, holes and bosses across the axis. Faces that
slope but have other borders become flat.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple, NoReturn

import numpy as np

from polycube.hexmesh.background.background import NoBackgroundError
from polycube.surface import measures
from polycube.types import TriMesh

from .blends import blend, squared_blends, upright_roundings
from .leaning import between, leaning, over, set_upright
from .ribs import levelled, squared_rib
from .rings import Pairs, holes_across
from .squared import round_end, square, squared_off

if TYPE_CHECKING:
    from polycube.hexmesh.background.curves import Sizes

CAP = 1 - 5e-4  # smallest mean cosine between the normals of a cap and the axis
WALL = 0.03  # largest mean cosine of a wall
STEEP = 0.5  # smallest cosine between the normals of a sloping face and the axis
FEW = 1e-3  # largest share of the area of a sloping face that may be steeper
PLANES = 0.8  # share of the area in planes from which a part with drilled holes is a block
ARCH = 1.05  # largest height of a face between two walls, relative to that between its borders


class Upright(NamedTuple):
    """A surface whose leaning faces are set upright along an axis, or flat across it."""

    surface: TriMesh  # with the changed vertices
    axis: np.ndarray  # (3,) unit vector
    is_cap: np.ndarray  # (F,) whether a triangle is in a plane across the axis
    is_changed: np.ndarray  # (F,) whether it is in a face that leaned
    is_over: np.ndarray  # (F,) whether it is in a wall over one of its borders
    levels: list[np.ndarray]  # (N,) heights that divide each fillet and the sides of each hole
    # (N, 3) places in the section, and the lengths of edges there, for the other sides
    fine: np.ndarray
    # (N, 2) the faces in the wall and in the plane of each rounding at whose half turn two hexes
    # are to meet
    split: np.ndarray
    places: np.ndarray  # (V, 3) places from which hexes at the vertices are moved back


def upright(
    surface: TriMesh,
    pairs: Pairs,
    axis: np.ndarray,
    near: float,
    sizes: Sizes,
    may_slope: bool = True,
) -> Upright:
    """Set the leaning faces of a surface upright or flat, and make holes and bosses square.

    Raises NoBackgroundError if a leaning face has no border at a constant height, if a plane is
    oblique, if holes across the axis meet at their sides, or for a block with drilled holes there.

    pairs : of half-edges on a common edge, as `twins` finds them
    near : distance below which heights are equal
    sizes : wanted sizes, for the number of edges round holes
    may_slope : whether faces with other borders may become flat
    """
    rows = measures.frame(axis)
    at = surface.vertices @ rows.T
    before = at.copy()
    is_wall, is_cap, total = _walls_and_caps(surface, axis)
    is_changed = ~(is_wall | is_cap)[surface.region]
    leans = np.unique(surface.region[is_changed]).tolist()
    region, levels, fine = surface.region.copy(), [], [np.zeros((0, 3))]
    holes = holes_across(surface, at, pairs, leans)
    has_bottom = any(each.is_bottom for hole in holes for each in hole.collars)
    if has_bottom and total[~measures.curved_faces(surface)].sum() > PLANES * total.sum():
        raise NoBackgroundError("polycubes of a block with drilled holes have fewer hexes")
    for hole in holes:
        pieces = np.column_stack([region[hole.faces], square(surface, at, hole)])
        kinds, piece = np.unique(pieces, axis=0, return_inverse=True)
        region[hole.faces] = len(is_wall) + piece.ravel()
        is_changed[hole.faces] = True
        for collar in hole.collars:
            is_wall[region[collar.faces]] = is_changed[collar.faces] = True
        is_wall = np.append(is_wall, kinds[:, 1] % 2 == 0)
        is_cap = np.append(is_cap, kinds[:, 1] % 2 == 1)
        levels.append(hole.levels(surface, at, before, sizes))
        fine.append(hole.fine(at, surface.faces, sizes))
    surface = replace(surface, region=region)
    leans = np.setdiff1d(np.intersect1d(leans, region), np.flatnonzero(is_wall)).tolist()
    one, two = pairs
    across = np.empty(surface.faces.size, np.int64)  # the triangle on the other side of each edge
    across[one], across[two] = two // 3, one // 3
    beyond = region[across]
    given = [n for n in leans if leaning(surface, at, beyond, n, near) is None]
    if may_slope:
        rest = (surface, at, beyond, is_wall, is_cap, near, sizes.size)
        given = [n for n in given if not levelled(n, *rest)]
    flat = _set_flat(surface, at, beyond, given, is_cap) if may_slope else []
    is_cap[flat] = True
    waiting, blends = {}, []
    for number in set(leans) - set(flat):
        face, patch = leaning(surface, at, beyond, number, near), None
        borders = face.borders if face else ()
        if face is None or any(len(b.vertices) == 2 and is_wall[b.beyond].all() for b in borders):
            patch = blend(surface, at, across, number, np.flatnonzero(is_wall), near)
        if patch is not None:
            blends.append(patch)
        elif face is not None:
            waiting[number] = face
        else:
            _refuse(surface, number)
    blends += upright_roundings(surface, at, across, blends, waiting, is_wall, near)
    at_blend = np.unique([v for one in blends for end in one.ends for v in end])
    last = {n for one in blends for n in one.beside}
    # a concave rounding has better hexes as a whole, but such a corner meets halves only
    has_tip = any(len(b.vertices) == 1 for face in waiting.values() for b in face.borders)
    split: list[tuple[int, int]] = []
    shift = np.zeros_like(at)
    while waiting:
        # those at the ends of blends last, those at walls first, and the largest of them
        at_wall = {n: any(is_wall[b.beyond].all() for b in waiting[n].borders) for n in waiting}
        number = max(waiting, key=lambda n: (n not in last, at_wall[n], total[n]))
        face = waiting.pop(number)
        ends = [border.ends(is_wall, is_cap) for border in face.borders]
        high = [before[border.vertices, 2].mean() for border in face.borders]
        at_walls, at_caps = (len(ends) == 2 and all(each) for each in zip(*ends, strict=True))
        is_arch = at_walls and np.ptp(before[face.faces, 2]) > ARCH * (max(high) - min(high))
        found = None
        if is_arch or at_caps:
            found = round_end(at, before, face, sizes, is_arch)
            leans = leans if found is None else [n for n in leans if n != number]
        elif at_walls or sorted(ends) == [(False, True), (True, False)]:
            for base in (0, 1) if at_walls else (ends.index((True, False)),):
                signs = at_walls or has_tip
                found = found or squared_off(at, before, face, base, sizes, signs, at_blend)
        if found is None and may_slope:
            found = squared_rib(at, before, face, sizes)
        if found is not None:
            region[np.flatnonzero(region == number)[found.in_cap]] = len(is_wall)
            split += [(number, len(is_wall))] * found.is_split
            is_wall, is_cap = np.append(is_wall, False), np.append(is_cap, True)
            is_wall[number] = True
            levels.append(found.levels)
            fine.append(found.fine)
            shift[np.unique(face.faces)] = found.shift
            continue
        if is_arch or min(len(border.vertices) for border in face.borders) == 1:
            _refuse(surface, number)
        is_straight = any(number == one.other for one in blends)
        is_wall[number] = set_upright(at, before, face, is_wall, is_cap, is_straight)
        is_cap[number] = not is_wall[number]
        if is_wall[number]:
            used = np.unique(face.faces)
            foot, top = (over(before, before, face, k)[used] for k in (0, 1))
            levels.append(between(at[used, 2], foot, top, before[used, :2], sizes)[0])
    if blends:
        is_changed |= np.isin(region, [one.number for one in blends])
        part = replace(surface, region=region)
        squared = squared_blends(part, at, before, blends, leans, sizes)
        if squared is None:
            _refuse(surface, blends[0].number)
        region = squared[0]
        fine.append(squared[1])
    on_cap = is_cap[region]
    is_oblique = on_cap & (np.ptp(at[surface.faces, 2], axis=1) > 10 * near)
    if is_oblique.any():
        where = measures.place(surface, surface.vertices[surface.faces[np.argmax(is_oblique), 0]])
        raise NoBackgroundError(f"a plane is not perpendicular to an axis near {where}")
    part = replace(surface, vertices=at @ rows, region=region)
    is_over = np.isin(region, leans) & ~on_cap
    split_off = np.array(split, np.int64).reshape(-1, 2)
    places = (at + shift) @ rows
    fine_at = np.concatenate(fine)
    return Upright(part, axis, on_cap, is_changed, is_over, levels, fine_at, split_off, places)


def leaning_share(surface: TriMesh, axis: np.ndarray) -> float:
    """Share of the area in CAD faces that are neither along an axis nor perpendicular to it."""
    is_wall, is_cap, total = _walls_and_caps(surface, axis)
    return float(total[~(is_wall | is_cap)].sum() / total.sum())


def _walls_and_caps(
    surface: TriMesh, axis: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(R,) which CAD faces are along an axis, which are perpendicular to it, and their areas."""
    area = measures.face_areas(surface)
    total = np.maximum(np.bincount(surface.region, area), 1e-300)
    lean = np.bincount(surface.region, area * abs(measures.face_normals(surface) @ axis)) / total
    return lean < WALL, lean > CAP, total


def _set_flat(
    surface: TriMesh, at: np.ndarray, beyond: np.ndarray, numbers: list[int], is_cap: np.ndarray
) -> list[int]:
    """Set the sloping faces among given ones flat, in place; their numbers.

    A face is sloping if its slope is below 60 degrees everywhere. Sloping faces that meet become
    one plane: at the height of a cap on the same side that they meet, or else at their mean height.

    is_cap : (R,) whether each face is perpendicular to the axis
    """
    vectors = measures.triangle_vectors(at[surface.faces])
    area, up = np.linalg.norm(vectors, axis=1), vectors[:, 2]
    sign = np.sign(np.bincount(surface.region, up, len(is_cap))).astype(np.int64)
    is_steep = sign[surface.region] * up < STEEP * area
    steep = np.bincount(surface.region, area * is_steep, len(is_cap))
    total = np.bincount(surface.region, area, len(is_cap))
    is_sloping = np.isin(np.arange(len(is_cap)), numbers) & (steep < FEW * total)
    own, ends = np.repeat(surface.region, 3), measures.half_edges(surface.faces)
    is_same = sign[own] == sign[beyond]
    joins = is_same & is_sloping[own] & is_sloping[beyond]
    group = measures.connected(own[joins], beyond[joins], len(is_cap))
    for one in np.unique(group[is_sloping]):
        faces = group[surface.region] == one
        fixed = at[ends[is_same & (group[own] == one) & is_cap[beyond]], 2]
        mean = np.average(at[surface.faces[faces], 2].mean(axis=1), weights=area[faces])
        at[surface.faces[faces], 2] = fixed.mean() if len(fixed) else mean
    return np.flatnonzero(is_sloping).tolist()


def _refuse(surface: TriMesh, number: int) -> NoReturn:
    own = surface.region == number
    where = measures.place(surface, surface.vertices[surface.faces[own]].mean(axis=(0, 1)))
    what = f"a face leans, and has no two borders at constant heights, near {where}"
    raise NoBackgroundError(what)
