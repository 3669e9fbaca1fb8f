"""A layer of hexes under regions of the boundary.

Without it, a hex on a smoothed polycube edge has two faces on one smooth surface and is nearly
flat. A region is a part of a patch between creases. A region whose borders are all creases needs no
layer; the sheet then leaves through it and forms an O-grid on a flat cap or on an annulus.
"""

import logging

import numpy as np

from polycube.fitting.creases.constraints import Matching, on_crease
from polycube.fitting.problem import FitProblem
from polycube.hexmesh.connectivity import exposed, hex_mesh, label_of, quad_edges, unique_rows
from polycube.hexmesh.generation.sheets import middles
from polycube.surface.fit_target import ALPHA
from polycube.surface.measures import connected
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

ON_CREASE = 0.6  # smallest share of a sharp border of two regions on a crease
FLAT = np.deg2rad(155)  # angle of a hex at an edge above which its scaled Jacobian is poor


def regions(problem: FitProblem, matching: Matching) -> np.ndarray:
    """(Q,) patches of a mesh, also divided at the creases."""
    patch = problem.mesh.patch[problem.side_quads]
    same = patch[:, 0] == patch[:, 1]
    uncut = same & ~on_crease(problem, matching)
    region = problem.parts(uncut)
    is_single = (np.bincount(region) == 1)[region]  # the path passes on the wrong side of a quad
    return problem.parts(uncut | (same & is_single[problem.side_quads].any(axis=1)))


def smooth_regions(
    problem: FitProblem,
    x: np.ndarray,
    matching: Matching,
    least: float = ON_CREASE,
    by_angle: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Regions (Q,), and quads (Q,) in regions with a smooth or nearly flat border.

    Across a concave crease either both regions or none get a layer: the layer of only one would end
    in a hex with an angle above 180 degrees.

    least : smallest share of the edges between two regions that must be on a crease
    by_angle : only a border at which the hexes are nearly flat needs a layer, on a crease or not
    """
    region = regions(problem, matching)
    side, border, patches = borders(problem, region)

    def share(marked: np.ndarray) -> np.ndarray:
        """Share of the edges (E,) of each border that are marked."""
        return np.bincount(border, marked[side]) / np.bincount(border)

    on = on_crease(problem, matching)
    flat = _is_flat(problem, x, on if by_angle else np.ones(len(on), bool))
    is_sharp = share(~flat if by_angle else ~flat & on) >= least
    concave = is_sharp & (share(_is_concave(problem, x)) > 0.5)
    taken = np.isin(region, patches[~is_sharp])
    while True:
        adjacent = patches[concave]
        mixed = adjacent[np.isin(adjacent, region[taken]).sum(axis=1) == 1]
        if len(mixed) == 0:
            return region, taken
        taken |= np.isin(region, mixed)


def borders(problem: FitProblem, region: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sides (N,) between regions (Q,), the border (N,) of each, and the two regions of a border."""
    regions = np.sort(region[problem.side_quads], axis=1)
    side = np.flatnonzero(regions[:, 0] != regions[:, 1])
    _, pair, _ = unique_rows(regions[side])
    # nodes (vertex, pair of regions): borders of one pair are connected through common vertices
    ends = problem.sides[side] + len(problem.mesh.vertices) * pair[:, None]
    nodes, node = np.unique(ends, return_inverse=True)
    node = node.reshape(-1, 2)
    number = connected(node[:, 0], node[:, 1], len(nodes))[node[:, 0]]
    return side, number, regions[side][np.unique(number, return_index=True)[1]]


def _is_flat(problem: FitProblem, x: np.ndarray, is_sharp: np.ndarray) -> np.ndarray:
    """(E,) whether each hex at a boundary edge has an angle above FLAT there.

    is_sharp : (E,) edges at which the angle of the mesh is used; elsewhere the surface is smooth
    """
    _, normals = problem.normals(x)
    a, b = normals[problem.side_quads[:, 0]], normals[problem.side_quads[:, 1]]
    turn = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ed,ed->e", a, b))
    middle = x[problem.quads].mean(axis=1)
    across = middle[problem.side_quads[:, 1]] - middle[problem.side_quads[:, 0]]
    inside = np.where(np.einsum("ed,ed->e", b - a, across) > 0, np.pi - turn, np.pi + turn)
    return np.where(is_sharp, inside, np.pi) > FLAT * problem.side_valence


def _is_concave(problem: FitProblem, x: np.ndarray) -> np.ndarray:
    """(E,) whether the target is concave between the two quads of each boundary edge."""
    _, quad_normals = problem.normals(x)
    middle = x[problem.quads].mean(axis=1)
    _, face = problem.target.closest(middle, quad_normals, ALPHA)
    facing = problem.target.normals[face][problem.side_quads]  # (E, 2, 3)
    across = middle[problem.side_quads[:, 1]] - middle[problem.side_quads[:, 0]]
    return np.einsum("ed,ed->e", facing[:, 1] - facing[:, 0], across) < 0


def layer(mesh: HexMesh, region: np.ndarray, taken: np.ndarray, depth: float = 0.5) -> HexMesh:
    """The mesh with an additional layer of hexes under the quads `taken` (Q,).

    The new vertices take the positions of the old ones, which move inwards.

    region : (Q,) quads of one region are taken together if layers would otherwise only touch
    depth : displacement towards the centres of the adjacent hexes, as a share of the distance (of
        the uncovered quads at a rim)
    """
    quads, owner = exposed(mesh.hexes)
    patch = label_of(quads, mesh.quads, mesh.patch)
    region, wanted = (label_of(quads, mesh.quads, label) for label in (region, taken))
    covered = _covered(quads, region, wanted.astype(bool))
    below = quads[covered]
    moved = np.unique(below)
    twin = np.full(len(mesh.vertices), -1)
    twin[moved] = len(mesh.vertices) + np.arange(len(moved))
    inwards = middles(mesh.hexes, mesh.vertices)
    rim = np.intersect1d(moved, quads[~covered])  # stays on the uncovered quads
    inwards[rim] = middles(quads[~covered], mesh.vertices)[rim]
    old = mesh.vertices.copy()
    old[moved] += depth * (inwards[moved] - old[moved])
    hexes = np.vstack([mesh.hexes, np.hstack([below, twin[below]])])
    sides, uncovered = _rim(quads, covered)
    table = np.vstack([twin[below], quads[~covered], np.hstack([sides, twin[sides]])])
    number = np.concatenate([patch[covered], patch[~covered], patch[uncovered]])
    outside, _ = exposed(hexes)
    logger.info("pillow: %d hexes under %d of %d quads", len(below), len(below), len(quads))
    return hex_mesh(
        np.vstack([old, mesh.vertices[moved]]),
        hexes,
        outside,
        label_of(outside, table, number),
        np.append(mesh.cell, mesh.cell[owner[covered]]),
    )


def _covered(quads: np.ndarray, region: np.ndarray, covered: np.ndarray) -> np.ndarray:
    """(Q,) quads to cover: the wanted ones, and regions whose layers only touch at vertices."""
    while True:
        sides, _ = _rim(quads, covered)
        touching = (np.bincount(sides.ravel(), minlength=quads.max() + 1) > 2)[quads].any(axis=1)
        if not touching.any():
            return covered
        covered = covered | np.isin(region, region[touching])


def _rim(quads: np.ndarray, covered: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges (R, 2) between covered and uncovered quads, and the uncovered quad of each (R,)."""
    sides, pair = quad_edges(quads)
    inside = covered[pair]
    rim = inside[:, 0] != inside[:, 1]
    return sides[rim], np.where(inside[rim, 0], pair[rim, 1], pair[rim, 0])
