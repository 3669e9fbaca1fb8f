"""Find the holes and bosses across an axis: rings of faces along one direction."""

from collections.abc import Iterator

import numpy as np

from polycube.hexmesh.background.arrangement import cross
from polycube.surface.curves.creases import chains_of, vertices_of
from polycube.surface.measures import area_vectors, connected, euler, half_edges, open_edges, unit
from polycube.types import TriMesh

from .holes import Collar, Hole

HALF = np.sqrt(np.pi) / 2  # half the side of the square with the area of a circle, by its radius
BOSS = np.pi / 4  # the same for a boss: its corners are near the circle, so beside other holes
STRAIGHT = 1e-3  # squared sine: tolerance for faces and edges along a hole
ROUND = 0.9  # largest share of the squared normals in one direction for a round face
CIRCLE = 0.05  # of its radius: largest distance of the vertices of a boss or rim from a circle
HIDDEN = 1e-3  # largest share of a ring that is not visible from its centre
BESIDE = 0.1  # of half the width of a hole: largest distance of its upright sides from windows
ALIGNED = 0.15  # of half the extent of a hole: difference between places that become equal
LEVEL = 1e-2  # of half the extent of a hole: tolerance for the plane of a border across it

Pairs = tuple[np.ndarray, np.ndarray]


def holes_across(surface: TriMesh, at: np.ndarray, pairs: Pairs, numbers: list[int]) -> list[Hole]:
    """The round holes, slots and bosses that contain some faces of a surface.

    Sides of their squares at nearly the same place are at the same one, to save thin layers.
    Polygonal passages are left to polycubes, which have fewer hexes there.

    at : (V, 3) vertices in a frame whose last axis is upright
    pairs : of half-edges on a common edge, as `twins` finds them
    numbers : CAD faces
    """
    found = list(_holes(surface, at, pairs, numbers))
    if not found:
        return found
    names = "sides", "extent", "middle", "across"
    sides, extent, middle, across = (np.stack([getattr(h, n) for h in found]) for n in names)
    parallel = across @ across.T > 1 - STRAIGHT
    low, high = middle - extent, middle + extent
    for outer, inner in np.argwhere(parallel):  # a hole in a boss: half of its wall remains
        below, above = low[inner] - low[outer], high[outer] - high[inner]
        if min(*below, *above) > 0:
            sides[outer, :, 0] = np.minimum(sides[outer, :, 0], sides[inner, :, 0] - below / 2)
            sides[outer, :, 1] = np.maximum(sides[outer, :, 1], sides[inner, :, 1] + above / 2)
    sides[:, 1] = _aligned(sides[:, 1], extent[:, 1])
    one, two = np.nonzero(parallel)
    direction = connected(one, two, len(found))
    for number in np.unique(direction):
        own = direction == number
        sides[own, 0] = _aligned(sides[own, 0], extent[own, 0])
    return [hole._replace(sides=own) for hole, own in zip(found, sides, strict=True)]


def _aligned(sides: np.ndarray, extent: np.ndarray) -> np.ndarray:
    """Places of sides (N, 2) of holes with half extents (N,); the means of close ones."""
    places = sides.ravel()
    order = np.argsort(places, kind="stable")
    near = ALIGNED * np.repeat(extent, 2)[order]
    group = np.append(0, np.cumsum(np.diff(places[order]) > np.minimum(near[1:], near[:-1])))
    found = np.empty_like(places)
    found[order] = (np.bincount(group, places[order]) / np.bincount(group))[group]
    return found.reshape(-1, 2)


def _holes(surface: TriMesh, at: np.ndarray, pairs: Pairs, numbers: list[int]) -> Iterator[Hole]:
    vectors = area_vectors(TriMesh(at, surface.faces))
    seen = np.zeros(len(surface.faces), bool)
    one, two = pairs
    lines = half_edges(surface.faces)[one[surface.region[one // 3] != surface.region[two // 3]]]
    step = np.diff(at[lines], axis=1)[:, 0] ** 2
    upright = lines[step[:, 2] > (1 - STRAIGHT) * step.sum(axis=1)]
    for number in numbers:
        own = np.flatnonzero(surface.region == number)
        along = _direction(vectors[own])
        if along is None or seen[own].any():
            continue
        ring = _ring(surface, at, pairs, vectors, along, own)
        seen[ring] = True
        hole = _hole(surface, at, np.cross([0, 0, 1], along), ring, upright)
        if hole and len(hole.rims) == 2 and euler(surface.faces[ring]) == -len(hole.windows):
            yield hole._replace(collars=tuple(_collars(surface, at, pairs, hole)))


def _collars(surface: TriMesh, at: np.ndarray, pairs: Pairs, hole: Hole) -> Iterator[Collar]:
    along, flat = at @ hole.along, hole.flat(at)
    profile = np.column_stack([np.linalg.norm(flat - hole.middle, axis=1), along])
    near = LEVEL * hole.extent.mean()
    half, beside = np.concatenate(pairs), np.concatenate(pairs[::-1]) // 3
    ends, own = half_edges(surface.faces)[half], np.isin(np.arange(len(surface.faces)), hole.faces)
    outside = own[half // 3] & ~own[beside]
    for rim in hole.rims:
        at_rim = outside & np.isin(ends, rim).all(axis=1)
        faces = np.isin(surface.region, surface.region[beside[at_rim]]) & ~own
        borders = [loop for loop in _loops(surface.faces[faces]) if not np.isin(loop, rim).any()]
        used = np.unique(surface.faces[faces])
        if len(borders) > 1 or euler(surface.faces[faces]) != 1 - len(borders):
            continue
        level = along[rim].mean()
        other = borders[0] if borders else used[abs(along[used] - level).argmax(keepdims=True)]
        off = abs(flat[other].mean(axis=0) - hole.middle)
        is_level = max(np.ptp(along[rim]), np.ptp(along[other])) < near
        is_flat = abs(along[other].mean() - level) < near
        if is_level and not is_flat and (off < CIRCLE * hole.extent).all():
            is_round = np.ptp(profile[rim, 0]) < CIRCLE * profile[rim, 0].mean()
            start, end = (profile[loop].mean(axis=0) for loop in (rim, other))
            bulge = abs(cross(profile[used] - start, unit(np.array([end - start])))).max()
            if borders:
                yield Collar(np.flatnonzero(faces), other, float(bulge * is_round))
            elif is_round and bulge < CIRCLE * hole.extent.mean():
                yield Collar(np.flatnonzero(faces), rim, 0.0, is_bottom=True)


def _direction(vectors: np.ndarray) -> np.ndarray | None:
    """(3,) direction across the upright axis along a face with some area vectors (N, 3)."""
    area = np.linalg.norm(vectors, axis=1).sum() or 1.0
    spread, axes = np.linalg.eigh(unit(vectors).T @ vectors / area)
    along = axes[:, 0] if spread[1] > STRAIGHT else np.cross([0, 0, 1], axes[:, 2])
    if spread[0] > STRAIGHT or along[2] ** 2 > STRAIGHT:
        return None
    along = np.array([*along[:2], 0]) / np.linalg.norm(along[:2])
    return along if along @ [1, np.sqrt(2), 0] > 0 else -along  # of opposite directions, one


def _ring(
    surface: TriMesh,
    at: np.ndarray,
    pairs: Pairs,
    vectors: np.ndarray,
    along: np.ndarray,
    own: np.ndarray,
) -> np.ndarray:
    """(N,) triangles of the faces along a direction that are connected by edges along it."""
    area = np.linalg.norm(vectors, axis=1)
    size = np.bincount(surface.region, area)
    lean = np.bincount(surface.region, (vectors @ along) ** 2 / np.maximum(area, 1e-300))
    is_along = (lean < STRAIGHT * size)[surface.region]
    one, two = pairs
    step = np.diff(at[half_edges(surface.faces)[one]], axis=1)[:, 0]
    square = (step**2).sum(axis=1)
    joins = surface.region[one // 3] == surface.region[two // 3]
    joins |= (square - (step @ along) ** 2) < STRAIGHT * square
    joins &= is_along[one // 3] & is_along[two // 3]
    piece = connected(one[joins] // 3, two[joins] // 3, len(surface.faces))
    return np.flatnonzero(np.isin(piece, piece[own]) & is_along)


def _hole(
    surface: TriMesh, at: np.ndarray, across: np.ndarray, ring: np.ndarray, upright: np.ndarray
) -> Hole | None:
    """The hole or boss in a ring of faces, if one is curved and all are visible from its centre.

    upright : (N, 2) edges of upright curves
    """
    flat = np.stack([at @ across, at[:, 2]], axis=1)
    places = flat[surface.faces[ring]]
    if not len(ring):
        return None
    low, high = places.min(axis=(0, 1)), places.max(axis=(0, 1))
    middle = (low + high) / 2
    vectors = area_vectors(TriMesh(at, surface.faces[ring]))
    normals = np.stack([vectors @ across, vectors[:, 2]], axis=1)
    inward = np.einsum("nd,nd->n", middle - places.mean(axis=1), normals)
    from_inside, from_outside = inward.clip(0).sum(), -inward.clip(max=0).sum()
    if min(from_inside, from_outside) > HIDDEN * max(from_inside, from_outside):
        return None
    is_boss = from_outside > from_inside
    radius = np.linalg.norm((places - middle) / np.maximum((high - low) / 2, 1e-300), axis=2)
    if is_boss and abs(radius - 1).max() > CIRCLE:
        return None
    for number in np.unique(surface.region[ring]):
        own = normals[surface.region[ring] == number]
        if np.linalg.norm(own.sum(axis=0)) < ROUND * np.linalg.norm(own, axis=1).sum():
            loops = _loops(surface.faces[ring])
            turns = [_turn(flat[loop] - middle) for loop in loops]
            rims = [loop for loop, turn in zip(loops, turns, strict=True) if turn]
            windows = [loop for loop, turn in zip(loops, turns, strict=True) if not turn]
            extent = (high - low) / 2
            at_rim = np.isin(upright, np.concatenate([ring[:0], *rims]))
            corners = np.unique(upright[at_rim & ~at_rim[:, ::-1]])  # not on edges of rims
            seen = flat[np.concatenate([corners, *windows])]
            wide = abs(seen[:, 0] - middle[0]).max(initial=0) / extent[0]
            wide += min(BESIDE, (1 - wide) / 2)
            least = BOSS if is_boss else HALF
            half = np.array([max(least, wide), least]) * extent
            sides = np.stack([middle - half, middle + half], axis=1)
            return Hole(ring, across, middle, extent, wide, sides, rims, windows, corners)
    return None


def _loops(faces: np.ndarray) -> list[np.ndarray]:
    """Vertices of the loops at the border of triangles."""
    border = open_edges(faces)
    return [vertices_of(border, chain)[:-1] for chain in chains_of(border)]


def _turn(places: np.ndarray) -> int:
    """Number of turns of a loop (N, 2) about the origin."""
    angle = np.arctan2(places[:, 1], places[:, 0])
    return round(
        ((np.diff(angle, append=angle[0]) + np.pi) % (2 * np.pi) - np.pi).sum() / np.pi / 2
    )
