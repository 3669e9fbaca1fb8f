"""A layer of hexes under the boundary, patch by patch.

Without it a hex on a smoothed polycube edge has two faces on one smooth surface and is nearly
flat.  Where all edges of a patch are sharp on the surface no layer is needed: the sheet then
leaves through that patch, an O-grid on a flat cap.
"""

from __future__ import annotations

import logging

import numpy as np

from polycube.geometry.body import Body
from polycube.geometry.features import chains, sharpness
from polycube.geometry.hexes import exposed, hex_mesh, quad_edges, unique_rows
from polycube.geometry.target import Target
from polycube.types import HexMesh

logger = logging.getLogger(__name__)


def smooth_patches(mesh: HexMesh, target: Target, least: float = 0.6) -> np.ndarray:
    """Patches of a fitted mesh with an edge that is not sharp on the surface.

    least : share of a polycube edge under which the surface must be sharp
    """
    body = Body(mesh, target, samples=1)
    edges = chains(body)
    is_sharp = sharpness(body, target.to_unit(mesh.vertices), edges) >= least
    capped = np.setdiff1d(edges.patches[is_sharp], edges.patches[~is_sharp])
    return np.setdiff1d(mesh.patch, capped)


def insert(mesh: HexMesh, patches: np.ndarray, depth: float = 0.5) -> HexMesh:
    """The mesh with one more layer of hexes under the given patches.

    The new vertices take the places of the old ones, which move inwards.

    depth : share of the way to the middle of the adjacent hexes (bare quads at a rim)
    """
    quads, owner = exposed(mesh.hexes)
    patch = _patch_of(quads, mesh.quads, mesh.patch)
    covered = _covered(quads, patch, np.isin(patch, patches))
    below = quads[covered]
    moved = np.unique(below)
    twin = np.full(len(mesh.vertices), -1)
    twin[moved] = len(mesh.vertices) + np.arange(len(moved))
    inwards = _mean_middle(mesh.hexes, mesh.vertices)
    rim = np.intersect1d(moved, quads[~covered])  # stays on the patches left bare
    inwards[rim] = _mean_middle(quads[~covered], mesh.vertices)[rim]
    old = mesh.vertices.copy()
    old[moved] += depth * (inwards[moved] - old[moved])
    hexes = np.vstack([mesh.hexes, np.hstack([below, twin[below]])])
    cell = np.append(mesh.cell, mesh.cell[owner[covered]])
    sides, beside = _rim(quads, covered)
    side_quads = np.hstack([sides, twin[sides]])
    table = np.vstack([twin[below], quads[~covered], side_quads])
    number = np.concatenate([patch[covered], patch[~covered], patch[beside]])
    outside, _ = exposed(hexes)
    logger.info("pillow: %d hexes under %d patches", len(below), len(np.unique(patch[covered])))
    return hex_mesh(
        np.vstack([old, mesh.vertices[moved]]),
        hexes,
        outside,
        _patch_of(outside, table, number),
        cell,
    )


def _covered(quads: np.ndarray, patch: np.ndarray, covered: np.ndarray) -> np.ndarray:
    """(Q,) quads to cover: those wanted, and patches at whose vertices layers would only touch."""
    while True:
        sides, _ = _rim(quads, covered)
        rims = np.bincount(sides.ravel(), minlength=quads.max() + 1)
        touching = (rims > 2)[quads].any(axis=1)
        if not touching.any():
            return covered
        covered = covered | np.isin(patch, patch[touching])


def _rim(quads: np.ndarray, covered: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges (R, 2) between covered quads and others, and the other quad of each (R,)."""
    sides, pair = quad_edges(quads)
    inside = covered[pair]
    rim = inside[:, 0] != inside[:, 1]
    other = np.where(inside[rim, 0], pair[rim, 1], pair[rim, 0])
    return sides[rim], other


def _patch_of(quads: np.ndarray, known: np.ndarray, patch: np.ndarray) -> np.ndarray:
    """(Q,) patch of the known quad with the same vertices."""
    _, number, _ = unique_rows(np.sort(np.vstack([known, quads]), axis=1))
    table = np.zeros(number.max() + 1, np.int64)
    table[number[: len(known)]] = patch
    return table[number[len(known) :]]


def _mean_middle(cells: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """(V, 3) mean of the middles of the cells at each vertex; zero where there is none."""
    corners, n = cells.ravel(), len(vertices)
    middle = np.repeat(vertices[cells].mean(axis=1), cells.shape[1], axis=0)
    total = np.stack([np.bincount(corners, m, minlength=n) for m in middle.T], axis=1)
    return total / np.maximum(np.bincount(corners, minlength=n), 1)[:, None]
