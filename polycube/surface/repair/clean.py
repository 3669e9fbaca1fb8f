"""Make an oriented boundary of a solid from a triangle soup, and list the changes.

A step changes the surface only if it is needed: corners are welded if there are open edges, faces
are dropped at edges with more than two faces. Remaining defects raise an error; they are not
patched.
"""

import numpy as np
from scipy.spatial import cKDTree

from polycube.errors import InputError
from polycube.surface import measures
from polycube.surface.checks import check_closed, check_surface
from polycube.surface.intersections import crossing_places, self_intersections
from polycube.types import TriMesh

WELD = 1e-6  # of the diagonal: corners closer than this are merged
COLLAPSE = 0.1  # of the faces: an error is raised if welding would collapse more
FLAT = 1e-12  # of the diagonal squared: a face with a smaller area counts as flat
DIAGONALS = 1e-60, 1e60  # diagonals whose fourth power is still a float64
MAX_FACES = 1_000_000  # the search for crossing faces is limited to this number
N_PLACES = 3  # number of places that a message gives for crossing faces

Step = tuple[TriMesh, list[str]]  # the surface, and a list of the changes


def clean(vertices: np.ndarray, faces: np.ndarray) -> Step:
    """Surface of one solid, and one sentence for each change or warning."""
    surface, notes = checked(vertices, faces)
    for step in (weld_equal, weld_near, drop_repeated, drop_flat):
        if measures.is_closed(surface.faces) and not are_flat(surface).any():
            break
        surface, done = step(surface)
        notes += done
    check_closed(surface)
    for step in (orient, flip_flat):
        surface, done = step(surface)
        notes += done
    check_surface(surface)
    return surface, notes + crossings(surface)


def checked(vertices: np.ndarray, faces: np.ndarray) -> Step:
    """Raise InputError for invalid geometry; remove unused vertices."""
    if not len(faces):
        raise InputError(f"the file has no triangles (and {len(vertices)} vertices)")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError(f"a face refers to vertex {faces.max()}; there are {len(vertices)}")
    if len(strange := np.flatnonzero(~np.isfinite(vertices).all(axis=1))):
        raise InputError(
            f"coordinates must be finite numbers: {len(strange)} of {len(vertices)} vertices are "
            f"not, the first is number {strange[0] + 1}, {tuple(vertices[strange[0]].tolist())}"
        )
    surface = compact(vertices, faces)
    size = measures.diagonal(surface)
    if size == 0:
        place = measures.place(surface, surface.vertices[0])
        what = f"all corners of its {len(faces)} triangles are at one point, {place}"
        raise InputError(what, remedy="move the part closer to the origin")
    if not DIAGONALS[0] < size < DIAGONALS[1]:
        raise InputError(f"its diagonal of {size:.3g} is out of range; scale it to about 1")
    unused = len(vertices) - len(surface.vertices)
    return surface, [f"removed vertices that no face uses: {unused}"] * (unused > 0)


def weld_equal(surface: TriMesh) -> Step:
    """Merge vertices at equal positions, as STL files need."""
    return _merge(surface, np.unique(surface.vertices, axis=0, return_inverse=True)[1].ravel())


def weld_near(surface: TriMesh) -> Step:
    """Merge vertices closer than WELD times the diagonal."""
    scale = measures.diagonal(surface)
    near = cKDTree(surface.vertices / scale).query_pairs(WELD, output_type="ndarray")
    if not len(near):
        return surface, []
    gaps = np.linalg.norm(np.subtract(*surface.vertices[near.T]), axis=1)
    group = measures.connected(near[:, 0], near[:, 1], len(surface.vertices))
    welded, notes = _merge(surface, group)
    n_lost = len(surface.faces) - len(welded.faces)
    if n_lost > COLLAPSE * len(surface.faces):
        far = np.abs(surface.vertices - np.median(surface.vertices, axis=0)).max(axis=1).argmax()
        size = f"{WELD:g} of its diagonal, {scale:.3g}"
        what = f"{n_lost} of its {len(surface.faces)} faces are below {size}"
        place = measures.place(surface, surface.vertices[far])
        raise InputError(what, remedy=f"does the vertex at {place} belong to it?")
    n_welded = len(surface.vertices) - len(welded.vertices)
    return welded, [f"welded corners: {n_welded}, up to {gaps.max():.2g} apart", *notes]


def _merge(surface: TriMesh, group: np.ndarray) -> Step:
    """Merge each group of vertices into its first one; remove the faces that collapse."""
    _, first, group = np.unique(group, return_index=True, return_inverse=True)
    faces = group[surface.faces]
    has_area = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    merged = TriMesh(surface.vertices[first], faces[has_area])
    return merged, left_out(surface, ~has_area, "with two equal corners")


def drop_repeated(surface: TriMesh) -> Step:
    """Keep one of several faces with the same corners."""
    return without(surface, are_repeated(surface.faces), "given twice")


def drop_flat(surface: TriMesh) -> Step:
    """Remove faces without area that share an edge with more than one other face."""
    if measures.is_closed(surface.faces):
        return surface, []
    return without(surface, are_flat(surface), "of no area")


def are_flat(surface: TriMesh) -> np.ndarray:
    """(F,) whether a face counts as flat."""
    return measures.face_areas(surface) <= FLAT * measures.diagonal(surface) ** 2


def are_repeated(faces: np.ndarray) -> np.ndarray:
    """(F,) whether an earlier face has the same corners."""
    extra = np.ones(len(faces), dtype=bool)
    extra[np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1]] = False
    return extra


def compact(vertices: np.ndarray, faces: np.ndarray) -> TriMesh:
    """The surface of some faces, without the vertices that they do not use."""
    used, faces = np.unique(faces, return_inverse=True)
    return TriMesh(vertices[used], faces.reshape(-1, 3))


def without(surface: TriMesh, faces: np.ndarray, why: str) -> Step:
    """The surface without some faces (F,), and a sentence about them."""
    if not faces.any():
        return surface, []
    return compact(surface.vertices, surface.faces[~faces]), left_out(surface, faces, why)


def left_out(surface: TriMesh, faces: np.ndarray, why: str) -> list[str]:
    """One sentence about removed faces (F,), with the place of the first one."""
    if not faces.any():
        return []
    first = surface.vertices[surface.faces[faces.argmax(), 0]]
    return [f"removed faces {why}: {faces.sum()}, the first at {measures.place(surface, first)}"]


def orient(surface: TriMesh) -> Step:
    """Orient the faces consistently, with a positive volume.

    Each face has two nodes, for its given and its reversed orientation. Neighbours with compatible
    orientations link equal nodes, others link unequal nodes. The surface is one-sided if both nodes
    of a face are connected.
    """
    faces, n_faces = surface.faces, len(surface.faces)
    first, second = measures.twins(faces)
    agree = faces.ravel()[first] != faces.ravel()[second]
    f, g = first // 3, second // 3
    left, right = np.where(agree, g, n_faces + g), np.where(agree, n_faces + g, g)
    side = measures.connected(np.append(f, n_faces + f), np.append(left, right), 2 * n_faces)
    given, turned = side[:n_faces], side[n_faces:]
    if (one_sided := given == turned).any():
        raise InputError(
            f"the surface is not orientable (like a Klein bottle): {one_sided.sum()} of its "
            f"{n_faces} faces have no outer side, so it is not the boundary of a solid"
        )
    turn = given > turned
    oriented = TriMesh(surface.vertices, np.where(turn[:, None], faces[:, ::-1], faces))
    if measures.volume(oriented) < 0:
        turn = ~turn
        oriented = TriMesh(surface.vertices, oriented.faces[:, ::-1])
    if turn.all():
        return oriented, [f"reversed all {n_faces} faces: the surface was inside out"]
    if turn.any():
        return oriented, [f"reversed faces with an inward normal: {turn.sum()} of {n_faces}"]
    return surface, []


def flip_flat(surface: TriMesh) -> Step:
    """Give faces without area a part of a neighbour's area, by flipping their longest edges."""
    flat = are_flat(surface)
    if not flat.any():
        return surface, []
    faces = surface.faces.copy()
    owner = {(a, b): h // 3 for h, (a, b) in enumerate(measures.half_edges(faces).tolist())}
    for face in np.flatnonzero(flat):
        corners = surface.vertices[faces[face]]
        lengths = np.linalg.norm(corners - np.roll(corners, -1, axis=0), axis=1)
        a, b, middle = np.roll(faces[face], -int(lengths.argmax())).tolist()
        other = owner[b, a]
        tip = int(faces[other].sum()) - a - b
        if (middle, tip) in owner or (tip, middle) in owner:
            what = f"a face without area is at {measures.place(surface, corners[0])}; remove it"
            raise InputError(what)
        del owner[a, b], owner[b, a]
        for f, triangle in ((face, (middle, a, tip)), (other, (middle, tip, b))):
            faces[f] = triangle
            owner |= {(p, q): f for p, q in measures.half_edges(faces[f : f + 1]).tolist()}
    flipped = TriMesh(surface.vertices, faces)
    if are_flat(flipped).any():
        raise InputError(f"{flat.sum()} adjacent faces have no area; remove them")
    return flipped, [f"flipped the longest edges of faces without area: {flat.sum()}"]


def crossings(surface: TriMesh) -> list[str]:
    """A sentence with places if faces cross, else an empty list."""
    if len(surface.faces) > MAX_FACES:
        return [f"intersecting faces were not searched for: more than {MAX_FACES} faces"]
    try:
        pairs = self_intersections(surface)
    except InputError as error:
        return [str(error)]
    if not len(pairs):
        return []
    middles, _ = crossing_places(surface, pairs)
    where = ", ".join(measures.place(surface, middle) for middle in middles[:N_PLACES])
    more = f" and {len(middles) - N_PLACES} more" if len(middles) > N_PLACES else ""
    n_places = "1 place" if len(middles) == 1 else f"{len(middles)} places"
    return [
        f"the surface intersects itself: {len(pairs)} pairs of faces in {n_places}, at "
        f"{where}{more}; it is meshed without changes, check the mesh there"
    ]
