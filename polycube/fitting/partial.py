"""Fit a valid hex mesh only as far as it stays valid.

A mesh is sound where all scaled Jacobians are positive and its boundary does not cross itself.  The
vertices of a sound mesh move towards given positions, each by its own share of the way: from a
share of 1 the vertices of bad hexes go back until no hex is bad, and then forward again where
nothing becomes bad.  With shares of 0 the mesh is the one given, so the result is always sound.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from polycube.fitting.pillow import layer
from polycube.fitting.polish import untangled
from polycube.fitting.problem import FitProblem
from polycube.hexmesh.crossings import crossings
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.surface.fit_target import Target
from polycube.types import HexMesh

LEAST = 0.05  # scaled Jacobian that hexes keep, unless they had less before
ROUNDING = 1 - 1e-9  # share of its scaled Jacobian that a hex keeps where it is only shifted
SMALLEST = 1 / 16  # share of the way; a smaller one is none
ADVANCES = 6  # rounds, each half of the way that is left


def is_sound(mesh: HexMesh) -> bool:
    """Whether all scaled Jacobians are positive and the boundary does not cross itself."""
    return scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0 and not len(crossings(mesh))


def partly_fitted(
    mesh: HexMesh, fitted: np.ndarray, least: float = LEAST
) -> tuple[HexMesh, np.ndarray]:
    """Move the vertices of a sound mesh towards their fitted positions while it stays sound.

    Parameters
    ----------
    mesh : all scaled Jacobians positive, no crossing of the boundary
    fitted : (V, 3) positions of its vertices, in the units of the mesh
    least : scaled Jacobian that each hex keeps, or its own in `mesh` where that is smaller

    Returns
    -------
    mesh : with the same hexes; its vertices are the fitted ones where all of those are sound
    share : (V,) of the way that each vertex has gone, from 0 to 1

    Raises
    ------
    ValueError
        For a mesh that is not sound, or positions that are not finite or not of this shape.
    """
    if fitted.shape != mesh.vertices.shape or not np.isfinite(fitted).all():
        raise ValueError(f"fitted must be finite of shape {mesh.vertices.shape}")
    if not is_sound(mesh):
        raise ValueError("the mesh to fit must have positive hexes and no crossing")
    floor = np.minimum(least, ROUNDING * scaled_jacobian(mesh.vertices, mesh.hexes))
    share = _advanced(mesh, fitted, floor, _backed_off(mesh, fitted, floor))
    return _moved(mesh, fitted, share), share


def with_layer(mesh: HexMesh, target: Target) -> HexMesh:
    """A sound mesh with a layer of hexes under its boundary, or as it is where that is not sound.

    Hexes with two faces on one smooth face of the part would be flat without it.

    Parameters
    ----------
    mesh : all scaled Jacobians positive, no crossing of the boundary
    target : of the surface that it is to be fitted to
    """
    layered = layer(mesh, mesh.patch, np.ones(len(mesh.quads), bool))
    x = untangled(FitProblem(layered, target, samples=1), target.to_unit(layered.vertices))
    layered = replace(layered, vertices=target.to_model(x))
    return layered if is_sound(layered) else mesh


def _backed_off(mesh: HexMesh, fitted: np.ndarray, floor: np.ndarray) -> np.ndarray:
    """(V,) shares with which no hex is bad: halved round bad ones, from 1 on."""
    share = np.ones(len(fitted))
    while (bad := _bad(_moved(mesh, fitted, share), floor)).any():
        near = np.zeros(len(share), bool)
        near[mesh.hexes[bad[mesh.hexes].any(axis=1)]] = True
        share[near] /= 2
        share[share < SMALLEST] = 0
    return share


def _advanced(
    mesh: HexMesh, fitted: np.ndarray, floor: np.ndarray, share: np.ndarray
) -> np.ndarray:
    """(V,) larger shares with which no hex is bad, from shares with which none is."""
    for _ in range(ADVANCES):
        if (share == 1).all():
            break
        wanted = np.where(share > 1 - SMALLEST, 1, (1 + share) / 2)
        while (bad := _bad(_moved(mesh, fitted, wanted), floor)).any():
            wanted[bad] = share[bad]
        share = wanted
    return share


def _moved(mesh: HexMesh, fitted: np.ndarray, share: np.ndarray) -> HexMesh:
    """The mesh with each vertex a share of the way; exactly at the ends for 0 and 1."""
    way = share[:, None]
    between = mesh.vertices + way * (fitted - mesh.vertices)
    return replace(mesh, vertices=np.where(way == 1, fitted, between))


def _bad(mesh: HexMesh, floor: np.ndarray) -> np.ndarray:
    """(V,) whether a vertex is of a hex below its floor (H,) or of a quad that crosses another."""
    bad = np.zeros(len(mesh.vertices), bool)
    bad[mesh.hexes[scaled_jacobian(mesh.vertices, mesh.hexes) < floor]] = True
    if not bad.any():  # the costlier check, for meshes that could do
        bad[mesh.quads[crossings(mesh)]] = True
    return bad
