"""Measurements of a hex mesh compared with the surface for which it was made.

Distances are exact closest-point distances at sample points, in both directions, as fractions of
the diagonal of the bounding box. They do not show the loss of a thin wall: a missing web of 4 mm in
a beam of 320 mm is 1 % of the diagonal. The largest distances are therefore also compared with the
wall thickness of the solid and with the edge length of the hexes at the same place.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from polycube.hexmesh import quality
from polycube.hexmesh.cad_faces import quad_regions
from polycube.hexmesh.crossings import crossings
from polycube.hexmesh.feature_distances import Feature, feature_distances
from polycube.hexmesh.named_sets import face_set
from polycube.hexmesh.quality import Deviation, Samples
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.surface import measures
from polycube.surface.feature_size import thickness
from polycube.surface.fit_target import target
from polycube.types import HexMesh, TriMesh

SAMPLES = 8000  # points on the surface, in addition to its vertices
CELL = 0.02  # of the diagonal: only the farthest sample of each cell is compared with the wall
PLACES = 128  # largest number of samples compared with the wall, in each direction
TINY = 1e-9  # of the diagonal: assumed edge length of a collapsed quad


# offsets from each sample to the points at which the thickness is measured; the median is used, so
# that folds of the surface have no effect
AROUND = 0.006 * np.array([[0, 0, 0], [1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])


@dataclass(frozen=True)
class LocalDistance:
    """A distance between mesh and surface, and a length of the part at the same place."""

    distance: float  # in model units
    length: float  # wall thickness or hex edge length there, in model units
    # on the surface or the boundary of the mesh, in model coordinates
    place: tuple[float, float, float]

    @property
    def share(self) -> float:
        """Distance divided by length."""
        return self.distance / self.length


@dataclass(frozen=True, eq=False)
class Inspection:
    """Measurements of a hex mesh; each is computed at first access."""

    mesh: HexMesh
    surface: TriMesh  # the closed surface that the mesh should fill

    @cached_property
    def scaled_jacobian(self) -> float:
        """Smallest scaled Jacobian of a hex; at most 0 if a hex is inverted or flat."""
        return float(scaled_jacobian(self.mesh.vertices, self.mesh.hexes).min())

    @cached_property
    def crossings(self) -> np.ndarray:
        """(N, 2) pairs of boundary quads that cross or touch each other."""
        return crossings(self.mesh)

    @property
    def is_sound(self) -> bool:
        """Whether all scaled Jacobians are positive and the boundary does not cross itself."""
        return self.scaled_jacobian > 0 and not len(self.crossings)

    @cached_property
    def deviation(self) -> Deviation:
        """Distances between boundary and surface, both directions, as fractions of the diagonal."""
        return quality.deviation_of(self._on_boundary, self._on_surface)

    @cached_property
    def farthest(self) -> tuple[np.ndarray, np.ndarray]:
        """The points (3,) of the boundary and of the surface with the largest distances."""
        goal = target(self.surface)
        both = self._on_boundary, self._on_surface
        first, second = (goal.to_model(each.points[each.distance.argmax()]) for each in both)
        return first, second

    @property
    def largest(self) -> float:
        """Largest distance in both directions, as a fraction of the diagonal."""
        return max(self.deviation.to_surface.largest, self.deviation.to_mesh.largest)

    @property
    def farthest_at(self) -> np.ndarray:
        """(3,) point of the boundary or the surface with the largest distance."""
        return self.farthest[int(self.deviation.to_mesh.largest >= self.largest)]

    @cached_property
    def creases(self) -> float:
        """95th percentile of the distance of creases from mesh edges, in diagonals."""
        return quality.creases_to_edges(self.mesh, self.surface)

    @cached_property
    def volume_ratio(self) -> float:
        """Volume of the mesh divided by the volume inside the surface."""
        return quality.volume(self.mesh) / measures.volume(self.surface)

    @cached_property
    def off_wall(self) -> LocalDistance:
        """The distance that is the largest share of the wall thickness at its place."""
        found = [_farthest_of_cells(samples) for samples in (self._on_boundary, self._on_surface)]
        on_surface = np.concatenate([found[0].feet, found[1].points])
        around = target(self.surface).to_model((AROUND[:, None] + on_surface).reshape(-1, 3))
        walls = thickness(self.surface, around).reshape(len(AROUND), -1)
        return self._worst(found, np.median(walls, axis=0))

    @cached_property
    def off_size(self) -> LocalDistance:
        """The distance that is the largest share of the mean edge length of the closest quad."""
        corners = self.mesh.vertices[self.mesh.quads]
        edge = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).mean(axis=1)
        both = [self._on_boundary, self._on_surface]
        return self._worst(both, np.concatenate([edge[samples.quad] for samples in both]))

    @cached_property
    def features(self) -> list[Feature]:
        """Points, curves and faces of a CAD part with their distances; empty without CAD faces."""
        if not len(self.surface.region):
            return []
        numbers = target(self.surface).samples(SAMPLES)[2]
        distance = self._on_surface.distance[: len(numbers)]  # the vertices follow
        nearest = {n: distance[numbers == n] for n in np.unique(self.surface.region).tolist()}
        return feature_distances(self.mesh, self.surface, nearest)

    @property
    def n_lost_features(self) -> int:
        """Number of points, curves and faces of a CAD part that are lost by the default limits."""
        return sum(feature.is_lost for feature in self.features)

    @cached_property
    def faces_without_quads(self) -> dict[int, float]:
        """CAD faces without a boundary quad, and their mean widths as shares of the diagonal."""
        surface, widths = self.surface, {}
        if not len(surface.region):
            return {}
        for number in np.setdiff1d(surface.region, quad_regions(self.mesh, surface)[0]).tolist():
            own = surface.region == number
            ends = surface.vertices[measures.open_edges(surface.faces[own])]
            border = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()
            width = 2 * measures.face_areas(surface)[own].sum() / border if border else np.inf
            widths[number] = float(width / measures.diagonal(surface))
        return widths

    @property
    def lost_faces(self) -> tuple[str, ...]:
        """CAD faces without a boundary quad: the name in the CAD file if unique, or the set."""
        names = self.surface.region_names
        unique = {n: name for n, name in enumerate(names, 1) if name and names.count(name) == 1}
        return tuple(unique.get(n, face_set(self.surface, n)) for n in self.faces_without_quads)

    @cached_property
    def _on_boundary(self) -> Samples:
        return quality.boundary_samples(self.mesh, self.surface)

    @cached_property
    def _on_surface(self) -> Samples:
        return quality.surface_samples(self.mesh, self.surface, SAMPLES)

    def _worst(self, samples: list[Samples], lengths: np.ndarray) -> LocalDistance:
        """The largest ratio of distance and length (N,) over the points of all samples."""
        goal = target(self.surface)
        distance = goal.scale * np.concatenate([each.distance for each in samples])
        lengths = np.maximum(lengths, TINY * goal.scale)
        worst = int(np.argmax(distance / lengths))
        x, y, z = goal.to_model(np.concatenate([each.points for each in samples])[worst]).tolist()
        return LocalDistance(float(distance[worst]), float(lengths[worst]), (x, y, z))


@lru_cache(maxsize=4)
def inspect(mesh: HexMesh, surface: TriMesh) -> Inspection:
    """Inspect a hex mesh and the closed surface that it should fill.

    The result is cached for the same objects; its measurements are computed at first access.
    """
    return Inspection(mesh, surface)


def _farthest_of_cells(samples: Samples) -> Samples:
    """The farthest sample of each grid cell, for the PLACES cells with the largest distances."""
    far = np.argsort(-samples.distance, kind="stable")
    cell = np.floor(samples.points[far] / CELL)
    far = far[np.sort(np.unique(cell, axis=0, return_index=True)[1])[:PLACES]]
    return Samples(samples.points[far], samples.feet[far], samples.distance[far], samples.quad[far])
