"""Mend a boundary that crosses itself at a few places.

Two quads that fold over each other, or stick into one another, part when their vertices move a
little towards their neighbours on the boundary.  They leave the surface by that.
"""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np

from polycube.hexmesh.connectivity import quad_edges
from polycube.hexmesh.crossings import crossings
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

MOST = 20  # pairs of quads; more of them are no accident
SHARES = (0.05, 0.1, 0.2, 0.3, 0.45)  # of the way to the mean of the neighbours


def without_crossings(mesh: HexMesh) -> HexMesh:
    """Move the vertices of quads that cross, as little as parts them.

    Parameters
    ----------
    mesh : fitted

    Returns
    -------
    The mesh with other vertices, without crossings and inverted hexes; the same where it has none
    of the former, more than `MOST`, any of the latter, or where no share of the way is enough
    """
    found = crossings(mesh)
    if not 0 < len(found) <= MOST or scaled_jacobian(mesh.vertices, mesh.hexes).min() <= 0:
        return mesh
    moved = np.unique(mesh.quads[np.unique(found)])
    ends, _ = quad_edges(mesh.quads)
    number = np.bincount(ends.ravel(), minlength=len(mesh.vertices))[moved, None]
    total = np.zeros_like(mesh.vertices)
    for one, other in (ends.T, ends.T[::-1]):
        np.add.at(total, one, mesh.vertices[other])
    way = total[moved] / number - mesh.vertices[moved]
    for share in SHARES:
        vertices = mesh.vertices.copy()
        vertices[moved] += share * way
        tried = replace(mesh, vertices=vertices)
        if scaled_jacobian(vertices, mesh.hexes).min() > 0 and not len(crossings(tried)):
            logger.info("crossings: %d pairs of quads parted", len(found))
            return tried
    return mesh
