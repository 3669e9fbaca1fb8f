"""Fit the boundary of a hex mesh to a surface, untangle it and keep the hexes well-shaped.

Rounds of descent of

    sum_frames f(J)  +  sum_v w/h^2 [(n . r)^2 + slack |r|^2]  +  the same from points of the
    surface

where r is the vector from a boundary vertex to its closest point with a compatible normal; vertices
on matched curves, whose mean normal fits none of their faces, have springs to the curves only. The
weight w grows, the slack and the weight alpha of the normals decrease; the springs are released
around bad hexes.

A cascade registers coarse meshes, the coarsest first, to improve a rough map.
"""

import logging
from dataclasses import dataclass, replace

import numpy as np

from polycube.fitting.creases.constraints import along_curves, match, no_features
from polycube.fitting.energy import Terms
from polycube.fitting.problem import RESHAPED, FitProblem
from polycube.fitting.springs import adjusted, between, pull
from polycube.hexmesh.generation.template import counts, map_through, mesh
from polycube.hexmesh.quality import volume
from polycube.surface import measures as surfaces
from polycube.surface.fit_target import ALPHA, Target
from polycube.types import HexMesh, PerAxis, Polycube, RoughMap

logger = logging.getLogger(__name__)

Range = tuple[float, float]  # value in the first and in the last round, geometric in between
TURN = 0.15, ALPHA  # weight of the difference of unit normals, a length in diagonals
WEIGHT = 0.3, 20.0  # of the springs normal to the surface
SLACK = 0.5, 0.05  # their share along the surface
BAD = 0.1  # scaled Jacobian of a bad hex after a short registration
RELEASED = 0.2  # scaled Jacobian below which the springs of a hex are released
RATIO = 1.4  # ratio of the sizes of a mesh and the next coarser one


@dataclass(frozen=True)
class ShortQuality:
    """Quality of a structure after a few rounds; lengths in per cent of the diagonal."""

    to_surface: float  # 98th percentile of the boundary vertices
    to_mesh: float  # 98th percentile of points of the surface
    bad: float  # share of hexes with a scaled Jacobian below BAD
    mean_jacobian: float
    min_jacobian: float
    volume_ratio: float  # of the mesh, relative to the surface


def register_mesh(
    mesh: HexMesh,
    target: Target,
    rounds: int = 25,
    iterations: int = 25,
    samples: int = 2500,
    *,
    alpha: Range = TURN,
    weight: Range = WEIGHT,
    slack: Range = SLACK,
    coverage: float = 0.5,
    features: bool = False,
) -> HexMesh:
    """The mesh fitted to the target, in model units.

    rounds, iterations : number of rounds of matching, and of iterations in each
    samples : points of the surface that are matched with the mesh
    alpha : weight of the difference of unit normals, a length in diagonals
    weight, slack : of the springs normal to the surface, and their share along the surface
    coverage : weight of the springs from points of the surface
    features : match the curves of the surface first: vertices on their paths go to the curves, all
        others to the CAD face that the paths enclose
    """
    problem = FitProblem(mesh, target, samples)
    x = target.to_unit(mesh.vertices)
    matching = match(problem, x) if features else no_features()
    is_matched = np.zeros(len(x), bool)
    is_matched[np.append(matching.curve, matching.corner)] = True
    trust = np.ones(len(x))
    for step in np.linspace(0, 1, rounds):
        turn, pulling, loose = (between(ends, step) for ends in (alpha, weight, slack))
        normals, quad_normals = problem.normals(x)
        foot, facing = problem.feet(x, normals, turn)
        strength = pulling * trust / problem.size(x) ** 2
        on = np.where(is_matched, 0.0, strength)[problem.outer]
        springs = [
            pull(problem.outer, foot, facing, on, loose * on),
            *along_curves(x, matching, strength),
            problem.cover(x, quad_normals, turn, coverage * pulling * trust, loose),
        ]
        x = problem.relax(x, problem.lengths(x, *RESHAPED), Terms(), springs, iterations)
        trust = adjusted(trust, problem.touching(problem.scaled_jacobian(x) < RELEASED))
    worst = problem.scaled_jacobian(x).min()
    logger.info("register: %d hexes, smallest scaled Jacobian %.3f", len(mesh.hexes), worst)
    return replace(mesh, vertices=target.to_model(x))


def matched_curves(mesh: HexMesh, target: Target) -> int:
    """Number of curves of the surface that have a path on the edges of a mesh close to it."""
    return len(match(FitProblem(mesh, target, 1), target.to_unit(mesh.vertices)).routes)


def short_quality(mesh: HexMesh, target: Target) -> ShortQuality:
    """Measure a mesh after a short registration."""
    problem = FitProblem(mesh, target, 2500)
    x = target.to_unit(mesh.vertices)
    normals, quad_normals = problem.normals(x)
    foot, _ = problem.feet(x, normals, ALPHA)
    jacobian = problem.scaled_jacobian(x)
    return ShortQuality(
        to_surface=_per_cent(x[problem.outer] - foot),
        to_mesh=_per_cent(problem.cover(x, quad_normals, 0.0, np.ones(len(x)), 0.0).gaps(x)),
        bad=float((jacobian < BAD).mean()),
        mean_jacobian=float(jacobian.mean()),
        min_jacobian=float(jacobian.min()),
        volume_ratio=volume(mesh) / (surfaces.volume(target.surface) * target.scale**3),
    )


def _per_cent(gaps: np.ndarray) -> float:
    return 100 * float(np.percentile(np.linalg.norm(gaps, axis=1), 98))


def cascade(
    polycube: Polycube,
    rough_map: RoughMap,
    target: Target,
    size: float,
    coarse: float,
    features: bool = False,
) -> RoughMap:
    """Register the rough map at decreasing sizes, from `coarse` to the last one coarser than
    `size`.

    size, coarse : lengths in model units; if `size` is close to `coarse`, the map is returned
        unchanged
    features : whether mesh edges follow the curves of the surface
    """
    placed = rough_map
    for level in range(round(np.log(coarse / size) / np.log(RATIO))):
        parts = counts(polycube, rough_map, coarse / RATIO**level)
        placed = registered_map(polycube, placed, target, parts, features)
    return placed


def registered_map(
    polycube: Polycube, rough_map: RoughMap, target: Target, parts: PerAxis, features: bool = False
) -> RoughMap:
    """Rough map after a registration of hexes with the given parts per interval."""
    start = mesh(polycube, rough_map, parts)
    coarse = register_mesh(start, target, rounds=15, iterations=15, samples=1500, features=features)
    return map_through(polycube, rough_map, parts, coarse.vertices)
