"""A tried cure: put a new fit of a neighbourhood into the mesh, and test the boundary.

Only the boundary near the neighbourhood is tested, so the time does not depend on the whole mesh.
"""

from dataclasses import dataclass, replace

import numpy as np

from polycube.fitting.cures import losses
from polycube.fitting.cures.envelope import INSIDE, Refit
from polycube.fitting.cures.fitted import Fitted, Links
from polycube.fitting.cures.neighbourhood import RINGS, Neighbourhood, moving_vertices, with_detours
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.crossings import crossings
from polycube.hexmesh.feature_distances import TOLERANCE
from polycube.hexmesh.generation.sheets import with_sheet
from polycube.types import HexMesh

MARGIN = 2 * losses.ROUND  # boundary quads closer than this to the neighbourhood are tested
RETRY_GAIN = 0.4  # relative reduction of the cost after which a neighbourhood is fitted again
RELATIVE_GAIN = 0.02  # smallest relative reduction of the cost of an accepted cure
# a cure may reduce the least scaled Jacobian by this factor, or to a sufficient value
LOWER = 0.9
LIMITS = INSIDE * TOLERANCE, TOLERANCE  # in an envelope; final checks of features use other samples
SUFFICIENT = 0.2
NEAR = 0.005  # distance of vertices from the surface, in diagonals, that is always permitted
STRAY = 0.0025  # the same for vertices on exact features, beyond their permitted distance


@dataclass(frozen=True, eq=False)
class Placed:
    """The positions of a fit in the whole mesh."""

    number: np.ndarray  # (N',) vertices of the neighbourhood in the whole mesh
    vertices: np.ndarray  # (V', 3) of the whole mesh
    boundary: HexMesh  # the hexes at the boundary nearby, with these positions
    distance: np.ndarray  # (S,) distances of the samples of the features, as in `losses`
    away: np.ndarray  # (2, F) distances of the features

    def lost(self, fit: Fitted, in_envelope: bool) -> np.ndarray:
        """(F,) whether a feature exceeds a limit that it does not exceed in the mesh before."""
        limits, shares = (LIMITS, slice(None)) if in_envelope else (LIMITS[-1:], slice(1))
        after, before = self.away[shares], fit.away[shares]
        return np.any([(after > limit) & (before <= limit) for limit in limits], axis=(0, 1))

    def crosses(self, fit: Fitted, near: Neighbourhood) -> bool:
        """Whether the boundary crosses itself in more places than before."""
        number = len(crossings(self.boundary)) if len(self.boundary.quads) else 0
        if not number:
            return False
        own = np.isin(fit.links.sides[0], near.elements)
        own |= _close(fit, self.vertices[self.number])
        return number > len(crossings(_piece(fit.mesh, fit.links.sides[0], own)))


def placed(fit: Fitted, near: Neighbourhood, x: np.ndarray) -> Placed:
    """Place the positions (N', 3) of a neighbourhood."""
    before, old = len(fit.gap), len(near.used)
    number = np.append(near.used, np.arange(before, before + len(x) - old))
    vertices = np.append(fit.mesh.vertices, x[old:], axis=0)
    vertices[number[near.moves]] = x[near.moves]
    where = np.concatenate([fit.mesh.vertices[near.used], x])
    owner = fit.links.sides[0]
    around = _close(fit, where) & ~np.isin(owner, near.elements)
    outside, piece = _piece(fit.mesh, owner, around), near.problem.mesh
    boundary = hex_mesh(
        vertices,
        np.append(outside.hexes, number[piece.hexes], axis=0),
        np.append(outside.quads, number[piece.quads], axis=0),
    )
    samples = losses.samples_of(fit.target)
    distance = losses.moved(fit.distance, boundary, samples, where)
    away = fit.away.copy()
    changed = np.zeros(away.shape[1], bool)
    changed[samples.feature[distance != fit.distance]] = True
    own = changed[samples.feature]
    compact = np.cumsum(changed) - 1
    away[:, changed] = losses.percentiles(distance[own], compact[samples.feature[own]])
    return Placed(number, vertices, boundary, distance, away)


def inserted(fit: Fitted, near: Neighbourhood, found: Refit, at: Placed) -> Fitted:
    """The whole mesh with the new positions of a neighbourhood."""
    result = replace(fit, mesh=replace(fit.mesh, vertices=at.vertices), distance=at.distance)
    if near.inside is not None:
        inside = np.zeros(len(fit.mesh.hexes), bool)
        inside[near.elements] = near.inside
        grown = with_sheet(fit.mesh, inside)
        patch, cad_face = fit.patch[grown.patch], fit.cad_face[grown.patch]
        mesh = replace(grown, vertices=at.vertices, patch=np.arange(len(grown.quads)))
        result = replace(result, mesh=mesh, patch=patch, cad_face=cad_face, links=Links(mesh))
        detours = {
            (int(at.number[a]), int(at.number[b])): at.number[between].tolist()
            for (a, b), between in near.detours.items()
        }
        creases = fit.target.followed.creases
        paths = {k: with_detours(p, creases[k].is_loop, detours) for k, p in fit.paths.items()}
        result = replace(result, paths=paths)
    none, moved = np.zeros(len(at.vertices) - len(fit.gap)), at.number[near.moves]
    gap, strayed = np.append(fit.gap, none), np.append(fit.strayed, none)
    gap[moved], strayed[moved] = found.gap[near.moves], found.strayed[near.moves]
    return replace(result, gap=gap, strayed=strayed)


def _close(fit: Fitted, where: np.ndarray) -> np.ndarray:
    """(Q,) whether boundary quads are close to the box of some points (N, 3)."""
    low, high = where.min(axis=0) - MARGIN, where.max(axis=0) + MARGIN
    corner = fit.mesh.vertices[fit.mesh.quads]
    return ((corner.max(axis=1) > low) & (corner.min(axis=1) < high)).all(axis=1)


def _piece(mesh: HexMesh, owner: np.ndarray, which: np.ndarray) -> HexMesh:
    """The hexes (Q,) of some boundary quads (Q,)."""
    return hex_mesh(mesh.vertices, mesh.hexes[owner[which]], mesh.quads[which])


@dataclass(frozen=True, eq=False)
class Place:
    """A place to cure."""

    seeds: np.ndarray  # its poor hexes, the worst first without a sheet
    inside: np.ndarray | None = None  # (H,) hexes to surround by a sheet; None: without a sheet
    face: int = 0  # CAD face over the sheet
    rings: int = RINGS  # rings of hexes whose vertices move

    def moving(self, fit: Fitted) -> np.ndarray:
        """Vertices that move, ascending."""
        return moving_vertices(fit, self.seeds, self.inside, self.rings)


@dataclass(frozen=True, eq=False)
class Trial:
    """A tried cure: a neighbourhood, its fit, and the state before."""

    near: Neighbourhood
    found: Refit
    before: float
    least: float
    off: tuple[float, float]  # largest distances before, as in the fit

    @property
    def gain(self) -> float:
        """Reduction of the cost."""
        return self.before - self.found.cost

    @property
    def is_repair(self) -> bool:
        """Whether an invalid hex becomes valid."""
        return self.least <= 0 < self.found.least

    @property
    def is_large(self) -> bool:
        """Whether another trial may be worthwhile."""
        return self.gain > RETRY_GAIN * self.before

    def improves(self, worst: float, gain: float) -> bool:
        """Whether the cost is lower, and neither a distance nor the worst hex is much worse.

        worst : scaled Jacobian of the worst hex of the whole mesh
        gain : smallest reduction of the cost
        """
        is_lower = self.gain > max(gain, RELATIVE_GAIN * self.before)
        is_near = self.found.gap.max() <= max(NEAR, self.off[0])
        is_on = self.found.strayed.max() <= max(STRAY, self.off[1])
        least = min(LOWER * self.least, max(SUFFICIENT, worst))
        return is_lower and is_near and is_on and self.found.least >= least
