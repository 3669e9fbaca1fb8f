"""Hex size that is needed for the details of a surface, and the thickness of its solid."""

from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree

from polycube.surface.fit_target import Target, target
from polycube.surface.measures import spread, twins
from polycube.types import TriMesh

SAMPLES = 5_000  # number of points on the surface
LARGE = 0.1  # of the diagonal: largest size
# of the diagonal: permitted distance between a curved surface and the middle of an edge
CHORD = 0.002
SMOOTH = 0.5  # largest turn, in radians, between two triangles of one smooth face
# spacing of points on curves, and distance below which two curves are compared
SPACING, NEAR = 0.01, 0.1
COINCIDENT = 0.002  # curves closer than this are represented by one path
# per cent of faces and curves that may need less than `detail_size`
RARE_FACES, RARE_CURVES = 2.0, 10.0
OPPOSITE = -0.8  # largest cosine between the directions to opposite walls
START = 2e-4  # of the diagonal: first distance from the surface, less than half of any wall
STEP = 0.5  # of the radius: distance that the centre moves in a step
STEPS = 100  # three steps at a corner of three faces increase the radius by half


def detail_size(goal: Target, across: float, around: float) -> float:
    """Edge length of hexes that is small enough for nearly all walls, holes, slots and curves.

    It is a share of the diagonal.

    across : number of hexes across a wall
    around : number of hexes around a hole, or around a circle as wide as a slot
    """
    _, by_sample = _on_faces(goal, across, around)
    _, by_point, curve = _on_curves(goal)
    # one more, in case there are no curves
    by_curve = np.full(len(goal.followed.creases) + 1, LARGE)
    np.minimum.at(by_curve, curve, by_point)
    faces, curves = np.percentile(by_sample, RARE_FACES), np.percentile(by_curve, RARE_CURVES)
    return float(min(faces, curves))


def small_details(goal: Target, size: float, across: float, around: float) -> np.ndarray:
    """Points at which hexes of a given size are too large for the details of the surface.

    Details are walls, holes and slots, curves shorter than two hexes, and curves closer to others
    than two hexes. Returns (N, 3) points at unit scale.

    size : edge length of the hexes, as a share of the diagonal
    across, around : as in `detail_size`
    """
    on_faces, by_sample = _on_faces(goal, across, around)
    on_curves, by_point, _ = _on_curves(goal)
    return np.concatenate([on_faces[by_sample < size], on_curves[by_point < size]])


@lru_cache(maxsize=4)
def _on_faces(goal: Target, across: float, around: float) -> tuple[np.ndarray, np.ndarray]:
    """Points of the surface (N, 3) and the hex size needed there for walls, holes and bends."""
    points, face = spread(goal.surface, SAMPLES)
    most = LARGE * max(across, around / np.pi)
    wall, room = (widths(goal, points, outside, most) for outside in (False, True))
    bend = np.sqrt(8 * CHORD / np.maximum(_curvature(goal)[face], 1e-9))
    return points, np.minimum(np.minimum(wall / across, room * np.pi / around), bend)


def _curvature(goal: Target) -> np.ndarray:
    """(F,) largest curvature of the surface at each triangle, across its smooth edges."""
    surface = goal.surface
    first, second = (half // 3 for half in twins(surface.faces))
    middle = surface.vertices[surface.faces].mean(axis=1)
    turn = np.linalg.norm(goal.normals[first] - goal.normals[second], axis=1)
    # The facets of a round face turn by less; their centres are one chord length apart.
    apart = np.linalg.norm(middle[first] - middle[second], axis=1)
    found = np.zeros(len(surface.faces))
    curved = np.where(turn < SMOOTH, turn / np.maximum(apart, 1e-12), 0.0)
    np.maximum.at(found, first, curved)
    np.maximum.at(found, second, curved)
    return found


@lru_cache(maxsize=4)
def _on_curves(goal: Target) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of the curves (N, 3), the hex size needed there, and the curve of each point.

    The size is half the length of the curve, or half the distance from another curve away from a
    common corner.
    """
    rows = [np.zeros((0, 6))]
    for number, crease in enumerate(goal.followed.creases):
        arc = np.linspace(0, crease.length, max(3, int(crease.length / SPACING) + 1))
        away = np.full(len(arc), np.inf) if crease.is_loop else np.minimum(arc, arc[::-1])
        length = np.full(len(arc), LARGE if crease.is_loop else min(crease.length / 2, LARGE))
        rows.append(np.column_stack([crease.at(arc)[0], away, length, np.full(len(arc), number)]))
    table = np.concatenate(rows)
    points, away, wanted, owner = table[:, :3], table[:, 3], table[:, 4], table[:, 5].astype(int)
    one, two = cKDTree(points).query_pairs(NEAR, output_type="ndarray").T
    apart = np.linalg.norm(points[one] - points[two], axis=1)
    # Two curves that meet at a corner are as close to each other there as to the corner.
    free = (owner[one] != owner[two]) & (apart < 0.5 * (away[one] + away[two]))
    for end in (one, two):
        np.minimum.at(wanted, end[free], np.maximum(apart[free], COINCIDENT) / 2)
    return points, wanted, owner


def thickness(surface: TriMesh, points: np.ndarray) -> np.ndarray:
    """Thickness (N,) of a solid at points (N, 3) on or near its surface, in model units.

    It is the distance between the two walls around each point, and at most the diagonal: the
    thickness of a plate, the wall of a tube, the diameter of a ball.
    """
    goal = target(surface)
    return goal.scale * widths(goal, goal.to_unit(points))


def widths(
    goal: Target, points: np.ndarray, outside: bool = False, most: float = np.inf
) -> np.ndarray:
    """Thickness at points of a prepared surface; points and lengths at unit scale.

    outside : the sphere grows outside the solid, which gives the width of a slot or the diameter of
        a hole
    most : largest diameter of a sphere; larger values are cut off
    """
    foot, face = goal.closest(points)
    inside = goal.surface.vertices[goal.surface.faces[face]].mean(axis=1) - foot
    length = np.linalg.norm(inside, axis=1, keepdims=True)
    # away from edges and corners
    foot = foot + inside * np.minimum(1, START / np.maximum(length, 1e-30))
    centre, before = foot + (START if outside else -START) * goal.normals[face], foot
    found, active = np.ones(len(points)), np.arange(len(points))
    for _ in range(STEPS):
        foot, face = goal.closest(centre, guess=face)
        away, back = centre - foot, before - centre
        radius = np.linalg.norm(away, axis=1)
        found[active] = 2 * radius
        lengths = radius * np.linalg.norm(back, axis=1)
        stopped = -(away * back).sum(axis=1) / np.maximum(lengths, 1e-30) < OPPOSITE
        found[active[stopped]] = np.linalg.norm(foot - before, axis=1)[stopped]
        stopped |= 2 * radius > most
        active, face, before = active[~stopped], face[~stopped], foot[~stopped]
        centre = (centre + STEP * away)[~stopped]
    return np.where(found > 0, np.minimum(found, 1), 1)
