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
        yield (
            f"the boundary intersects itself: {len(found.crossings)} pairs of quads, the first "
            f"at {place}"
        )
    if len(open_ones):
        yield (
            f"the Jacobian of {len(open_ones)} of {len(found.mesh.hexes)} hexes is not "
            f"positive everywhere; the first is number {open_ones[0]}"
        )
    if has_wrong_volume(goal, found):
        yield (
            f"the volume is {found.volume_ratio:.1%} of the part's, more than "
            f"{goal.volume_limit:.0%} off"
        )
    if found.largest > goal.distance_limit:
        yield (
            f"mesh and surface are up to {found.largest:.1%} of the diagonal apart, more than "
            f"{goal.distance_limit:.0%}"
        )


def warnings(goal: Goal, found: Inspection) -> Iterator[str]:
    """Warnings about a valid mesh."""
    from polycube.hexmesh.named_sets import face_set

    apart, p99 = found.deviation, found.deviation.p99
    if found.scaled_jacobian < goal.poor_jacobian:
        yield (
            f"the smallest scaled Jacobian is {found.scaled_jacobian:.3f}, below "
            f"{goal.poor_jacobian:g}"
        )
    if apart.vertices >= goal.far_vertices:
        yield (
            f"boundary vertices are up to {apart.vertices:.2%} of the diagonal away from the "
            f"surface, more than {goal.far_vertices:.1%}"
        )
    if abs(found.volume_ratio - 1) >= goal.far_volume:
        yield (
            f"the volume is {found.volume_ratio:.1%} of the part's, more than "
            f"{goal.far_volume:.0%} off"
        )
    for far, limit, length in (
        (found.off_wall, goal.far_wall, "wall thickness"),
        (found.off_size, goal.far_size, "edge length of the hexes"),
    ):
        if far.share > limit:
            place = np.round(far.place, 3).tolist()
            yield (
                f"mesh and surface are {far.distance:.3g} apart at {place}, which is "
                f"{far.share:.0%} of the {length} there, {far.length:.3g}"
            )
            break
    else:
        if found.largest > max(goal.distance, goal.peak * p99):
            place = np.round(found.farthest_at, 3).tolist()
            yield (
                f"the largest distance, {found.largest:.2%} of the diagonal at {place}, is far "
                f"above that of 99 % of the points, {p99:.2%}: something may be missing there"
            )
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
