"""Midpoint subdivision: hexes of a polyhedron with any number of edges at its corners."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from polycube.kinds import Structure
from polycube.registry import register
from polycube.structure.primitives import full_cell
from polycube.types import Candidate, HexMesh, TriMesh

if TYPE_CHECKING:
    from .polyhedron import Polyhedron

logger = logging.getLogger(__name__)

LEAST = 0.05  # smallest scaled Jacobian of blocks that polishing can improve sufficiently
TURN = 0.1  # of the diagonal: weight of the difference of unit normals


@register("structure", "midpoint")
@dataclass(frozen=True, kw_only=True, eq=False)
class Midpoint(Structure):
    """Divide a polyhedron into convex cells, and each cell into one hex for each of its corners.

    For parts with planar faces only, of genus 0 and with few corners; these may have more than
    three edges, which is not possible for corners of a polycube. Corners, edges and faces are
    exact.

    Parameters
    ----------
    grid : cells of the polycube; not used
    primitives : (3, 3, 3) bool voxels by name
    corners : largest number of corners of the part
    planes : largest number of planes that divide a non-convex part
    """

    references: ClassVar[tuple[str, ...]] = ("li1995midpoint",)

    any_grid = True

    grid: tuple[int, int, int]
    primitives: Mapping[str, np.ndarray]
    corners: int = 60
    planes: int = 6

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> list[Candidate]:
        """One candidate with blocks, or none if the part is not such a polyhedron."""
        from polycube.hexmesh.generation.blocks import candidate
        from polycube.hexmesh.scaled_jacobian import scaled_jacobian

        from .cells import convex_cells
        from .division import divided
        from .polyhedron import NotPolyhedralError, polyhedron

        brick = full_cell(self.primitives)
        if brick is None:
            logger.info("midpoint: no primitive is a full cell; nothing is proposed")
            return []
        try:
            solid = polyhedron(surface, self.corners)
            vertices, hexes = divided(convex_cells(solid, self.planes))
            blocks = _with_faces(_conforming(vertices, hexes), solid)
        except NotPolyhedralError as reason:
            logger.info("midpoint: nothing is proposed, because %s", reason)
            return []
        least = scaled_jacobian(vertices, hexes).min()
        logger.info("midpoint: %d blocks, smallest scaled Jacobian %.3f", len(hexes), least)
        if least < LEAST:
            logger.info(
                "midpoint: nothing is proposed, because the blocks have a small scaled Jacobian"
            )
            return []
        return [candidate(blocks, surface, brick, "midpoint")]


def _conforming(vertices: np.ndarray, hexes: np.ndarray) -> HexMesh:
    from polycube.hexmesh.connectivity import check_conforming, hex_mesh

    from .polyhedron import NotPolyhedralError

    blocks = hex_mesh(vertices, hexes)
    try:
        check_conforming(blocks)
    except ValueError as error:
        raise NotPolyhedralError(f"its cells do not fit: {error}") from None
    return blocks


def _with_faces(blocks: HexMesh, solid: Polyhedron) -> HexMesh:
    """Blocks whose boundary quads have the numbers of their planar faces."""
    from polycube.surface.fit_target import target

    goal = target(solid.surface)
    corners = goal.to_unit(blocks.vertices)[blocks.quads]
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    _, triangle = goal.closest(corners.mean(axis=1), normals, TURN)
    return replace(blocks, patch=solid.face[triangle])
