"""Replace screw threads by cylinders.

The flanks of a thread are invariant under a screw motion: the normal n at each point x is
perpendicular to its velocity, n . (v + w x x) = 0, and w, v follow from an eigenvalue problem
(Pottmann and Wallner 2001, Computational Line Geometry, section 4.1). The cylinder is the one into
which the thread is cut: of the largest radius of a screw, and of the smallest of a threaded hole.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from polycube.errors import InputError
from polycube.io.polygons.division import triangulated
from polycube.surface.measures import area_vectors, between_faces, frame, half_edges, unit
from polycube.surface.repair.clean import compact
from polycube.surface.repair.holes import loops
from polycube.types import TriMesh

RESIDUAL = 0.03  # largest n . (v + w x x) of a flank, for unit velocities (root mean square)
UNIQUE = 3.0  # smallest ratio of this value for another motion to it
DEPTH = 0.1, 1.0  # limits of the depth, in pitches
LEAN = 0.1  # smallest mean cosine of the angle between the normals of a flank and the radius
RIM = 0.2  # smallest share of the border of a flank that is on the cylinder
CLOSE = 0.05  # of the depth of a thread: radii that differ by less are the same
STEEP = 3.0  # largest slope, along the axis, of a face that is extended to the cylinder
STEP = 0.02  # smallest angle between vertices at an end of the cylinder, in radians
ANALYTIC = {"plane", "cylinder", "cone", "sphere", "torus"}


@dataclass(frozen=True, eq=False)
class Thread:
    """Flanks on a common cylinder.

    frame : (3, 3) rotation; the last row is the direction of the axis
    point : (3,) on the axis
    pitch : of the thread
    flanks : numbers of their CAD faces
    radius : of the cylinder into which the thread is cut
    depth : of the thread; negative for a hole
    """

    frame: np.ndarray
    point: np.ndarray
    pitch: float
    flanks: tuple[int, ...]
    radius: float = 0.0
    depth: float = 0.0

    def polar(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Radii, angles and heights of points (N, 3)."""
        a, b, height = self.frame @ (x - self.point).T
        return np.hypot(a, b), np.arctan2(b, a), height

    def place(self, angle: np.ndarray, height: np.ndarray) -> np.ndarray:
        """Points (N, 3) on the cylinder."""
        flat = self.radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return np.column_stack([flat, height]) @ self.frame + self.point

    def leaning(self, normals: np.ndarray, angle: np.ndarray) -> np.ndarray:
        """(N,) radial components of vectors (N, 3) at some angles."""
        a, b, _ = self.frame @ normals.T
        return np.asarray(a * np.cos(angle) + b * np.sin(angle))

    def fitted(self, x: np.ndarray) -> "Thread":
        """With the axis and the radius of the cylinder through points (N, 3) close to it."""
        radius, angle, height = self.polar(x)
        x, y = np.cos(angle), np.sin(angle)
        columns = np.stack([x, y, height * x, height * y, np.ones(len(x))], axis=1)
        shift, more, tilt, turn, size = np.linalg.lstsq(columns, radius, rcond=None)[0]
        axis = unit(np.array([tilt, turn, 1.0])) @ self.frame
        point = self.point + np.array([shift, more, 0.0]) @ self.frame
        return replace(self, frame=frame(axis), point=point, radius=float(size))

    def is_coaxial(self, other: "Thread") -> bool:
        """Whether another flank belongs to the same cylinder."""
        near = CLOSE * abs(self.depth)
        is_parallel = abs(self.frame[2] @ other.frame[2]) > 1 - CLOSE**2
        is_near = self.polar(other.point[None])[0][0] < near > abs(self.radius - other.radius)
        return bool(is_parallel and is_near and self.depth * other.depth > 0)


def without_threads(surface: TriMesh, unit: str = "") -> tuple[TriMesh, list[str]]:
    """A surface with CAD faces, with cylinders instead of its threads, and what was replaced.

    unit : unit of the lengths, for these sentences
    """
    found: list[Thread] = []
    for flank in _flanks(surface):
        same = [i for i, thread in enumerate(found) if thread.is_coaxial(flank)]
        first = found.pop(same[0]) if same else replace(flank, flanks=())
        found.append(replace(first, flanks=first.flanks + flank.flanks))
    notes = []
    for thread in found:
        size, pitch = f"{2 * thread.radius:.4g} {unit}", f"{thread.pitch:.3g} {unit}"
        what = f"a thread with a diameter of {size.rstrip()} and a pitch of {pitch.rstrip()} is"
        try:
            surface = _replaced(surface, thread)
            notes.append(f"{what} replaced by its cylinder; cad.threads=keep keeps it")
        except InputError as error:
            notes.append(f"{what} kept: {error}")
    return surface, notes


def _flanks(surface: TriMesh) -> Iterator[Thread]:
    """Each flank as a thread of its own."""
    vectors, middles = area_vectors(surface), surface.vertices[surface.faces].mean(axis=1)
    border = np.concatenate(between_faces(surface))
    for number in np.unique(surface.region).tolist():
        if surface.region_shapes[number - 1] in ANALYTIC:
            continue
        own = surface.region == number
        middle, n, weight = middles[own], unit(vectors[own]), np.linalg.norm(vectors[own], axis=1)
        weight /= weight.sum()
        centre = weight @ middle
        size = np.sqrt(weight @ ((middle - centre) ** 2).sum(axis=1))
        fields = np.hstack([np.cross((middle - centre) / size, n), n])
        squares, motions = np.linalg.eigh((fields.T * weight) @ fields)
        turn, shift = motions[:3, 0], size * motions[3:, 0]
        speed = np.linalg.norm(turn)
        if squares[0] > RESIDUAL**2 or squares[1] < UNIQUE**2 * squares[0] or speed < RESIDUAL:
            continue
        point, pitch = centre + np.cross(turn, shift) / speed**2, turn @ shift / speed**2
        thread = Thread(frame(turn / speed), point, 2 * np.pi * abs(pitch), (number,))
        lean = weight @ thread.leaning(n, thread.polar(middle)[1])
        radius, _, height = thread.polar(surface.vertices[surface.faces[own].ravel()])
        low, high = radius.min(), radius.max()
        cylinder, depth = (high, high - low) if lean > 0 else (low, low - high)
        rim = surface.vertices[half_edges(surface.faces)[border[own[border // 3]]].ravel()]
        is_on = abs(thread.polar(rim)[0] - cylinder) < CLOSE * abs(depth)
        is_thread = is_on.mean() > RIM and abs(lean) > LEAN
        is_deep = DEPTH[0] * thread.pitch < abs(depth) < DEPTH[1] * thread.pitch
        if is_thread and is_deep and thread.pitch < min(cylinder, np.ptp(height)):
            yield replace(thread, depth=float(depth)).fitted(rim[is_on])


def _replaced(surface: TriMesh, thread: Thread) -> TriMesh:
    """The surface with a cylinder instead of a thread, up to the faces at its two ends.

    Raises InputError if other faces cut into the cylinder, or cannot be extended to it.
    """
    region, (radius, angle, height) = surface.region, thread.polar(surface.vertices)
    near = CLOSE * abs(thread.depth)
    low, high = sorted([thread.radius, thread.radius - thread.depth])
    is_beside = ((radius < low - near) | (radius > high + near))[surface.faces].any(axis=1)
    one, other = between_faces(surface)
    own, across = np.append(one, other), np.append(other, one)
    touched = region[across[np.isin(region[own // 3], thread.flanks)] // 3]
    old = np.append(np.setdiff1d(touched, region[is_beside]), thread.flanks)
    is_old = np.isin(region, old)
    is_rim = is_old[own // 3] & ~is_old[across // 3]
    beside = np.zeros(len(radius), np.int64)  # CAD face across the edge that begins at a vertex
    beside[half_edges(surface.faces)[own[is_rim], 0]] = region[across[is_rim] // 3]
    kept = TriMesh(surface.vertices, surface.faces[~is_old])
    ends = loops(kept.faces)
    turns = [np.unwrap(angle[[*at, at[0]]]) for at in ends]
    whole = [float(turn[-1] - turn[0]) / (2 * np.pi) for turn in turns]
    if len(ends) != 2 or not np.allclose(sorted(whole), [-1, 1]):
        raise InputError("other faces cut into its cylinder")
    normal = np.zeros_like(kept.vertices)
    np.add.at(normal, kept.faces, area_vectors(kept)[:, None])
    vertices, faces, regions, rings = kept.vertices, [kept.faces], [region[~is_old]], []
    for i in np.argsort(whole)[::-1]:  # with ascending angles first
        records, filled = _ahead(kept.vertices, normal, ends[i], whole[i] * turns[i][:-1])
        at = ends[i][records]
        face = beside[at]
        step = thread.radius - radius[at]
        is_new = abs(step) > near
        lean, along = thread.leaning(normal[at], angle[at]), normal[at] @ thread.frame[2]
        if (is_new & (abs(lean) > STEEP * abs(along))).any():
            raise InputError("a face at its end is too steep")
        rise = -np.divide(lean * step, along, out=np.zeros(len(at)), where=is_new)
        rim = np.where(is_new, len(vertices) + np.cumsum(is_new) - 1, at)
        vertices = np.append(vertices, thread.place(angle[at], height[at] + rise)[is_new], axis=0)
        after, rim_after = np.roll(at, -1), np.roll(rim, -1)
        strip = np.stack([at, after, rim_after, at, rim_after, rim], axis=1).reshape(-1, 3)
        is_face = (strip != np.roll(strip, 1, axis=1)).all(axis=1)
        faces += [filled, strip[is_face]]
        regions += [np.full(len(filled), face[0]), np.repeat(face, 2)[is_face]]
        rings += [rim, angle[at]]
    lower, low_angle, upper, high_angle = rings
    faces.append(_between(lower, low_angle, upper[::-1], high_angle[::-1]))
    cylinders = [number for number in old if surface.region_shapes[number - 1] == "cylinder"]
    regions.append(np.full(len(faces[-1]), min(cylinders, default=old.min())))
    new = compact(vertices, np.concatenate(faces))
    return replace(surface, vertices=new.vertices, faces=new.faces, region=np.concatenate(regions))


def _ahead(
    vertices: np.ndarray, normal: np.ndarray, at: np.ndarray, turns: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Places in a loop whose angle is larger than all before, and triangles beside the others.

    Raises InputError if such triangles cross each other, or are on the side of the surface.

    vertices, normal : (V, 3) of the surface
    at : (N,) vertices of the loop
    turns : (N,) their angles, with an increase of 2 pi in all
    """
    n = len(at)
    twice = np.append(turns, turns + 2 * np.pi)
    records = np.flatnonzero(twice[n:] > np.maximum.accumulate(twice)[n - 1 : -1] + STEP)
    filled = [np.zeros((0, 3), np.int64)]
    for first, last in zip(records, np.append(records[1:], records[0] + n), strict=True):
        if last > first + 1:
            ring = at[np.arange(first, last + 1) % n]
            filled.append(triangulated(vertices, ring, np.array([len(ring)])).faces)
            area = area_vectors(TriMesh(vertices, filled[-1])).sum(axis=0)
            if area @ normal[ring].sum(axis=0) < 0:
                raise InputError("its end goes back around the axis")
    return records, np.concatenate(filled)


def _between(lower: np.ndarray, low: np.ndarray, upper: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Triangles (N + M, 3) between rings of vertices (N,) and (M,) with ascending angles."""
    rings, ends = [], []
    for ring, angle in ((lower, low), (upper, high)):
        angle = np.mod(angle, 2 * np.pi)
        first = int(angle.argmin())
        rings.append(np.roll(ring, -first)[[*range(len(ring)), 0]])
        ends.append(np.append(np.roll(angle, -first)[1:], 2 * np.pi))
    is_lower = np.argsort(np.concatenate(ends), kind="stable") < len(lower)
    i: np.ndarray = np.cumsum(is_lower) - is_lower
    j: np.ndarray = np.cumsum(~is_lower) - ~is_lower
    (a, b), up = rings, np.minimum(j + 1, len(upper))
    along = np.stack([a[i], a[np.minimum(i + 1, len(lower))], b[j]], axis=1)
    return np.where(is_lower[:, None], along, np.stack([b[up], b[j], a[i]], axis=1))
