"""The largest stress: its place, its uncertainty, and whether it is singular."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from polycube.analysis.assembly import Value
from polycube.analysis.boundary_sets import edge_trace, sets_of_sides, trace
from polycube.analysis.constraints import Support
from polycube.analysis.cyclic import Sector
from polycube.analysis.recovery import EVEN_LINE, OfGradient, at_places, samples
from polycube.analysis.shape import NOTCH
from polycube.spline.bernstein import bernstein, derivative
from polycube.spline.bezier import scaled_detj
from polycube.spline.boundary import boundary_nodes, edge_strips
from polycube.spline.spaces.sharp_features import is_among
from polycube.surface.measures import unit
from polycube.types import Peak, Spline

FREE, CLAMPED, SLIDING = 200, 65, 100  # degrees above which an edge is singular
ALONG = 0.99  # cosine between the normal of a face and its single constrained component
INSIDE = (np.arange(4) + 0.5) / 4  # points along an edge at which its angle is measured
ALL_ALONG = np.arange(7) / 6  # points along it from which distances are measured
# smallest det J divided by the volume below which the stress of an element is not trusted
POOR = 0.05
# sum of a series whose terms fall by half, by its first term: error of the recovered stress at a
# face, by the part of the stress of an element that it leaves out
SERIES = 2.0


@dataclass(frozen=True, eq=False)
class Singular:
    """An edge or a small loaded area."""

    what: str
    nodes: np.ndarray  # (N,) its Bezier nodes
    points: np.ndarray  # (P, 3) on it


def singular_places(
    spline: Spline,
    supports: Sequence[Support],
    loaded: Sequence[np.ndarray],
    radius: float,
    sector: Sector | None = None,
    young: Value = 1.0,
) -> list[Singular]:
    """Sharp re-entrant edges, borders of supports, supported edges, and loads on a small area.

    So are the borders between elements with different Young's moduli, a number or (E,).

    An area is small if it is less than that of a disc of the radius.

    loaded : faces (F,), indices of `spline.sides`, of each load
    sector : the edges of its cut faces are inside the whole
    """
    first, second, lines, points, angle, normals = _edges(spline)

    is_cut = np.isin(lines, [] if sector is None else sector.nodes).all(axis=1)

    def along(chosen: np.ndarray, what: str) -> list[Singular]:
        own = np.flatnonzero(chosen & ~is_cut)
        found = Singular(what, np.unique(lines[own]), points[own].reshape(-1, 3))
        return [found] if len(own) else []

    pairs = np.sort(np.stack([first, second], axis=1), axis=1)
    is_inner = is_among(pairs, np.sort(spline.inner_edges, axis=1))
    found = along((angle > FREE) | is_inner, "sharp inner edge")
    own = np.broadcast_to(young, len(spline.nodes))[spline.sides[:, 0]]
    found += along(own[first] != own[second], "border between two materials")
    for support in supports:
        is_supported = np.isin(np.arange(len(spline.sides)), support.faces)
        is_border = is_supported[first] != is_supported[second]
        limit = np.full(len(first), CLAMPED)
        if len(support.components) == 1:
            normal = np.where(is_supported[first, None], normals[:, 0], normals[:, 1])
            limit[abs(normal[:, support.components[0]]) > ALONG] = SLIDING
        found += along(is_border & (angle > limit), f"border of {support.name}")
        if len(support.edges):
            nodes = np.unique(support.edges)
            what, points = f"supported {support.name}", edge_trace(spline, support.edges).points
            found.append(Singular(what, nodes, points))
    for faces in loaded:
        here = trace(spline, faces)
        if here.area.sum() < np.pi * radius**2:
            nodes = np.unique(boundary_nodes(spline)[faces])
            found.append(Singular("load on a small area", nodes, here.points))
    return found


def _edges(spline: Spline) -> tuple[np.ndarray, ...]:
    """Edges between two faces of the boundary of the same level.

    Returns the two faces (N,) and (N,), nodes (N, 4), points (N, 7, 3), angle (N,) inside the solid
    in degrees, and the two normals (N, 2, 3).
    """
    strips, a, b = edge_strips(spline)
    pairs = np.stack([a, b], axis=1)
    points = (spline.extraction @ spline.control)[strips]  # (4 Q, 2, 4, 3)
    along = derivative(INSIDE) @ points[:, 0]
    inwards = bernstein(INSIDE) @ (points[:, 1] - points[:, 0])
    normal = unit(np.cross(along, inwards))
    inwards = unit(np.cross(normal, along))
    turn = inwards[b][:, ::-1]  # the edge has the opposite direction on the other face
    angle = np.arctan2(-(turn * normal[a]).sum(axis=2), (turn * inwards[a]).sum(axis=2))
    return (
        a // 4,
        b // 4,
        strips[a, 0],
        bernstein(ALL_ALONG) @ points[a, 0],
        np.median(np.degrees(angle) % 360, axis=1),
        unit(normal[pairs].mean(axis=2)),
    )


def poor_elements(spline: Spline) -> np.ndarray:
    """(E,) whether det J is so close to 0 in an element that gradients are unreliable."""
    return scaled_detj(spline) < POOR


def peaks(
    spline: Spline,
    displacement: np.ndarray,
    von_mises: np.ndarray,
    von_mises_of: OfGradient,
    poor: np.ndarray,
    singular: Sequence[Singular],
    radius: float,
) -> tuple[Peak, Peak | None]:
    """The largest equivalent stress away from singular places, and that near the worst of these.

    The first one is the largest of all if no point is away from singular places. The second is
    the largest stress at the points between one and two radii from the singular place with the
    largest stress, or at the closest ones outside a radius. It is None if no stress at such a place
    is larger than the first.

    displacement : (B, 3) displacement of the stress
    von_mises : (B,) recovered stress
    von_mises_of : function of displacement gradients, see `gradient_field`; n = 1
    poor : (E,) whether an element is badly shaped; such elements are only used if all are
    radius : distance from a singular place within which points belong to it, as do elements that
        touch it
    """
    values = samples(spline, von_mises[:, None])[..., 0]
    points = samples(spline, spline.extraction @ spline.control)
    sound = np.broadcast_to(~poor[:, None] | poor.all(), values.shape)
    distance = np.full((len(singular), *values.shape), np.inf)
    for k, place in enumerate(singular):
        distance[k] = cKDTree(place.points).query(points, distance_upper_bound=radius)[0]
        distance[k, np.isin(spline.nodes, place.nodes).any(axis=1)] = 0
    near = (distance <= radius).any(axis=0)
    sides = boundary_nodes(spline)

    def largest(among: np.ndarray) -> Peak:
        element, place = np.unravel_index(np.where(among, values, -1).argmax(), values.shape)
        value = float(values[element, place])
        around = (spline.nodes == spline.nodes[element, place]).any(axis=1)
        around = np.flatnonzero(around & ~poor if (around & ~poor).any() else around)
        raw = at_places(spline, displacement, von_mises_of, EVEN_LINE, around)[..., 0]
        here = (sides == spline.nodes[element, place]).any(axis=1)
        there = np.isin(spline.nodes[around], [spline.nodes[element, place], *sides[here].flat])
        off = abs(raw - values[around])[there & among[around]].max()
        tilt = float(spline.tilt[here].max(initial=0)) if len(spline.tilt) else 0.0
        return Peak(
            value=value,
            at=tuple(points[element, place].tolist()),
            error=SERIES * float(off) + NOTCH * tilt * value,
            on=boundary_name(spline, here),
        )

    away = sound & ~near
    peak = largest(away if away.any() else sound)
    if not (sound & near).any():
        return peak, None
    other = largest(sound & near)
    if other.value < peak.value:
        return peak, None
    trees = [cKDTree(place.points) for place in singular]
    worst = int(np.argmin([tree.query(other.at)[0] for tree in trees]))
    apart = trees[worst].query(points)[0]
    outside = sound & (apart >= radius)
    beside = outside & (apart <= max(2 * radius, apart[outside].min(initial=np.inf)))
    ring = largest(beside) if beside.any() else other
    away_from = float(trees[worst].query(ring.at)[0])
    return peak, replace(ring, what=singular[worst].what, distance=away_from)


def boundary_name(spline: Spline, at: np.ndarray) -> str:
    """The name of the first boundary face with at (Q,) true; that of the CAD face if there is one.

    It is empty without such a face.
    """
    if not at.any():
        return ""
    side = at.argmax()
    sets = spline.sets or sets_of_sides(spline)
    names = [name for name, faces in sets.items() if side in faces]

    def rank(name: str) -> int:
        """Names of the CAD model, its faces, holes and ends, patches."""
        first = next((p for p in ("cad_face_", "cad_", "patch_") if name.startswith(p)), "")
        return ("cad_", "cad_face_", "", "patch_").index(first)

    return min(names, key=rank, default="")
