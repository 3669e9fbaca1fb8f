"""What is said about a hex mesh that misses limits of the goal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from polycube.types import Goal, TriMesh

if TYPE_CHECKING:
    from polycube.hexmesh.feature_distances import Feature
    from polycube.hexmesh.inspection import Inspection

FORCED = 0.9  # share of the sine of an acute angle of the part that a hex there reaches


def failures(goal: Goal, found: Inspection, open_ones: np.ndarray) -> Iterator[str]:
    """Reasons why a mesh is not valid.

    open_ones : hexes whose Jacobian is not certified to be positive
    """
    worst = found.scaled_jacobian
    least = least_jacobian(goal, found.surface) if worst < goal.least_jacobian else 0.0
    if worst <= 0 or worst < least:
        needed = f"{least:g} or more" if worst > 0 else "above 0"
        yield f"the smallest scaled Jacobian is {worst:.3f}; it must be {needed}"
    if len(found.crossings):
        quad = found.mesh.quads[found.crossings[0, 0]]
        place = np.round(found.mesh.vertices[quad].mean(axis=0), 3).tolist()
        pairs = f"{len(found.crossings)} pairs of quads, the first at {place}"
        yield f"the boundary intersects itself: {pairs}"
    if len(open_ones):
        share = f"{len(open_ones)} of {len(found.mesh.hexes)} hexes"
        first = f"the first is number {open_ones[0]}"
        yield f"the Jacobian of {share} is not positive everywhere; {first}"
    if has_wrong_volume(goal, found):
        limit = f"more than {goal.volume_limit:.0%} off"
        yield f"the volume is {found.volume_ratio:.1%} of the part's, {limit}"
    if found.largest > goal.distance_limit:
        limit = f"more than {goal.distance_limit:.0%}"
        yield f"mesh and surface are up to {found.largest:.1%} of the diagonal apart, {limit}"


def warnings(goal: Goal, found: Inspection) -> Iterator[str]:
    """Warnings about a valid mesh."""
    from polycube.hexmesh.named_sets import face_set

    apart, p99 = found.deviation, found.deviation.p99
    if found.scaled_jacobian < goal.poor_jacobian:
        below = f"below {goal.poor_jacobian:g}"
        yield f"the smallest scaled Jacobian is {found.scaled_jacobian:.3f}, {below}"
    if apart.vertices >= goal.far_vertices:
        away = f"up to {apart.vertices:.2%} of the diagonal away from the surface"
        yield f"boundary vertices are {away}, more than {goal.far_vertices:.1%}"
    if abs(found.volume_ratio - 1) >= goal.far_volume:
        excess = f"more than {goal.far_volume:.0%} off"
        yield f"the volume is {found.volume_ratio:.1%} of the part's, {excess}"
    for far, limit, length in (
        (found.off_wall, goal.far_wall, "wall thickness"),
        (found.off_size, goal.far_size, "edge length of the hexes"),
    ):
        if far.share > limit:
            place = np.round(far.place, 3).tolist()
            share = f"{far.share:.0%} of the {length} there, {far.length:.3g}"
            yield f"mesh and surface are {far.distance:.3g} apart at {place}, which is {share}"
            break
    else:
        if found.largest > max(goal.distance, goal.peak * p99):
            place = np.round(found.farthest_at, 3).tolist()
            largest = f"the largest distance, {found.largest:.2%} of the diagonal at {place}"
            above = f"far above that of 99 % of the points, {p99:.2%}"
            yield f"{largest}, is {above}: something may be missing there"
    off = lost(goal, found)
    if off:
        worst = max(off, key=lambda each: each.excess(goal))
        faces = " and ".join(face_set(found.surface, face) for face in worst.faces)
        yield (
            f"{len(off)} of {len(found.features)} points, curves and faces of the CAD model "
            f"are lost: farther than {goal.features:.1%} of the diagonal or "
            f"{goal.feature_share:.0%} of their size; first the {worst.kind} of {faces} at "
            f"{np.round(worst.place, 3).tolist()}, {worst.distance:.2%} of the diagonal away"
        )
    if found.lost_faces:
        names = ", ".join(found.lost_faces[:5]) + ", ..." * (len(found.lost_faces) > 5)
        number = len(found.lost_faces)
        yield f"{number} CAD {'face has' if number == 1 else 'faces have'} no quad: {names}"


def has_wrong_volume(goal: Goal, found: Inspection) -> bool:
    """Whether the volume is too different from that of the part."""
    return abs(found.volume_ratio - 1) > goal.volume_limit


def lost(goal: Goal, found: Inspection) -> list[Feature]:
    """Points, curves and faces of a CAD part with a distance above the limit."""
    return [each for each in found.features if each.exceeds(goal)]


def least_jacobian(goal: Goal, surface: TriMesh) -> float:
    """Smallest scaled Jacobian of a valid mesh, less where an angle of the part forces it."""
    from polycube.surface.curves.acute import acute

    forced = (FORCED * float(np.sin(each.angle)) for each in acute(surface))
    return min([goal.least_jacobian, *forced])
