"""Hexes of a part whose leaning faces were set upright, moved back to the part."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from polycube.hexmesh.background.arrangement import cross
from polycube.hexmesh.background.background import NoBackgroundError
from polycube.hexmesh.background.section import DETAILS
from polycube.hexmesh.background.smoothing import sines, smoothed
from polycube.hexmesh.connectivity import CORNERS, EDGES, edges, genus, hex_mesh, quad_edges
from polycube.hexmesh.quality import volume
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.numerics.harmonic import harmonic
from polycube.surface import closest, measures
from polycube.surface.measures import between_faces, connected, diagonal, half_edges
from polycube.types import HexMesh, TriMesh

from .upright import Upright

INVERTED = 0.03  # largest share of inverted hexes, which the fit can still unfold
FILLED = 0.1  # largest relative difference of the volumes
ON = 1e-3  # of the diagonal: distance within which a vertex is on a face or curve
MERGED = 1.1 * max(DETAILS)  # the same if its quads are at the face or curve: details are merged
# smallest distance of a row of vertices from the border of a rounding, relative to that from the
# edge at half its turn, so that at least two rows are left
LAST = 1.2


def moved_back(mesh: HexMesh, straight: Upright, surface: TriMesh) -> HexMesh:
    """Hexes of a changed surface, moved to the original one.

    Vertices at changed faces move with these, and other corners not at all. The rest moves
    harmonically: first along the curves, then on the boundary, then inside.

    Raises NoBackgroundError if the topology or the volume is wrong, or if many hexes are inverted.
    """
    if not straight.is_changed.any():  # some triangles lean, but no face
        return mesh
    near, merged = ON * diagonal(surface), MERGED * diagonal(surface)
    if len(straight.split):
        mesh = _split(mesh, straight, near)
    x, outer = mesh.vertices, np.unique(mesh.quads)
    region, (rims, pair) = _regions(mesh, straight.surface), quad_edges(mesh.quads)
    rim = rims[region[pair[:, 0]] != region[pair[:, 1]]]
    at_face = np.isin(region, straight.surface.region[straight.is_changed])
    own, limit = np.full(len(x), near), np.full(len(x), near)
    own[mesh.quads[at_face]], limit[rim] = merged, merged
    places, faces = straight.places, surface.faces[straight.is_changed]
    shift = (surface.vertices - places)[faces]
    at, face, weight = closest.closest(closest.tree(places[faces]), x[outer])
    on_face = np.linalg.norm(at - x[outer], axis=1) < own[outer]
    found = np.zeros_like(x)
    found[outer[on_face]] = np.einsum("nk,nkd->nd", weight, shift[face])[on_face]
    along, on_curve, on_corner = _on_curves(x, outer, rims, straight.surface, limit)
    is_given = np.zeros(len(x), bool)
    is_given[outer[on_face]] = True
    curve = connected(along[:, 0], along[:, 1], len(x))
    slides = on_curve & ~on_corner & ~is_given & np.isin(curve, curve[is_given])
    found = harmonic(x, along, np.flatnonzero(slides), found)
    found = harmonic(x, rims, np.setdiff1d(outer, np.flatnonzero(on_curve | is_given)), found)
    found += _unfolding(x + found, mesh.quads, region, rim, near)
    vertices = x + harmonic(x, edges(mesh.hexes), np.setdiff1d(np.arange(len(x)), outer), found)
    mesh = replace(mesh, vertices=vertices)
    is_inverted = scaled_jacobian(vertices, mesh.hexes) < 0
    error = abs(volume(mesh) / measures.volume(surface) - 1)
    # pieces may touch, and then they have another genus together
    is_one = not measures.components(surface.faces).any()
    has_topology = not is_one or genus(mesh) == measures.genus(surface)
    if not has_topology or is_inverted.mean() > INVERTED or error > FILLED:
        raise NoBackgroundError("its leaning faces do not fit on a stack")
    return mesh


def _regions(mesh: HexMesh, surface: TriMesh) -> np.ndarray:
    """(Q,) the face of a surface at the middle of each quad."""
    tree = closest.tree(surface.vertices[surface.faces])
    return surface.region[closest.closest(tree, mesh.vertices[mesh.quads].mean(axis=1))[1]]


def _unfolding(
    moved: np.ndarray, quads: np.ndarray, region: np.ndarray, rim: np.ndarray, near: float
) -> np.ndarray:
    """Shifts (V, 3) of moved vertices, smoothed in planes that have folded quads.

    region, rim : the face (Q,) of each quad, and the edges (E, 2) between quads of two faces
    """
    shift = np.zeros_like(moved)
    for number in np.unique(region):
        used, own = np.unique(quads[region == number], return_inverse=True)
        own, place = own.reshape(-1, 4), moved[used] - moved[used].mean(axis=0)
        rows = np.linalg.svd(place, full_matrices=False)[2]
        flat = place @ rows.T
        a, b, c, d = np.moveaxis(flat[own, :2], 1, 0)
        if cross(c - a, d - b).sum() < 0:
            rows[0], flat[:, 0] = -rows[0], -flat[:, 0]
        if abs(flat[:, 2]).max() < near and sines(flat[:, :2], own).min() < 0:
            shift[used] = (smoothed(flat[:, :2], own, ~np.isin(used, rim)) - flat[:, :2]) @ rows[:2]
    return shift


def _split(mesh: HexMesh, straight: Upright, near: float) -> HexMesh:
    """Let two hexes meet where a rounding leaves the wall for the plane, if it has rows enough."""
    surface = straight.surface
    places, faces = surface.vertices, surface.faces
    region = _regions(mesh, surface)
    sides, pair = quad_edges(mesh.quads)
    known = {tuple(each) for each in straight.split.tolist()}
    own = [(a, b) in known or (b, a) in known for a, b in region[pair].tolist()]
    both = between_faces(surface)
    one, two = np.concatenate(both), np.concatenate(both[::-1])
    here, there = surface.region[one // 3], surface.region[two // 3]
    ends = places[half_edges(faces)[one]]
    is_level = np.ptp(ends @ straight.axis, axis=1) < near
    is_end = np.isin(here, straight.split[:, 0]) & is_level & ~straight.is_cap[two // 3]
    is_end |= np.isin(here, straight.split[:, 1]) & straight.is_cap[two // 3]
    is_end &= ~np.isin(there, straight.split)
    if not (any(own) and is_end.any()):
        return mesh
    middle = sides[np.array(own)]
    lines = ends[is_end], mesh.vertices[middle]
    off, back = (closest.distance(closest.tree(e[:, [0, 1, 1]]), mesh.vertices) for e in lines)
    return collapsed(mesh, middle, off < LAST * back)


def _on_curves(
    x: np.ndarray, outer: np.ndarray, rims: np.ndarray, surface: TriMesh, near: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges (E, 2) of a mesh along curves of a surface, and whether vertices are on curves (V,) and
    on corners (V,).

    outer, rims : vertices (N,) and edges (E, 2) of the boundary
    near : (V,) largest distance of each vertex from a curve or corner on which it is
    """
    ends = half_edges(surface.faces)[between_faces(surface)[0]]
    a, b = np.moveaxis(surface.vertices[ends], 1, 0)
    tree = closest.tree(np.stack([a, b, b], axis=1))
    on_curve = np.zeros(len(x), bool)
    on_curve[outer] = closest.distance(tree, x[outer]) < near[outer]
    along = rims[on_curve[rims].all(axis=1)]
    along = along[closest.distance(tree, x[along].mean(axis=1)) < near[along].min(axis=1)]
    corners = surface.vertices[np.bincount(ends.ravel(), minlength=len(surface.vertices)) > 2]
    on_corner = np.zeros(len(x), bool)
    if len(corners):
        on_corner[outer] = cKDTree(corners).query(x[outer])[0] < near[outer]
    return along, on_curve, on_corner


# (12, 2, 2) the two other neighbours of each end of a local edge
BESIDE = np.array([[np.setdiff1d(CORNERS[end], edge) for end in edge] for edge in EDGES])


def collapsed(mesh: HexMesh, ends: np.ndarray, is_fixed: np.ndarray) -> HexMesh:
    """A mesh without the hexes at some edges; the two vertices beside each end become one there.

    Where one hex was at an edge, two hexes meet then, as in a disc of three blocks a quarter.
    Connected edges are left as they are if one of them has more than one hex, if a hex has more
    than one of them, if they end inside the mesh, or if a vertex beside them is fixed.

    ends : (E, 2) vertices of boundary edges
    is_fixed : (V,) whether a vertex cannot become one with another
    """
    size = len(mesh.vertices)
    line = connected(ends[:, 0], ends[:, 1], size)
    keys = np.sort(ends, axis=1) @ [size, 1]
    at, edge = np.nonzero(np.isin(np.sort(mesh.hexes[:, EDGES], axis=2) @ [size, 1], keys))
    corner = mesh.hexes[at[:, None], EDGES[edge]]  # (N, 2)
    beside = mesh.hexes[at[:, None, None], BESIDE[edge]]  # (N, 2, 2)
    own = np.sort(corner, axis=1) @ [size, 1]
    bad = is_fixed[beside].any(axis=(1, 2))
    for each in (at, own):
        _, place, count = np.unique(each, return_inverse=True, return_counts=True)
        bad |= count[place] > 1
    # the faces at both ends of a hex are also those of another such hex, or on the boundary
    quads = mesh.quads
    near = np.sort(np.stack([np.roll(quads, k, axis=1) for k in (1, -1)], axis=2), axis=2)
    inner = np.concatenate([corner[..., None], np.sort(beside, axis=2)], axis=2).reshape(-1, 3)
    outer = np.concatenate([quads[..., None], near], axis=2).reshape(-1, 3)
    every = np.concatenate([inner, outer])
    _, place, count = np.unique(every, axis=0, return_inverse=True, return_counts=True)
    bad |= (count[place.ravel()[: len(inner)]] == 1).reshape(-1, 2).any(axis=1)
    good = ~np.isin(line[corner[:, 0]], line[corner[bad, 0]])
    one, two = beside[good].reshape(-1, 2).T
    name = connected(one, two, size)
    vertices = mesh.vertices.copy()
    vertices[one] = vertices[two] = vertices[corner[good].ravel()]
    places = np.empty((name.max() + 1, 3))
    places[name] = vertices
    used, hexes = np.unique(name[np.delete(mesh.hexes, at[good], axis=0)], return_inverse=True)
    return hex_mesh(places[used], hexes.reshape(-1, 8))
