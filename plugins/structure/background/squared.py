"""Round faces made square: holes, bosses, rounded edges and ends.

Four hexes meet the rim of a round hole at each corner of the square: there the hole is smooth, and
each hex has an angle of 60 degrees. At the corners of a boss, of a rounded edge and of an end, one
hex has an angle of 180 degrees less that of an edge round it.
"""

from typing import NamedTuple

import numpy as np

from polycube.hexmesh.background.arrangement import sagitta
from polycube.hexmesh.background.background import NoBackgroundError
from polycube.hexmesh.background.curves import CHORD_SHARE, Sizes
from polycube.surface.arc_length import lengths
from polycube.surface.measures import place, triangle_vectors, unit
from polycube.types import TriMesh

from .holes import Hole, flatten
from .leaning import Leaning, between, divided, over

TANGENT = 0.55  # largest mean cosine between the axis and the normals of a rounding at a wall
STRAIGHT = 0.02  # sine: tolerance for the direction and the borders of a round end
BLUNT = np.pi / 4  # width of the square with the area of a half disc, by its radius


def square(surface: TriMesh, at: np.ndarray, hole: Hole) -> np.ndarray:
    """Make a hole square in place.

    Its level sides are wider if windows are. Vertices between two sides are moved to the edge
    between them, and the vertices of rims along the upright walls that the hole meets.

    Returns (N,) the side of each triangle of the hole: 0 and 2 upright, 1 the upper and 3 the lower
    one. Raises NoBackgroundError if a window is as wide as the hole.

    at : (V, 3) vertices in the frame
    """
    used, local = np.unique(surface.faces[hole.faces], return_inverse=True)
    local = local.reshape(-1, 3)
    before = hole.flat(at[used])
    x, y = ((before - hole.middle) / hole.extent).T
    edge = np.arccos(np.clip(hole.wide, np.sqrt(0.5), 1))
    # the same angle in the first quadrant, where the edge between two sides comes to 45 degrees
    turn = np.interp(np.arctan2(abs(y), abs(x)), [0, edge, np.pi / 2], [0, np.pi / 4, np.pi / 2])
    angle = np.arctan2(np.sign(y) * np.sin(turn), np.sign(x) * np.cos(turn))
    share = (angle / (np.pi / 2) + 0.5) % 4  # number of sides up to a vertex
    unit = np.exp(np.pi / 2 * 1j * share)
    side = np.floor(np.angle(unit[local].sum(axis=1)) / (np.pi / 2) % 4).astype(np.int64) % 4
    on_side = np.zeros((len(used), 4), bool)
    on_side[local.ravel(), np.repeat(side, 3)] = True
    first = np.where(on_side[:, 0] & on_side[:, 3], 3, on_side.argmax(axis=1))
    beyond = np.clip((share - first + 2) % 4 - 2, 0, 1)
    share = first + np.where(on_side.sum(axis=1) > 1, 1, beyond)
    flat, along = hole.on_sides(share), at[used] @ hole.along
    held = np.searchsorted(used, hole.corners)
    flat[held, 0] = before[held, 0]
    for rim in (np.searchsorted(used, loop) for loop in hole.rims):
        known = rim[np.argsort(before[rim, 0], kind="stable")]
        along[rim] = np.interp(flat[rim, 0], before[known, 0], along[known])
    for window in (np.searchsorted(used, loop) for loop in hole.windows):
        if hole.wide >= 1 or on_side[window][:, ::2].any():
            where = place(surface, surface.vertices[used[window[0]]])
            raise NoBackgroundError(f"holes meet at their sides near {where}")
        flat[window, 0] = before[window, 0]
    for collar in hole.collars:
        along[np.isin(used, surface.faces[collar.faces])] = flatten(surface, at, hole, collar)
    at[used] = np.column_stack([flat[:, :1] * hole.across[:2], flat[:, 1]])
    at[used] += np.multiply.outer(along, hole.along)
    return side


class SquaredOff(NamedTuple):
    """A rounding made square."""

    in_cap: np.ndarray  # (N,) whether each of its triangles is in a cap; the others are in a wall
    levels: np.ndarray  # (L,) heights that divide its walls
    fine: np.ndarray  # (P, 3) places at its ends in its caps, and the length of edges there
    is_split: bool  # whether two hexes are to meet at half its turn, too
    shift: np.ndarray  # (N, 3) of its vertices before hexes are moved back: no chord is too long


def squared_off(
    at: np.ndarray,
    before: np.ndarray,
    face: Leaning,
    base: int,
    sizes: Sizes,
    any_sign: bool,
    blends: np.ndarray,
    rows: int | None = None,
) -> SquaredOff | None:
    """Make the rounding of an edge between a wall and a cap square, in place, or the back of a rib.

    Then four hexes meet at each of its borders, where the part is smooth.

    Returns None, without changes, if the face is not such a rounding.

    at, before : (V, 3) vertices in the frame, now and before any face was set
    base : number of its border at the wall
    sizes : wanted length of edges, and their largest distance from the rounding
    any_sign : whether the rounding may be concave
    blends : (B,) vertices of vertex blends, at which the edge between both halves comes over the
        end of the border at the cap
    rows : number of hexes along each half of the back of a rib if it is plane; None for a rounding
    """
    foot, top = face.borders[base].vertices, face.borders[1 - base].vertices
    at_blends = [side for side in face.sides if np.isin(side, blends).all()]
    vectors = triangle_vectors(before[face.faces])
    steep = abs(unit(vectors)[:, 2])
    at_foot, at_top = (np.isin(face.faces, e).sum(axis=1) > min(1, len(e) - 1) for e in (foot, top))
    is_tangent = steep[at_foot].mean() < TANGENT and steep[at_top].mean() > np.sqrt(1 - TANGENT**2)
    if rows is None and not is_tangent:
        return None
    used, faces = np.unique(face.faces, return_inverse=True)
    faces = faces.reshape(-1, 3)
    outer, inner = (over(before, before, face, end)[used] for end in (base, 1 - base))
    out = outer - before[used, :2]
    is_convex = bool((vectors[:, :2] * out[faces].mean(axis=1)).sum() > 0)
    if not (is_convex or any_sign):
        return None
    low, high = before[foot, 2].mean(), before[top, 2].mean()
    rise = (before[used, 2] - low) / (high - low)
    run = 1 - np.linalg.norm(out, axis=1) / np.linalg.norm(outer - inner, axis=1)
    share = np.arctan2(rise, run) / (np.pi / 2)  # of the turn from the wall
    share[np.searchsorted(used, foot)], share[np.searchsorted(used, top)] = 0, 1
    upper = divided(share, faces, 0.5)
    levels, least = between(before[used, 2], outer, inner, before[used, :2], sizes)
    outer, inner = (over(at, before, face, end)[used] for end in (base, 1 - base))
    low, high, width = at[foot, 2].mean(), at[top, 2].mean(), np.linalg.norm(outer - inner, axis=1)
    parts = max((len(levels) + 2) // 2, 1 if rows is None else 2 if len(levels) else rows)
    is_split = is_convex and parts > 1 and not len(at_blends)  # its column is collapsed
    parts += is_split
    rows = parts + is_split + (parts + is_split) % 2
    middle, in_wall, in_plane = outer.copy(), np.clip(2 * share, 0, 1), np.clip(2 * share - 1, 0, 1)
    for side in at_blends:
        first, last = foot[[0, -1] if foot[-1] in side else [-1, 0]]
        step = at[last, :2] - at[first, :2]
        beyond = (at[np.intersect1d(side, top)[0], :2] - at[last, :2]) @ step / (step @ step)
        part = (outer - at[first, :2]) @ step / (step @ step)
        middle += beyond * np.multiply.outer(part, step)
    shares = [(in_wall, in_plane)]  # and those from which hexes are moved back
    if is_split and max(abs(high - low) / parts, width.mean() / rows) < sizes.size:
        # the two rows beside the edge at half the turn become one chord
        most = 2 * np.sqrt(CHORD_SHARE) / max(least, 1.0)
        one, two = (min(2 / n, max(1 / (n - 1), most)) for n in (parts, rows))
        in_wall = np.interp(in_wall, [0, 1 - one, 1], [0, 1 - 2 / parts, 1])
        shares.append((in_wall, np.interp(in_plane, [0, two, 1], [0, 2 / rows, 1])))
    places = [np.column_stack([outer, low + wall * (high - low)]) for wall, _ in shares]
    for own, (wall, plane) in zip(places, shares, strict=True):
        own[:, :2] += wall[:, None] * (middle - outer) + plane[:, None] * (inner - middle)
        for side in face.sides:  # on an upright rounding it is bent
            path, at_side = before[side, :2], np.searchsorted(used, side)
            path = path if side[0] in foot else path[::-1]
            part = lengths(path)
            if sagitta(path) > STRAIGHT * part[-1] and not len(at_blends):
                bent = [np.interp(plane[at_side] * part[-1], part, path[:, d]) for d in (0, 1)]
                own[at_side, :2] = np.stack(bent, axis=1)
    at[used], shift = places[0], places[-1] - places[0]
    is_end = np.isin(used, np.concatenate([foot[:0], *face.sides])) & (abs(share - 0.75) < 0.125)
    fine = np.column_stack([at[used[is_end], :2], width[is_end] / rows])
    levels = np.linspace(low, high, parts + 1)[0 if at_blends else 1 : -1]
    return SquaredOff(upper, levels, fine, is_split, shift)


def round_end(
    at: np.ndarray, before: np.ndarray, face: Leaning, sizes: Sizes, is_top: bool
) -> SquaredOff | None:
    """Make the end of a lug across the axis square, in place: a wall between two caps.

    The top of a lug that stands along the axis is a cap between two walls. Four hexes meet where it
    has turned by 45 and by 135 degrees.

    Returns None, without changes, if the face is no convex rounding whose borders are straight and
    opposite.

    at, before : (V, 3) vertices in the frame, now and before any face was set
    is_top : whether its borders are at two walls, at one height, and not at two caps
    """
    low, high = (border.vertices for border in face.borders)
    used, faces = np.unique(face.faces, return_inverse=True)
    faces = faces.reshape(-1, 3)
    vectors = triangle_vectors(before[face.faces])
    step, normal = before[high].mean(axis=0) - before[low].mean(axis=0), vectors.sum(axis=0)
    flat, up = np.diag([1.0, 1, 0]), np.array([0.0, 0, 1])
    across, out = (unit(step @ flat), unit(normal * up)) if is_top else (up, unit(normal @ flat))
    bottom, top = before[low] @ across, before[high] @ across
    foot = before[np.concatenate([low, high])] @ out
    size = top.mean() - bottom.mean()
    depth, off = before[used] @ out - foot.mean(), before[used] @ across - bottom.mean()
    radius, beside = depth.max(), np.cross(across, out)
    is_straight = max(np.ptp(foot), np.ptp(bottom), np.ptp(top)) < STRAIGHT * size
    is_straight &= abs(vectors @ beside).sum() < STRAIGHT * abs(vectors).sum()
    if not is_straight or radius < STRAIGHT * size:
        return None
    turn = np.arctan2(depth / radius, 1 - 2 * off / size)
    if turn.min() < -STRAIGHT:
        return None
    share = np.clip(turn / (np.pi / 2) + 0.5, 0.5, 2.5)
    part = np.clip(np.floor(share[faces].mean(axis=1)), 0, 2).astype(np.int64)
    for one in (1, 2):  # vertices between two parts are at the edge between them
        ends = [np.unique(faces[own]) for own in (part < one, part >= one)]
        share[ends[0]] = np.minimum(share[ends[0]], one)
        share[ends[1]] = np.maximum(share[ends[1]], one)
    run = BLUNT * radius * np.interp(share, [0.5, 1, 2, 2.5], [0, 1, 1, 0])
    span = [(at[border] @ across).mean() for border in (low, high)]
    now, then, off = np.interp(share, [1, 2], span), at[used] @ across, at[used] @ beside
    ends = [at[side[(at[side] @ across).argsort(kind="stable")]] for side in face.sides]
    if len(ends) == 2:  # its sides stay on the faces beside them
        (low_then, high_then), (low_now, high_now) = (
            [np.interp(a, end @ across, end @ beside) for end in ends] for a in (then, now)
        )
        part_off = (off - low_then) / (high_then - low_then)
        at[used] += np.multiply.outer(low_now + part_off * (high_now - low_now) - off, beside)
    at[used] += np.multiply.outer(run - depth, out) + np.multiply.outer(now - then, across)
    number = sizes.in_quarter(radius)
    less = max(1, round(number / 2))
    levels = np.linspace(span[0], span[1], number + 1)[1:-1]
    inner, length = (share < 1) & (share > 0.5), BLUNT * radius / less
    if is_top:
        levels = at[low, 2].mean() + BLUNT * radius * out[2] * np.arange(1, less) / less
        inner, length = (share > 1) & (share < 2), (span[1] - span[0]) / number
    fine = np.column_stack([at[used[inner], :2], np.full(inner.sum(), length)])
    return SquaredOff((part == 1) == is_top, levels, fine, False, np.zeros((len(used), 3)))
