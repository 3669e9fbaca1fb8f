"""Bring the boundary of a hex mesh onto a surface, untangle it and keep the hexes in shape.

Rounds of descent of

    sum_frames f(J)  +  sum_v w/h^2 [(n . r)^2 + slack |r|^2]  +  the same from the surface's side

with r from a boundary vertex to its foot, the closest point whose normal suits.  The weight w
grows, the slack and the share alpha of the normals shrink; the pull lets go round bad hexes.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np

from polycube.fitting.body import Body
from polycube.hexmesh.energy import Springs, Terms, pull
from polycube.hexmesh.quality import volume
from polycube.surface import surface as surfaces
from polycube.surface.target import Target
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

Range = tuple[float, float]  # value in the first round and in the last, geometric between


@dataclass(frozen=True)
class ShortQuality:
    """What a few rounds tell about a structure; lengths in per cent of the diagonal."""

    to_surface: float  # 98th percentile from the boundary vertices
    to_mesh: float  # 98th percentile from points of the surface
    bad: float  # share of hexes with a scaled Jacobian below 0.1
    mean_jacobian: float
    min_jacobian: float
    volume_ratio: float  # of the mesh to the surface


def register(
    mesh: HexMesh,
    target: Target,
    rounds: int = 25,
    iterations: int = 25,
    samples: int = 2500,
    *,
    alpha: Range = (0.15, 0.04),
    weight: Range = (0.3, 20.0),
    slack: Range = (0.5, 0.05),
    coverage: float = 0.5,
) -> HexMesh:
    """The mesh fitted to the target, in model units like the one given.

    rounds, iterations : of matching, and of descent in each
    samples : points of the surface that look for the mesh
    alpha : length that a whole turn of the normal is worth, in diagonals
    weight, slack : of the pull across the surface, and the share of it along the surface
    coverage : weight of the pull from the surface's side
    """
    body = Body(mesh, target, samples)
    x = target.to_unit(mesh.vertices)
    trust = np.ones(len(x))
    for step in np.linspace(0, 1, rounds):
        turn, pulling, loose = (_between(r, step) for r in (alpha, weight, slack))
        normals, quad_normals = body.normals(x)
        springs = [
            onto(body, x, normals, turn, pulling * trust, loose),
            body.cover(x, quad_normals, turn, coverage * pulling * trust, loose),
        ]
        x = body.relax(x, body.lengths(x, 3, 0.1), Terms(), springs, iterations)
        bad = body.touching(body.scaled_jacobian(x) < 0.2)
        trust = np.where(bad, np.maximum(0.4 * trust, 0.02), np.minimum(1.3 * trust, 1))
    worst = body.scaled_jacobian(x).min()
    logger.info("register: %d hexes, least scaled Jacobian %.3f", len(mesh.hexes), worst)
    return replace(mesh, vertices=target.to_model(x))


def onto(
    body: Body, x: np.ndarray, normals: np.ndarray, alpha: float, weight: np.ndarray, slack: float
) -> Springs:
    """Springs from the boundary vertices to their feet; weight (V,) per square of the size."""
    foot, facing = body.feet(x, normals, alpha)
    strength = (weight / body.size(x) ** 2)[body.outer]
    return pull(body.outer, foot, facing, strength, slack * strength)


def short_quality(mesh: HexMesh, target: Target) -> ShortQuality:
    """Measure a mesh after a short registration."""
    body = Body(mesh, target, 2500)
    x = target.to_unit(mesh.vertices)
    normals, quad_normals = body.normals(x)
    foot, _ = body.feet(x, normals, 0.04)
    springs = body.cover(x, quad_normals, 0.0, np.ones(len(x)), 0.0)
    reached = np.einsum("sk,skd->sd", springs.share, x[springs.vertex])
    jacobian = body.scaled_jacobian(x)
    return ShortQuality(
        to_surface=_per_cent(x[body.outer] - foot),
        to_mesh=_per_cent(reached - springs.goal),
        bad=float((jacobian < 0.1).mean()),
        mean_jacobian=float(jacobian.mean()),
        min_jacobian=float(jacobian.min()),
        volume_ratio=volume(mesh) / (surfaces.volume(target.surface) * target.scale**3),
    )


def _between(ends: Range, step: float) -> float:
    return ends[0] * (ends[1] / ends[0]) ** step


def _per_cent(gaps: np.ndarray) -> float:
    return 100 * float(np.percentile(np.linalg.norm(gaps, axis=1), 98))
