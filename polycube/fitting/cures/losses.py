"""Features of a part that a mesh loses, updated while parts of the mesh move.

The samples of a feature are those of `polycube.hexmesh.feature_distances`. Cures in an envelope
require that more of them are close: they move curves to the permitted distance, and others use
other samples.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from polycube.hexmesh.feature_distances import MOST, feature_sizes, points_of
from polycube.hexmesh.inspection import SAMPLES
from polycube.hexmesh.quality import triangles
from polycube.surface import closest
from polycube.surface.fit_target import Target
from polycube.surface.measures import half_edges
from polycube.types import Goal, HexMesh

POINT, CURVE, FACE = range(3)
SHARES = MOST, 98.0  # per cent of close samples: in the report, and after a cure in an envelope
ROUND = 0.01  # in diagonals: features farther from moved vertices than this are not updated


@dataclass(frozen=True, eq=False)
class Samples:
    """Points on the features of a part."""

    points: np.ndarray  # (S, 3) at unit scale
    kind: np.ndarray  # (S,) kind of the feature
    feature: np.ndarray  # (S,) number of the feature, from 0
    # (S,) the largest permitted distance of all features, divided by that of the feature
    factor: np.ndarray


@lru_cache(maxsize=2)
def samples_of(target: Target) -> Samples:
    """Points on all corners, curves and CAD faces of a target."""
    corners = [target.features.corners[[end]] for end in points_of(target.features)]
    curves = [crease.samples for crease in target.features.creases]
    points, _, cad_face = target.samples(SAMPLES)
    faces = [points[cad_face == face] for face in np.unique(cad_face[cad_face > 0])]
    each = [*corners, *curves, *faces]
    kind = np.repeat([POINT, CURVE, FACE], [len(corners), len(curves), len(faces)])
    feature = np.repeat(np.arange(len(each)), [len(part) for part in each])
    factor = Goal.features / Goal().limit(np.concatenate(feature_sizes(target)))
    points = np.concatenate([np.zeros((0, 3)), *each])
    return Samples(points, kind[feature], feature, factor[feature])


def distances(
    mesh: HexMesh,
    samples: Samples,
    which: np.ndarray | slice = slice(None),
    near: np.ndarray | slice = slice(None),
) -> np.ndarray:
    """(S,) distances of corners from boundary vertices, curves from edges, faces from quads.

    They are multiplied by `factor`: the largest permitted distance is the same for all features.

    which : (S,) the samples; near : (Q,) the quads that are close to them
    """
    points, kind = samples.points[which], samples.kind[which]
    vertices, quads = mesh.vertices, mesh.quads[near]
    result = np.full(len(points), np.inf)
    if not len(quads):
        return result * samples.factor[which]
    pieces = (
        vertices[quads.ravel()][:, None].repeat(3, axis=1),
        vertices[half_edges(quads)[:, [0, 1, 1]]],
        triangles(vertices, quads),
    )
    for number, corners in enumerate(pieces):
        own = kind == number
        if own.any():
            result[own] = closest.distance(closest.tree(corners), points[own])
    return result * samples.factor[which]


def moved(before: np.ndarray, mesh: HexMesh, samples: Samples, where: np.ndarray) -> np.ndarray:
    """Update the distances after a part of the mesh has moved.

    before : (S,) distances from the mesh before
    where : (N, 3) old and new positions of the vertices of all moved hexes
    """
    low, high = where.min(axis=0) - ROUND, where.max(axis=0) + ROUND
    here = ((samples.points > low) & (samples.points < high)).all(axis=1)
    corner = mesh.vertices[mesh.quads]
    near = (corner.max(axis=1) > low - ROUND) & (corner.min(axis=1) < high + ROUND)
    after = before.copy()
    after[here] = distances(mesh, samples, here, near.all(axis=1))
    return after


def percentiles(distance: np.ndarray, feature: np.ndarray) -> np.ndarray:
    """(2, F) distances that SHARES of the samples of each feature do not exceed.

    distance, feature : (S,) of each sample; features are numbered from 0
    """
    count = np.bincount(feature)
    end = np.cumsum(count)
    ordered = distance[np.lexsort((distance, feature))]
    far = 1 - np.array(SHARES)[:, None] / 100
    last = end - 1 - far * (count - 1)  # as in numpy.percentile
    low, share = np.floor(last).astype(int), np.mod(last, 1)
    return (1 - share) * ordered[low] + share * ordered[np.minimum(low + 1, end - 1)]
