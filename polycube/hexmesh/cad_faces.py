"""The faces of the CAD model on the boundary of a hex mesh.

Nine points of every quad, one in the middle of each ninth, take the face of the nearest triangle
whose normal suits; the quad belongs to the face that most of them are on.
"""

from __future__ import annotations

import logging
import re
from dataclasses import replace

import numpy as np

from polycube.hexmesh.face_groups import ends_and_holes
from polycube.hexmesh.named_sets import boundary_sets, patch_sets
from polycube.surface.fit_target import target
from polycube.types import HexMesh, TriMesh

logger = logging.getLogger(__name__)

ALPHA = 0.04  # of the diagonal: how far a normal that is the other way counts
NINTHS = np.array([(u, v) for v in (1 / 6, 1 / 2, 5 / 6) for u in (1 / 6, 1 / 2, 5 / 6)])


def with_sets(mesh: HexMesh, surface: TriMesh) -> HexMesh:
    """The mesh with all sets of its boundary: ends, holes, CAD faces and patches.

    Ends and holes of a CAD model consist of its faces, those of any other part of patches.
    """
    if not len(surface.region):
        return replace(mesh, sets=boundary_sets(mesh))
    region, share = quad_regions(mesh, surface)
    numbers = np.unique(surface.region)
    bare = np.setdiff1d(numbers, region)
    logger.info(
        "CAD faces: %d of %d on the mesh, %d of %d quads lie on several%s",
        len(numbers) - len(bare),
        len(numbers),
        (share < 1).sum(),
        len(region),
        f"; without a quad: {', '.join(map(str, bare))}" if len(bare) else "",
    )
    ends = ends_and_holes(mesh.vertices, mesh.quads, region)
    return replace(mesh, sets=ends | _cad_sets(region, surface) | patch_sets(mesh.patch))


def _cad_sets(region: np.ndarray, surface: TriMesh) -> dict[str, np.ndarray]:
    """`cad_face_1` ... and, where the file names faces, `cad_NAME` of all that are called so."""
    sets = {f"cad_face_{n}": np.flatnonzero(region == n) for n in np.unique(region).tolist()}
    called: dict[str, list[int]] = {}
    for number, name in enumerate(surface.region_names, start=1):
        if name and f"cad_face_{number}" in sets:
            called.setdefault(f"cad_{re.sub(r'[^0-9A-Za-z]+', '_', name).strip('_')}", []).append(
                number
            )
    named = {name: np.flatnonzero(np.isin(region, own)) for name, own in called.items()}
    return {**named, **sets}


def quad_regions(mesh: HexMesh, surface: TriMesh) -> tuple[np.ndarray, np.ndarray]:
    """CAD face of each boundary quad (Q,), and the share of its points that are on it (Q,)."""
    goal = target(surface)
    u, v = NINTHS.T
    shape = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v])  # (4, 9)
    corners = goal.to_unit(mesh.vertices)[mesh.quads]
    points = np.einsum("kg,qkd->qgd", shape, corners).reshape(-1, 3)
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    _, face = goal.closest(points, np.repeat(normals, len(NINTHS), axis=0), ALPHA)
    found = surface.region[face].reshape(-1, len(NINTHS))
    votes = (found[:, :, None] == found[:, None]).sum(axis=2)
    votes[:, len(NINTHS) // 2] += votes[:, len(NINTHS) // 2] == votes.max(axis=1)  # ties: middle
    most = votes.argmax(axis=1)
    row = np.arange(len(found))
    region = found[row, most]
    return region, (found == region[:, None]).mean(axis=1)
