"""The features of a closed surface as a graph: creases, and the corners where they meet.

In a CAD model all borders of faces are creases, independent of angle and length. The tip of a
conical face is a corner without creases.

In a triangle surface an edge is sharp if the normals turn by more than 46 degrees. This is above
the angle of a cylinder of eight facets (45), which is the coarsest approximation of a smooth part,
and below the angles of machined edges. A crease is a chain of sharp edges between two corners, or a
loop. A corner is a vertex whose number of sharp edges is not two, or where the chain has a kink.

Features smaller than a hex are treated as noise: connected pieces shorter than `SHORT` and creases
shorter than `LOOSE` for each loose end are dropped (at unit scale, diagonal 1). Creases that are
sharp only locally are dropped as well: most of a crease must still turn by `STILL` when the normals
are averaged over half a hex, or the crease must belong to long ones (`LONG`), which are low steps
and not noise.
"""

from itertools import pairwise

import numpy as np

from polycube.surface.arc_length import lengths
from polycube.surface.curves.features import Crease, Features
from polycube.surface.filtered_normals import between_planes, broad_turns
from polycube.surface.measures import connected, corner_angles, half_edges, twins
from polycube.types import TriMesh

SHARP = np.deg2rad(46)  # smallest angle between the normals at a sharp edge
KINK = np.deg2rad(50)  # smallest turn of a crease at an additional corner
WINDOW = 0.01  # length over which a turn is measured
SHORT = 0.05  # total length below which connected creases are noise
BROAD = 0.025  # half a hex: radius over which normals are averaged
STILL = np.deg2rad(40)  # smallest angle between the averaged normals
LONG = 0.2  # four hexes: length of a crease that noise seldom reaches
LOOSE = 0.06  # length per loose end below which a crease is noise
TIP = 0.1  # smallest difference of the angles at the tip of a cone from a full turn, in radians


def features(surface: TriMesh, normals: np.ndarray) -> Features:
    """The graph of the curves of a surface at unit scale.

    surface : surface at unit scale, with CAD faces as `region` if there are any
    normals : (F, 3) unit normals
    """
    sides, inside, faces, is_plain = _curve_edges(surface, normals)
    points = surface.vertices
    is_border = faces[:, 0] != faces[:, 1]
    is_broad = is_border | is_plain | (broad_turns(surface, normals, sides, BROAD) > STILL)
    is_broad |= _in_steps(points, sides, is_broad)
    folds = sides[~is_broad]
    remaining = _without_noise(points, sides, is_broad, is_border)
    sides, inside, faces = sides[remaining], inside[remaining], faces[remaining]
    noise = folds[~np.isin(folds, sides).all(axis=1)]
    chains = [part for chain in chains_of(sides) for part in _between_kinks(points, sides, chain)]
    ends = {v for chain in chains for v in _ends(sides, chain)}
    number = {v: i for i, v in enumerate(sorted(ends))}
    creases = []
    for chain in chains:
        path, edge = points[vertices_of(sides, chain)], np.array(chain) // 2
        start, end = [number[v] for v in _ends(sides, chain)] or [-1, -1]
        low, high = faces[edge[0]].tolist()
        creases.append(Crease(path, lengths(path), inside[edge], (start, end), (low, high)))
    degree = np.bincount(sides.ravel(), minlength=len(points))
    tips = _tips(surface, degree == 0)
    at = np.array([*sorted(ends), *tips], np.int64)
    n_faces, of_tips = len(np.unique(surface.region)), dict(enumerate(tips.values(), len(ends)))
    corners, is_fixed = points[at].reshape(-1, 3), degree[at] != 1
    return Features(tuple(creases), corners, is_fixed, noise, n_faces, of_tips)


def _tips(surface: TriMesh, is_inside: np.ndarray) -> dict[int, int]:
    """Tip of each conical CAD face that has one: the angles there are less than a full turn.

    is_inside : (V,) whether a vertex is on no curve
    """
    cones = [face for face, shape in enumerate(surface.region_shapes, 1) if shape == "cone"]
    if not cones:
        return {}
    angle = np.bincount(surface.faces.ravel(), corner_angles(surface).ravel(), len(is_inside))
    less = np.where(is_inside, 2 * np.pi - angle, 0)
    tips = {}
    for face in cones:
        own = surface.faces[surface.region == face].ravel()
        tip = int(own[less[own].argmax()])
        if less[tip] > TIP:
            tips[tip] = face
    return tips


def _curve_edges(
    surface: TriMesh, normals: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Edges between CAD faces, sharp edges, and edges between planes.

    Returns ends (S, 2); angle of the solid (S,); adjacent CAD faces (S, 2), ascending; whether the
    edge lies between planes at less than the sharp angle (S,).
    """
    first, second = twins(surface.faces)
    a, b = normals[first // 3], normals[second // 3]
    turn = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("nd,nd->n", a, b))
    has_area = (np.abs(a).sum(axis=1) > 0) & (np.abs(b).sum(axis=1) > 0)
    region = surface.region if len(surface.region) else np.zeros(len(surface.faces), np.int64)
    faces = np.sort(np.stack([region[first // 3], region[second // 3]], axis=1), axis=1)
    is_plain = np.zeros(len(turn), bool)
    if not len(surface.region):
        is_plain = between_planes(surface, normals, np.stack([first, second], axis=1) // 3, SHARP)
    found = (has_area & (turn > SHARP)) | (faces[:, 0] != faces[:, 1]) | is_plain
    sides = half_edges(surface.faces)[first[found]]
    along = surface.vertices[sides[:, 1]] - surface.vertices[sides[:, 0]]
    convex = np.einsum("nd,nd->n", np.cross(a[found], b[found]), along) > 0
    inside = np.where(convex, np.pi - turn[found], np.pi + turn[found])
    return sides, inside, faces[found], is_plain[found]


def _in_steps(points: np.ndarray, sides: np.ndarray, is_broad: np.ndarray) -> np.ndarray:
    """(S,) edges that are sharp only locally but belong to long chains, if most such edges do."""
    length = np.linalg.norm(points[sides[:, 0]] - points[sides[:, 1]], axis=1)
    in_steps = np.zeros(len(sides), bool)
    for chain in chains_of(sides):
        edge = [name // 2 for name in chain]
        in_steps[edge] = length[edge].sum() >= LONG
    # length in short chains and in long ones
    folds = np.bincount(in_steps[~is_broad], length[~is_broad], 2)
    return in_steps & (folds[1] > folds[0])


def _without_noise(
    points: np.ndarray, sides: np.ndarray, is_broad: np.ndarray, is_border: np.ndarray
) -> np.ndarray:
    """(S,) bool: edges that remain without short pieces, short loose ends and local folds.

    The borders of CAD faces (S,) always remain.
    """
    left = np.arange(len(sides))
    while len(left):
        own, broad = sides[left], is_broad[left]
        length = np.linalg.norm(points[own[:, 0]] - points[own[:, 1]], axis=1)
        piece = connected(own[:, 0], own[:, 1], len(points))[own[:, 0]]
        keep = np.bincount(piece, length)[piece] >= SHORT
        degree = np.bincount(own.ravel(), minlength=len(points))
        for chain in chains_of(own):
            loose = (degree[list(_ends(own, chain))] == 1).sum()
            edge = [name // 2 for name in chain]
            total = length[edge].sum()
            if total < LOOSE * loose or length[edge] @ broad[edge] < total / 2:
                keep[edge] = False
        keep |= is_border[left]
        if keep.all():
            break
        left = left[keep]
    return np.isin(np.arange(len(sides)), left)


def chains_of(sides: np.ndarray) -> list[list[int]]:
    """Chains of edges between vertices that do not have exactly two edges, and loops.

    Edge e is listed as 2 e in its own direction and as 2 e + 1 in the opposite direction.
    """
    leaving: dict[int, list[int]] = {}
    for name, vertex in enumerate(sides.ravel().tolist()):
        leaving.setdefault(vertex, []).append(name)
    flat, seen, found = sides.ravel().tolist(), set(), []
    corners = [names for names in leaving.values() if len(names) != 2]
    for names in [*corners, *leaving.values()]:  # the loops follow
        for start in names:
            if start // 2 in seen:
                continue
            chain = [start]
            seen.add(start // 2)
            while True:
                here = leaving[flat[chain[-1] ^ 1]]
                if len(here) != 2:
                    break
                onward = here[0] if here[1] == chain[-1] ^ 1 else here[1]
                if onward // 2 in seen:
                    break
                chain.append(onward)
                seen.add(onward // 2)
            found.append(chain)
    return found


def vertices_of(sides: np.ndarray, chain: list[int]) -> np.ndarray:
    """(N + 1,) vertices along a chain of N edges."""
    names = np.array(chain)
    return np.append(sides.ravel()[names], sides.ravel()[names[-1] ^ 1])


def _ends(sides: np.ndarray, chain: list[int]) -> tuple[int, ...]:
    """The two ends of a chain; empty for a loop without a corner."""
    vertices = vertices_of(sides, chain)
    if vertices[0] != vertices[-1]:
        return int(vertices[0]), int(vertices[-1])
    return ()


def _between_kinks(points: np.ndarray, sides: np.ndarray, chain: list[int]) -> list[list[int]]:
    """Cut a chain at its kinks."""
    path = points[vertices_of(sides, chain)]
    arc = lengths(path)
    is_loop = len(_ends(sides, chain)) == 0
    turn = _turns(path, arc, is_loop)
    kinks: list[int] = []
    for k in np.argsort(-turn, kind="stable"):
        gap = np.abs(arc[kinks] - arc[k])
        gap = np.minimum(gap, arc[-1] - gap) if is_loop else gap
        if turn[k] > KINK and (gap > 2 * WINDOW).all():
            kinks.append(int(k))
    kinks.sort()
    if not is_loop:
        cuts = [0, *kinks, len(chain)]
    elif len(kinks) < 2:  # a loop with one corner is not cut: it would end where it begins
        return [chain]
    else:
        chain = chain[kinks[0] :] + chain[: kinks[0]]
        cuts = [k - kinks[0] for k in kinks] + [len(chain)]
    return [chain[a:b] for a, b in pairwise(cuts)]


def _turns(path: np.ndarray, arc: np.ndarray, is_loop: bool) -> np.ndarray:
    """(N,) angle between the directions to and from each vertex of a path; 0 near its ends."""

    def at(where: np.ndarray) -> np.ndarray:
        where = np.mod(where, arc[-1]) if is_loop else np.clip(where, 0, arc[-1])
        return np.stack([np.interp(where, arc, column) for column in path.T], axis=1)

    window = np.minimum(WINDOW, arc[-1] / 8)
    to, on = path - at(arc - window), at(arc + window) - path
    cosine = np.einsum("nd,nd->n", to, on)
    size = np.linalg.norm(to, axis=1) * np.linalg.norm(on, axis=1)
    turn = np.arccos(np.clip(cosine / np.maximum(size, 1e-30), -1, 1))
    if is_loop:
        turn[-1] = 0  # the last point is the first point
    else:
        turn[(arc < window) | (arc > arc[-1] - window)] = 0
    return turn
