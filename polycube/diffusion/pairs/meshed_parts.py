"""A part and its polycube, from a hex mesh that was made from the polycube.

Every boundary quad has the number of its polycube face. Corners of the polycube are vertices where
faces of three axes meet. The edges between them are parametrised by length, and the interior of a
face by mean-value coordinates (Floater 2003), which do not leave the face. If the part is the
polycube itself, this is the identity.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import isotonic_regression
from scipy.sparse import csr_matrix

from polycube.charts.harmonic import extend, mean_value
from polycube.diffusion.encoding import learning_frame
from polycube.diffusion.pairs.any_structure import Part
from polycube.diffusion.pairs.lattices import MOST_SLABS
from polycube.diffusion.pairs.tessellation import Tessellation
from polycube.hexmesh.connectivity import quad_edges
from polycube.structure.lattice import OUTWARD, boundary, collapse, exposed, genus
from polycube.structure.projection import project_onto
from polycube.surface.measures import triangle_vectors
from polycube.types import HexMesh, PerAxis, Polycube

STYLE = "meshed"
NARROWEST = 0.06  # smallest width of a slab, in the learning frame
MOST_FOLDED = 0.01  # of the area of the polycube: largest area that is covered more than once
TILTED = 60  # largest angle in degrees between a normal and the axis of its label


class _Faces(NamedTuple):
    """Boundary quads and their faces of the collapsed polycube."""

    quads: np.ndarray  # (Q, 4)
    axis: np.ndarray  # (Q,) 0..5
    knot: np.ndarray  # (Q,)

    @property
    def triangles(self) -> np.ndarray:
        """(2 Q, 3) the two triangles of each quad."""
        return self.quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)


def meshed_part(hexes: HexMesh, polycube: Polycube) -> Part:
    """The boundary of a hex mesh with its polycube, both in the learning frame.

    The part is rotated so that its normals are aligned with the axes of their labels as closely as
    possible. A knot is the mean coordinate of the surface on its plane, weighted by area.

    hexes : a valid mesh, whose `patch` is the number of the polycube face

    Raises ValueError with the reason if the pair is not suitable for training.
    """
    solid = collapse(polycube)
    if max(solid.occupancy.shape) > MOST_SLABS:
        slabs = " x ".join(map(str, solid.occupancy.shape))
        raise ValueError(f"the polycube has {slabs} slabs, more than {MOST_SLABS} along an axis")
    used, quads = np.unique(hexes.quads, return_inverse=True)
    faces = _Faces(quads.reshape(-1, 4), *_labels(hexes.patch, polycube, solid))
    x = hexes.vertices[used]
    x = x @ _rotation(x, faces).T
    x = learning_frame(x).apply(x)
    solid = Polycube(solid.occupancy, *_knots(x, faces, solid), (1, 1, 1), ("lattice",))
    places = _places(x, faces, solid)
    labels = faces.axis.repeat(2), faces.knot.repeat(2)
    surface = Tessellation(places, faces.quads, faces.triangles, *labels)
    check_cover(surface, solid)
    return Part(x, surface, solid, genus(solid), STYLE)


def tilted(part: Part, degrees: float = TILTED) -> float:
    """Share of the area of a part whose angle to the axis of its label is larger."""
    vectors = triangle_vectors(part.geometry[part.surface.faces])
    area = np.linalg.norm(vectors, axis=1)
    along = np.einsum("fk,fk->f", vectors, OUTWARD[part.surface.axis])
    return float(area[along < np.cos(np.radians(degrees)) * area].sum() / area.sum())


def _labels(patch: np.ndarray, given: Polycube, solid: Polycube) -> tuple[np.ndarray, np.ndarray]:
    """Axis (Q,) and knot number (Q,) on the collapsed polycube, for patches of the given one."""
    outside = boundary(given)
    _, first = np.unique(outside.patch, return_index=True)
    axis = outside.axis[first][patch]
    corner = outside.vertices[outside.quads[first, 0]][patch]
    knot = np.zeros(len(patch), np.int64)
    for a, knots in enumerate(solid.knots):
        own = axis // 2 == a
        knot[own] = np.searchsorted(knots, corner[own, a])
    return axis, knot


def _rotation(x: np.ndarray, faces: _Faces) -> np.ndarray:
    """(3, 3) rotation that maximises the sum of products of area vectors and axes of labels."""
    vectors = triangle_vectors(x[faces.triangles])
    u, _, vt = np.linalg.svd(OUTWARD[faces.axis.repeat(2)].T @ vectors)
    return u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt


def _knots(x: np.ndarray, faces: _Faces, solid: Polycube) -> PerAxis:
    """Knots of the slabs, centred, the longest edge 2: the means of the planes, made ascending."""
    corners = x[faces.triangles]
    area = np.linalg.norm(triangle_vectors(corners), axis=1)
    axis, knot = faces.axis.repeat(2) // 2, faces.knot.repeat(2)
    found = []
    for a, n in enumerate(solid.occupancy.shape):
        own = axis == a
        weight = np.bincount(knot[own], area[own], n + 1)
        total = np.bincount(knot[own], area[own] * corners[own, :, a].mean(axis=1), n + 1)
        if not (weight > 0).all():
            raise ValueError("a face of the polycube is not on the mesh")
        least = NARROWEST * np.arange(n + 1)
        knots = isotonic_regression(total / weight - least, weights=weight).x + least
        found.append(knots - (knots[0] + knots[-1]) / 2)
    x, y, z = (knots / max(k[-1] for k in found) for knots in found)
    return x, y, z


def _places(x: np.ndarray, faces: _Faces, solid: Polycube) -> np.ndarray:
    """(V, 3) positions of the vertices on the polycube."""
    planes, is_fixed = _planes(len(x), faces, solid)
    ends, sides = quad_edges(faces.quads)
    plane = faces.axis * (MOST_SLABS + 1) + faces.knot
    ends = ends[plane[sides[:, 0]] != plane[sides[:, 1]]]
    near = 1 / np.linalg.norm(x[ends[:, 0]] - x[ends[:, 1]], axis=1)
    rows, columns = np.concatenate([ends, ends[:, ::-1]]).T
    along = csr_matrix((np.append(near, near), (rows, columns)), shape=(len(x), len(x)))
    n_fixed = is_fixed.sum(axis=1)
    try:
        places = extend(along, planes, fixed=n_fixed != 2)
    except RuntimeError:
        raise ValueError("an edge of the polycube has no ends on the mesh") from None
    inside = mean_value(x[faces.triangles], faces.triangles, len(x))
    places = np.where(is_fixed, planes, extend(inside, places, fixed=n_fixed > 1))
    free = n_fixed == 1
    places[free] = _on_own_face(places[free], planes[free], is_fixed[free], solid)
    return places


def _planes(n: int, faces: _Faces, solid: Polycube) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (n, 3) of the planes of vertices, 0 if there is none; whether there is one."""
    low, high = np.full((n, 3), np.inf), np.full((n, 3), -np.inf)
    for a, knots in enumerate(solid.knots):
        own = faces.axis // 2 == a
        at, value = faces.quads[own].ravel(), knots[faces.knot[own]].repeat(4)
        np.minimum.at(low[:, a], at, value)
        np.maximum.at(high[:, a], at, value)
    is_fixed = low <= high
    if (low[is_fixed] < high[is_fixed]).any():
        raise ValueError("two opposite faces of the polycube meet on the mesh")
    return np.where(is_fixed, low, 0.0), is_fixed


def _on_own_face(
    places: np.ndarray, planes: np.ndarray, is_fixed: np.ndarray, solid: Polycube
) -> np.ndarray:
    """Closest positions (N, 3) on the faces in the single plane of each point.

    A face may have notches, so that a mean of its points can lie outside.
    """
    outside = boundary(solid)
    normal, own = outside.axis // 2, is_fixed.argmax(axis=1)
    height = outside.vertices[outside.quads[:, 0], normal]
    same = (own[:, None] == normal) & (planes[np.arange(len(own)), own][:, None] == height)
    return project_onto(outside, places, np.where(same, 0.0, np.inf))[0]


def check_cover(surface: Tessellation, solid: Polycube) -> None:
    """Raise ValueError unless a surface covers every plane of the polycube once."""
    vectors = triangle_vectors(surface.vertices[surface.faces])
    area = np.einsum("fk,fk->f", vectors, OUTWARD[surface.axis])
    covered, wanted = np.zeros((2, 6, MOST_SLABS + 1))
    np.add.at(covered, (surface.axis, surface.knot), area)
    axis, box = exposed(solid.occupancy)
    number, normal = np.arange(len(box)), axis // 2
    widths = [np.diff(knots) for knots in solid.knots]
    sides = np.stack([w[b] for w, b in zip(widths, box.T, strict=True)], axis=1)
    sides[number, normal] = 1
    np.add.at(wanted, (axis, box[number, normal] + 1 - axis % 2), sides.prod(axis=1))
    if np.abs(covered - wanted).max() > 1e-9:
        raise ValueError("faces are not arranged as those of the polycube")
    folded = float(-area[area < 0].sum() / wanted.sum())
    if folded > MOST_FOLDED:
        raise ValueError(f"{folded:.1%} of the polycube is covered by folds of the surface")
