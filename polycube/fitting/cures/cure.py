"""Improve the poor hexes of a fitted mesh, one neighbourhood at a time.

First, sheets are inserted under faces with flat corners, starting with the worst hexes. Then the
neighbourhoods of poor hexes are fitted again with the boundary on the surface, and if this is not
sufficient, within an envelope of the surface.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np

from polycube.fitting.cures import losses
from polycube.fitting.cures.envelope import envelopes, fit_in_envelope
from polycube.fitting.cures.faces import Faces
from polycube.fitting.cures.fitted import Fitted, cost, fitted, hex_costs
from polycube.fitting.cures.neighbourhood import RINGS, Neighbourhood, neighbourhood, with_detours
from polycube.fitting.cures.refit import Refit, refit
from polycube.fitting.local_polish import region
from polycube.hexmesh.crossings import crossings
from polycube.hexmesh.feature_distances import TOLERANCE
from polycube.hexmesh.generation.sheets import with_sheet
from polycube.surface.fit_target import Target
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

RETRY_GAIN = 0.4  # relative reduction of the cost after which a neighbourhood is fitted again
RELATIVE_GAIN = 0.02  # smallest relative reduction of the cost of an accepted cure
ABSOLUTE_GAIN = 1e-3  # smallest absolute reduction of the cost of an accepted cure
# a cure may reduce the least scaled Jacobian by this factor, or to a sufficient value
LOWER = 0.9
SUFFICIENT = 0.2
# limits for features in an envelope; final checks use other samples
LIMITS = (0.95 * TOLERANCE, TOLERANCE)
NEAR = 0.005  # distance of vertices from the surface, in diagonals, that is always permitted
STRAY = 0.0025  # the same for vertices on exact features, beyond their permitted distance


def cure(mesh: HexMesh, target: Target, aim: float, width: float) -> HexMesh:
    """The mesh with fewer poor hexes and with sheets; no cure loses a feature or adds a crossing.

    Parameters
    ----------
    mesh : fitted mesh in model units, with exact features
    target : its surface
    aim : scaled Jacobian below which hexes are poor
    width : permitted distance of poor hexes from the surface, in diagonals

    Returns
    -------
    The same object if no hex is poor or no cure is successful.
    """
    cures = _Cures(fitted(mesh, target), aim, width)
    cures.under_faces()
    cures.in_an_envelope()
    found = cures.current
    if not cures.accepted:
        return mesh
    logger.info(
        "cure: %d places cured, %d additional hexes, smallest scaled Jacobian %.3f",
        cures.accepted,
        len(found.mesh.hexes) - len(mesh.hexes),
        found.jacobian.min(),
    )
    return replace(
        mesh,
        vertices=target.to_model(found.mesh.vertices),
        hexes=found.mesh.hexes,
        quads=found.mesh.quads,
        patch=found.patch,
        cell=found.mesh.cell,
        paths={str(number): path for number, path in found.paths.items()},
    )


@dataclass(frozen=True, eq=False)
class _Trial:
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

    def improves(self, worst: float) -> bool:
        """Whether the cost is lower, and neither a distance nor the worst hex is much worse.

        worst : scaled Jacobian of the worst hex of the whole mesh
        """
        is_lower = self.gain > max(ABSOLUTE_GAIN, RELATIVE_GAIN * self.before)
        is_on = self.found.gap.max() <= max(NEAR, self.off[0]) and self.found.strayed.max() <= max(
            STRAY, self.off[1]
        )
        return (
            is_lower
            and is_on
            and self.found.least >= min(LOWER * self.least, max(SUFFICIENT, worst))
        )


class _Cures:
    """Cures tried on a mesh in sequence; the successful ones are accepted.

    current : the mesh with the accepted cures
    accepted : their number
    """

    def __init__(self, fit: Fitted, aim: float, width: float) -> None:
        self.current, self.accepted = fit, 0
        self._aim, self._width = aim, width
        self._crossings = len(crossings(fit.mesh))

    def under_faces(self) -> None:
        """Insert sheets under the CAD faces with flat corners."""
        tried = {0}
        while True:
            faces = Faces(self.current)
            poor = hex_costs(self.current.jacobian, self._aim)
            parts = [
                (poor[inside].sum(), cad_face, inside)
                for cad_face, inside in faces.with_flat_corners(self.current.cad_face)
                if cad_face not in tried
            ]
            worst, cad_face, inside = max(parts, key=lambda each: each[:2], default=(0, 0, None))
            if worst == 0:
                return
            tried.add(cad_face)
            near = neighbourhood(self.current, np.zeros(0, np.int64), inside)
            if near is not None:
                before = self._before(near)
                trial = _Trial(near, refit(near, self._aim, before[0]), *before)
                if trial.improves(self.current.jacobian.min()):
                    self._accept(trial)

    def in_an_envelope(self) -> None:
        """Relax the boundary near the poor hexes, one neighbourhood at a time."""
        tried = np.zeros(len(self.current.jacobian), bool)
        while True:
            jacobian, hexes = self.current.jacobian, self.current.mesh.hexes
            poor = (jacobian < self._aim) & ~tried
            if not poor.any():
                return
            worst = np.flatnonzero(poor)[[jacobian[poor].argmin()]]
            together = region(hexes, len(self.current.gap), worst, RINGS).hexes
            seeds = together[jacobian[together] < self._aim]
            near = neighbourhood(self.current, seeds)
            if near is None:
                seeds, near = worst, neighbourhood(self.current, worst)
            tried[seeds] = near is None or not self._fit_in_envelope(near)

    def _fit_in_envelope(self, near: Neighbourhood) -> bool:
        """Use the exact fit if it leaves no poor hex, else a relaxed one, else the exact one.

        Returns whether the gain is large enough for another trial.
        """
        before = self._before(near)
        exact = None
        for width, hold in envelopes(self._width):
            trial = _Trial(near, fit_in_envelope(near, self._aim, width, hold), *before)
            if not trial.improves(self.current.jacobian.min()):
                continue
            if width < self._width and trial.found.least < self._aim:
                exact = trial
            elif self._accept(trial, LIMITS):
                return trial.gain > RETRY_GAIN * trial.before
        if exact is None or not self._accept(exact, LIMITS):
            return False
        return exact.gain > RETRY_GAIN * exact.before

    def _before(self, near: Neighbourhood) -> tuple[float, float, tuple[float, float]]:
        """Cost of a neighbourhood, its least scaled Jacobian, and the largest distances."""
        moving, now = near.moving, self.current
        gap, strayed = now.gap[moving], now.strayed[moving]
        off = float(gap.max()), float(strayed.max())
        return *cost(now.jacobian[near.elements], gap, strayed, self._aim), off

    def _accept(self, trial: _Trial, limits: tuple[float, ...] = (TOLERANCE,)) -> bool:
        """Accept a cure if no feature exceeds its limit of distance and no crossing is added."""
        new = _with(self.current, trial.near, trial.found)
        if any(not new.lost(limit) <= self.current.lost(limit) for limit in limits):
            return False
        number = len(crossings(new.mesh))
        if number > self._crossings:
            return False
        self.current, self._crossings = new, number
        self.accepted += 1
        return True


def _with(fit: Fitted, near: Neighbourhood, found: Refit) -> Fitted:
    """The whole mesh with the new positions of a neighbourhood."""
    mesh, before = fit.mesh, len(fit.gap)
    if near.inside is not None:
        inside = np.zeros(len(mesh.hexes), bool)
        inside[near.elements] = near.inside
        mesh = with_sheet(mesh, inside)
    number = np.append(near.used, np.arange(before, len(mesh.vertices)))  # in the whole mesh
    moved = number[near.moves]
    vertices = mesh.vertices.copy()
    vertices[moved] = found.x[near.moves]
    none = np.zeros(len(vertices) - before)
    gap, strayed = np.append(fit.gap, none), np.append(fit.strayed, none)
    gap[moved], strayed[moved] = found.gap[near.moves], found.strayed[near.moves]
    detours = {
        (int(number[a]), int(number[b])): number[between].tolist()
        for (a, b), between in near.detours.items()
    }
    creases = fit.target.followed.creases
    new = replace(mesh, vertices=vertices, patch=np.arange(len(mesh.quads)))
    where = np.concatenate([fit.mesh.vertices[near.used], found.x])
    return replace(
        fit,
        mesh=new,
        patch=fit.patch[mesh.patch],
        paths={k: with_detours(p, creases[k].is_loop, detours) for k, p in fit.paths.items()},
        cad_face=fit.cad_face[mesh.patch],
        gap=gap,
        strayed=strayed,
        distance=losses.moved(fit.distance, new, losses.samples_of(fit.target), where),
    )
