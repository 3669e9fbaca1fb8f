"""Distances of the points, curves and faces of a CAD model from a hex mesh.

Curves are compared with the edges of the boundary quads, points with their corners, and faces with
the quads. These are the three measures of the HexMe benchmark (Beaufort et al. 2022).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from polycube.hexmesh.quality import boundary_edges
from polycube.surface import closest
from polycube.surface.curves.features import Features
from polycube.surface.fit_target import Target, target
from polycube.surface.measures import face_areas
from polycube.types import Goal, HexMesh, TriMesh

TOLERANCE = Goal.features  # of the diagonal: larger distances are never permitted
MOST = 95  # per cent of the samples that must be close


@dataclass(frozen=True)
class Feature:
    """A point, curve or face of a part, and its distance from a hex mesh."""

    kind: str  # "point", "curve" or "face"
    # for a curve "line", "circle" or "curve"; for a face "plane", "cylinder" etc.; for a point ""
    shape: str
    faces: tuple[int, ...]  # the CAD face, or the adjacent CAD faces
    place: tuple[float, ...]  # a point of the feature, in model units
    distance: float  # distance not exceeded by 95 % of its samples, as a fraction of the diagonal
    # half radius of a circle, extent of another curve, root of the area of a face; for a point, the
    # size of its smallest curve, as a fraction of the diagonal
    size: float

    def limit(self, goal: Goal) -> float:
        """Largest distance that a goal permits, as a fraction of the diagonal."""
        return float(goal.limit(self.size))

    def excess(self, goal: Goal) -> float:
        """Distance relative to the permitted one; the feature is lost if it is larger than 1."""
        return self.distance / self.limit(goal)

    def exceeds(self, goal: Goal) -> bool:
        """Whether the feature is lost."""
        return self.excess(goal) > 1

    @property
    def is_lost(self) -> bool:
        """Whether the feature is lost by the default limits."""
        return self.exceeds(Goal())


def feature_distances(
    mesh: HexMesh, surface: TriMesh, nearest: Mapping[int, np.ndarray]
) -> list[Feature]:
    """Measure the distance of each feature of a CAD part from a hex mesh.

    Points are those where at least three curves meet, and the tips of cones.

    nearest : for each CAD face, the distances (S,) of samples from the boundary of the mesh
    """
    goal = target(surface)
    creases, corners = goal.features.creases, goal.features.corners
    edges = closest.tree(boundary_edges(mesh, goal)[:, [0, 1, 1]])
    outer = goal.to_unit(mesh.vertices)[np.unique(mesh.quads)]
    vertices = closest.tree(np.repeat(outer[:, None], 3, axis=1))
    points, curves, faces = feature_sizes(goal)
    found = []
    for crease, size in zip(creases, curves, strict=True):
        places = crease.samples
        middle = goal.to_model(places[len(places) // 2])
        gaps = closest.distance(edges, places)
        found.append(_feature("curve", crease.shape, crease.faces, middle, gaps, size))
    for (end, own), size in zip(points_of(goal.features).items(), points, strict=True):
        around = sorted({face for number in own for face in creases[number].faces})
        gap = closest.distance(vertices, corners[[end]])
        found.append(_feature("point", "", around, goal.to_model(corners[end]), gap, size))
    for (face, gaps), size in zip(nearest.items(), faces, strict=True):
        own = surface.faces[surface.region == face]
        middle = surface.vertices[own[len(own) // 2]].mean(axis=0)
        shape = surface.region_shapes[face - 1] if surface.region_shapes else ""
        found.append(_feature("face", shape, [face], middle, gaps, size))
    return found


@lru_cache(maxsize=2)
def feature_sizes(goal: Target) -> tuple[list[float], list[float], list[float]]:
    """Sizes of the points, curves and faces of a CAD part, as fractions of the diagonal."""
    curves = [crease.size for crease in goal.features.creases]
    points = [min(curves[number] for number in own) for own in points_of(goal.features).values()]
    areas = np.bincount(goal.surface.region, face_areas(goal.surface))
    return points, curves, np.sqrt(areas[np.unique(goal.surface.region)]).tolist()


def points_of(features: Features) -> dict[int, list[int]]:
    """Corners of at least three curves, with these; tips of cones, with the borders of the cone."""
    at: dict[int, list[int]] = {}
    for number, crease in enumerate(features.creases):
        for end in crease.ends[: 2 * (not crease.is_loop)]:
            at.setdefault(end, []).append(number)
    found = {end: own for end, own in at.items() if len(own) >= 3}
    for tip, face in features.tips.items():
        found[tip] = [number for number, each in enumerate(features.creases) if face in each.faces]
    return found


def _feature(
    kind: str, shape: str, faces: Sequence[int], place: np.ndarray, gaps: np.ndarray, size: float
) -> Feature:
    distance = float(np.percentile(gaps, MOST)) if len(gaps) else 0.0
    return Feature(kind, shape, tuple(faces), tuple(place.tolist()), distance, size)
