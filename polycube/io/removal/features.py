"""Holes and fillets of a CAD solid, in the worker process of gmsh."""

from collections.abc import Callable, Collection
from itertools import combinations
from types import ModuleType
from typing import NamedTuple

import numpy as np

from polycube.surface.measures import connected, frame, unit

SAME = 1e-6  # of the diagonal: closer points, axes and radii are equal
ANGLE = 1e-4  # sine of the largest angle between parallel axes
WHOLE, TURN = 6.0, 3.0  # least angle of a whole cylinder, largest turn of a fillet, in radians
TANGENT = 0.999  # least cosine of the angle between the normals of tangent faces
MANY, FINEST = 10, 50  # least number of points on a face, largest number of rows of points
PLACES = np.array([[0, 0], [np.pi, 0], [0, 1], [np.pi, 1], [0, np.pi]])  # parameters of a circle


class Feature(NamedTuple):
    """A hole of a diameter, a fillet of a radius, or another detail, and its faces."""

    kind: str
    size: float
    faces: set[int]


class Solid:
    """The faces of a solid in gmsh, by their tags: kinds, points, edges and axes."""

    def __init__(self, gmsh: ModuleType, tag: int, diagonal: float) -> None:
        self.model, self.tag, self.near = gmsh.model, tag, SAME * diagonal
        self.kind = {face: gmsh.model.getType(2, face) for face in faces_of(gmsh, tag)}
        self.sides: dict[int, set[int]] = {}  # faces at each edge
        for face in self.kind:
            for _, edge in gmsh.model.getBoundary([(2, face)], oriented=False):
                self.sides.setdefault(edge, set()).add(face)
        self.points = {face: self._at(face, self._inside(face)) for face in self.kind}
        # of cylinders, cones, spheres and tori: a point of the axis, its direction, and the radius
        self.axis: dict[int, tuple[np.ndarray, np.ndarray, float]] = {}
        for face in self._of("Cylinder", "Cone", "Sphere", "Torus"):
            a, b, c, d, e = self._at(face, PLACES)
            size = np.linalg.norm((e if self.kind[face] == "Torus" else b) - a) / 2
            self.axis[face] = (a + b) / 2, unit(c + d - a - b), float(size)

    def features(self, holes: float | None, fillets: float | None) -> list[Feature]:
        """Holes up to a diameter, connected fillets up to a radius; faces are given by tags."""
        cylinders = self.groups(self._of("Cylinder"), self._is_same)
        found = self._holes(cylinders, holes + self.near) if holes else []
        if not fillets:
            return found
        rounds = [each for each in cylinders if self._turn(each) < TURN]
        rounds += [{f} for f in self._of("Torus") if np.ptp(self._bounds(f), axis=0)[1] < TURN]
        rounds += [{face} for face in self._of("Sphere")]
        rounds = [own for own in rounds if self.axis[min(own)][2] <= fillets + self.near]
        small = set().union(*(own for own in rounds if self._is_tangent(own)))
        sizes = ((max(self.axis[f][2] for f in own), own) for own in self.groups(small))
        return found + [Feature("fillet", size, own) for size, own in sizes]

    def _holes(self, cylinders: list[set[int]], largest: float) -> list[Feature]:
        """Whole hollow cylinders, with what is inside them, and cones and rounds at their ends."""
        walls = [g for g in cylinders if self._turn(g) > WHOLE and self._is_hollow(min(g))]
        drilled = [g for g in walls if 2 * self.axis[min(g)][2] <= largest]
        parts = self.groups(self.kind.keys() - set().union(*drilled))
        wider = set().union(*walls) - set().union(*drilled)
        found = []
        for wall in drilled:
            first, own = min(wall), set(wall)
            for part in parts:
                if part & self._beside(wall) and self._is_within(part, first):
                    own |= part
            for end in self._beside(own):
                is_coaxial = end in self.axis and self._is_coaxial(first, end)
                if is_coaxial and self.kind[end] != "Cylinder" and self._is_hollow(end):
                    # the bottom of a wider hole belongs to that hole
                    if not any(self._is_coaxial(first, f) for f in self._beside({end}) & wider):
                        own.add(end)
            found.append(Feature("hole", 2 * self.axis[first][2], own))
        return found

    def _at(self, face: int, places: np.ndarray) -> np.ndarray:
        """(N, 3) points at parameters (N, 2) of the surface of a face, also outside the face."""
        return np.reshape(self.model.getValue(2, face, np.ravel(places)), (-1, 3))

    def _bounds(self, face: int) -> np.ndarray:
        return np.array(self.model.getParametrizationBounds(2, face))

    def _inside(self, face: int, rows: int = 5) -> np.ndarray:
        """(N, 2) parameters of points on a face."""
        low, high = self._bounds(face)
        steps = low + (high - low) * ((np.arange(rows) + 0.5) / rows)[:, None]
        grid = np.stack(np.meshgrid(*steps.T), axis=-1).reshape(-1, 2)
        found = [x for x in grid if self.model.isInside(2, face, x, parametric=True)]
        is_enough = len(found) >= MANY or rows > FINEST
        return np.reshape(found, (-1, 2)) if is_enough else self._inside(face, 3 * rows)

    def _of(self, *kinds: str) -> list[int]:
        return [face for face, kind in self.kind.items() if kind in kinds]

    def groups(
        self, faces: Collection[int], same: Callable[[int, int], bool] = lambda one, other: True
    ) -> list[set[int]]:
        """Faces that are connected over edges between faces that are the same."""
        own = sorted(faces)
        pairs = [p for each in self.sides.values() for p in combinations(each.intersection(own), 2)]
        linked = np.searchsorted(own, np.reshape([p for p in pairs if same(*p)], (-1, 2)))
        label = connected(linked[:, 0], linked[:, 1], len(own))
        return [{own[i] for i in np.flatnonzero(label == n)} for n in np.unique(label)]

    def _beside(self, faces: set[int]) -> set[int]:
        return set().union(*(own for own in self.sides.values() if own & faces)) - faces

    def _is_coaxial(self, one: int, other: int) -> bool:
        (a, u, _), (b, v, _) = self.axis[one], self.axis[other]
        off = np.linalg.norm(np.cross(b - a, u))
        return bool(off < self.near and np.linalg.norm(np.cross(u, v)) < ANGLE)

    def _is_same(self, one: int, other: int) -> bool:
        apart = abs(self.axis[one][2] - self.axis[other][2])
        return self._is_coaxial(one, other) and apart < self.near

    def _is_within(self, faces: set[int], wall: int) -> bool:
        """Whether faces are inside a cylinder that is extended without end."""
        point, axis, radius = self.axis[wall]
        off = np.cross(np.concatenate([self.points[face] for face in faces]) - point, axis)
        return bool(np.linalg.norm(off, axis=1).max() < radius + self.near)

    def _turn(self, faces: set[int]) -> float:
        """Angle that the faces of a cylinder cover."""
        point, axis, _ = self.axis[min(faces)]
        bounds = [(face, *self._bounds(face)) for face in faces]
        points = [self._at(face, np.linspace(low, high, 73) * [1, 0]) for face, low, high in bounds]
        x, y, _ = frame(axis) @ (np.concatenate(points) - point).T
        angles = np.sort(np.arctan2(y, x))
        return 2 * np.pi - float(np.diff(angles, append=angles[0] + 2 * np.pi).max())

    def _is_hollow(self, face: int) -> bool:
        """Whether the outer side of a face is that of its axis."""
        point, axis, _ = self.axis[face]
        middle = self._bounds(face).mean(axis=0)
        inward = point - self._at(face, middle)[0]
        return bool((inward - inward @ axis * axis) @ self.model.getNormal(face, middle) > 0)

    def _is_tangent(self, faces: set[int]) -> bool:
        """Whether two faces beside some faces have the same normal at a common edge."""
        found = set()
        for edge, own in self.sides.items():
            if own & faces and own - faces and len(own) == 2:
                middle = np.mean(self.model.getParametrizationBounds(1, edge))
                x = self.model.getValue(1, edge, [middle])
                places = [(face, self.model.getParametrization(2, face, x)) for face in own]
                one, other = (self.model.getNormal(*place) for place in places)
                found |= own - faces if abs(one @ other) > TANGENT else set()
        return len(found) > 1


def faces_of(gmsh: ModuleType, solid: int) -> list[int]:
    """Tags of the faces of a solid."""
    return sorted(tag for _, tag in gmsh.model.getBoundary([(3, solid)], oriented=False))
