"""Groups of faces of a closed surface with a name: its ends and its holes.

Faces with one label (a patch or a CAD face) are divided at sharp edges into segments, and these
into pieces whose normals are closest to the same axis direction. An end such as `x_min` consists of
the outermost pieces whose normals point to -x; in a CAD model, of whole CAD faces. A hole consists
of pieces that meet at concave edges and surround an axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_matrix

from polycube.surface.measures import connected, twins
from polycube.types import TriMesh

ENDS = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")
SHARP = np.cos(np.radians(50))  # between the normals of faces at an edge that divides a label
# of the area of its segment: smaller pieces may end in the middle of a smooth face
LARGE_SHARE = 0.5
FLAT, PART = 0.95, 0.2  # least mean normal of a smaller piece, and its least share of its segment
ROUND = 0.4  # smallest length of the mean normal towards an end, for a CAD face that is not flat
OUTERMOST = 0.05  # of the diagonal: largest distance of an end from the bounding box
LEVEL = 1e-3  # of the diagonal: pieces with a smaller difference are equally far out
OPPOSITE = 0.7  # smallest negative cosine between the normals of pieces that face each other
UPRIGHT = 0.7  # smallest sine between the normal of a wall and the axis of its hole
GAP = np.radians(170)  # largest angle between the normals of neighbouring walls of a hole
N_FLOORS = 12  # number of the largest pieces whose normals are tried as axis
CONCAVE = 0.02  # smallest mean sine of the concave angle between two pieces
GAUSS = 0.5 + np.sqrt(1 / 12) * np.array([-1, 1])  # two points on the unit interval


@dataclass(frozen=True, eq=False)
class Faces:
    """Measures of faces, or of unions of faces."""

    area: np.ndarray  # (N,) areas
    normal: np.ndarray  # (N, 3) mean normals over the area, of length 1 for flat faces
    middle: np.ndarray  # (N, 3) centroids

    def joined(self, group: np.ndarray) -> Faces:
        """Measures of the unions of the faces with the same number in `group` (N,), from 0."""
        size = (int(group.max()) + 1, len(group))
        add = coo_matrix((self.area, (group, np.arange(len(group)))), size).tocsr()
        area = np.asarray(add.sum(axis=1)).ravel().clip(np.finfo(float).tiny)
        return Faces(area, add @ self.normal / area[:, None], add @ self.middle / area[:, None])


@dataclass(frozen=True, eq=False)
class _Borders:
    """Pairs of faces that share an edge; a face adjacent to smaller ones may have no partner."""

    first: np.ndarray  # (P,)
    second: np.ndarray  # (P,)
    cosine: np.ndarray  # (P,) cosine between the normals
    inwards: np.ndarray  # (P,) sine of the concave angle


@dataclass(frozen=True, eq=False)
class _Cut:
    """A closed surface, divided into segments, and these into pieces with one axis direction."""

    corners: np.ndarray  # (N, 4, 3)
    measured: Faces  # measures of the faces
    borders: _Borders
    segment: np.ndarray  # (N,)
    piece: np.ndarray  # (N,)
    pieces: Faces

    @cached_property
    def size(self) -> float:
        """Diagonal of the bounding box."""
        return float(np.linalg.norm(np.ptp(self.corners, axis=(0, 1))))

    def reach(self, end: int, group: np.ndarray) -> np.ndarray:
        """Largest coordinate of each group of faces (N,) in the direction of an end."""
        out = np.full(int(group.max()) + 1, -np.inf)
        place = (2 * (end % 2) - 1) * self.corners[:, :, end // 2]
        np.maximum.at(out, group, place.max(axis=1))
        return out


def ends_and_holes(
    points: np.ndarray, faces: np.ndarray, label: np.ndarray
) -> dict[str, np.ndarray]:
    """Find the ends and the holes of a closed surface.

    Returns numbers of faces, ascending, by name: the existing ones of `ENDS`, then `hole_1` etc.,
    sorted by x, y and z of their centroids. No face has two of these names.

    points : (V, 3)
    faces : (N, 4) quads or (N, 3) triangles, indices of points, counter-clockwise from outside
    label : (N,) faces with different labels are never in one piece
    """
    cut = _cut(points, faces, label)
    names = _flat_ends(cut)
    names |= _holes(cut, np.concatenate([[], *names.values()]))
    return {name: np.flatnonzero(np.isin(cut.piece, own)) for name, own in names.items()}


def cad_ends_and_holes(surface: TriMesh) -> dict[str, np.ndarray]:
    """Find the ends and the holes of a CAD model; they consist of whole CAD faces.

    An end such as `x_min` consists of the flat faces with normal -x at the smallest x. If there are
    none, it consists of faces whose mean normal points to -x, such as half a cylinder. Returns
    numbers of CAD faces, ascending, by name, as in `ends_and_holes`.
    """
    cut = _cut(surface.vertices, surface.faces, surface.region)
    numbers, face = np.unique(surface.region, return_inverse=True)
    cad_faces = cut.measured.joined(face)
    ends = {}
    for end, name in enumerate(ENDS):
        out = cut.reach(end, face)
        towards = (2 * (end % 2) - 1) * cad_faces.normal[:, end // 2]
        is_outermost = out >= out.max() - LEVEL * cut.size
        own = np.flatnonzero(is_outermost & (facing(cad_faces.normal) == end))
        own = own[towards[own] >= (FLAT if (towards[own] >= FLAT).any() else ROUND)]
        if len(own):
            ends[name] = _farthest(cad_faces, own, end, cut.size)
    is_end = np.isin(face, np.concatenate([[], *ends.values()]))
    for name, walls in _holes(cut, cut.piece[is_end]).items():
        area = np.bincount(face, np.isin(cut.piece, walls) * cut.measured.area)
        ends[name] = np.flatnonzero(area > cad_faces.area / 2)
    return {name: numbers[own] for name, own in ends.items() if len(own)}


def facing(normal: np.ndarray) -> np.ndarray:
    """Index in `ENDS` of the axis direction closest to each normal (N, 3)."""
    return np.stack([-normal, normal], axis=-1).reshape(-1, 6).argmax(axis=1)


def measure(corners: np.ndarray) -> Faces:
    """Measures of bilinear faces (N, 4, 3), with 2 x 2 Gauss points each."""
    u, v = np.array([(u, v) for v in GAUSS for u in GAUSS]).T
    shape = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v])  # (4, 4)
    across = np.einsum("kg,nkd->ngd", np.stack([v - 1, 1 - v, v, -v]), corners)
    along = np.einsum("kg,nkd->ngd", np.stack([u - 1, -u, u, 1 - u]), corners)
    normal = np.cross(across, along).reshape(-1, 3)
    length = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(length, np.finfo(float).tiny)[:, None]
    points = np.einsum("kg,nkd->ngd", shape, corners).reshape(-1, 3)
    return Faces(length / 4, normal, points).joined(np.repeat(np.arange(len(corners)), 4))


def _cut(points: np.ndarray, faces: np.ndarray, label: np.ndarray) -> _Cut:
    corners = points[faces if faces.shape[1] == 4 else faces[:, [0, 1, 2, 2]]]
    measured = measure(corners)
    direction = facing(measured.normal)
    a, b = (half // faces.shape[1] for half in twins(faces))
    normal = measured.normal / np.linalg.norm(measured.normal, axis=1).clip(1e-300)[:, None]
    step = measured.middle[b] - measured.middle[a]
    inwards = ((normal[a] - normal[b]) * step).sum(axis=1)
    inwards /= np.linalg.norm(step, axis=1).clip(np.finfo(float).tiny)
    borders = _Borders(a, b, (normal[a] * normal[b]).sum(axis=1), inwards)
    is_smooth = (label[a] == label[b]) & (borders.cosine > SHARP)
    is_same = is_smooth & (direction[a] == direction[b])
    segment, piece = (connected(a[on], b[on], len(faces)) for on in (is_smooth, is_same))
    return _Cut(corners, measured, borders, segment, piece, measured.joined(piece))


def _flat_ends(cut: _Cut) -> dict[str, np.ndarray]:
    """Pieces of each end."""
    _, one = np.unique(cut.piece, return_index=True)  # one face of each piece
    direction = facing(cut.measured.normal)[one]
    share = cut.pieces.area / cut.measured.joined(cut.segment).area[cut.segment[one]]
    length = np.linalg.norm(cut.pieces.normal, axis=1)
    is_clear = (share >= LARGE_SHARE) | ((share >= PART) & (length >= FLAT))
    names = {}
    for end, name in enumerate(ENDS):
        out = cut.reach(end, cut.piece)
        own = is_clear & (direction == end) & (out >= out.max() - OUTERMOST * cut.size)
        if own.any():
            names[name] = _farthest(cut.pieces, np.flatnonzero(own), end, cut.size)
    return names


def _farthest(faces: Faces, own: np.ndarray, end: int, size: float) -> np.ndarray:
    """The faces among `own` whose centroids are outermost in the direction of an end."""
    far = (2 * (end % 2) - 1) * faces.middle[own, end // 2]
    return own[far >= far.max() - LEVEL * size]


def _holes(cut: _Cut, ends: np.ndarray) -> dict[str, np.ndarray]:
    """Pieces of each hole or pocket that belong to no end, in ascending order."""
    pieces, borders, n = cut.pieces, cut.borders, len(cut.pieces.area)
    is_end = np.isin(np.arange(n), ends)
    pair = np.sort(np.stack([cut.piece[borders.first], cut.piece[borders.second]], axis=1), axis=1)
    between = (pair[:, 0] != pair[:, 1]) & ~is_end[pair].any(axis=1)
    pairs, first, index = np.unique(pair[between] @ [n, 1], return_index=True, return_inverse=True)
    mean = np.bincount(index, borders.inwards[between]) / np.bincount(index).clip(1)
    smooth = (cut.segment[borders.first] == cut.segment[borders.second])[between][first]
    first, second = np.divmod(pairs[mean > np.where(smooth, -CONCAVE, CONCAVE)], n)
    group = connected(first, second, n)
    order = np.argsort(group, kind="stable")
    found = np.split(order, np.flatnonzero(np.diff(group[order])) + 1)
    found = [walls for walls in found if not is_end[walls].any() and _encloses(pieces, walls)]
    places = np.array([pieces.middle[walls].mean(axis=0) for walls in found]).reshape(-1, 3)
    rank = np.lexsort(np.round(places / (LEVEL * cut.size)).T[::-1])
    return {f"hole_{number}": found[k] for number, k in enumerate(rank, start=1)}


def _encloses(pieces: Faces, walls: np.ndarray) -> bool:
    """Whether pieces whose normals point to their centre, or to each other, surround an axis."""
    area, normal, middle = pieces.area[walls], pieces.normal[walls], pieces.middle[walls]
    normal = normal / np.linalg.norm(normal, axis=1).clip(1e-12)[:, None]
    least = np.linalg.eigh(normal.T * area @ normal)[1][:, 0]  # direction along a passage
    towards = normal @ middle.T > (normal * middle).sum(axis=1)[:, None]
    towards &= normal @ normal.T < -OPPOSITE
    is_opposite = (towards & towards.T).any(axis=1)
    for axis in [least, *normal[np.argsort(-area)[:N_FLOORS]]]:
        upright = np.linalg.norm(np.cross(normal, axis), axis=1) > UPRIGHT
        share = area * upright / (area @ upright).clip(np.finfo(float).tiny)
        is_inwards = is_opposite | ((normal * (share @ middle - middle)).sum(axis=1) > 0)
        x, y = np.linalg.svd(axis[None])[2][1:] @ normal[upright & is_inwards].T
        angle = np.sort(np.arctan2(y, x))
        if len(angle) > 2 and np.diff(np.append(angle, angle[0] + 2 * np.pi)).max() < GAP:
            return True
    return False
