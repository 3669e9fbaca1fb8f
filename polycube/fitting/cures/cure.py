"""Cure the poor hexes of a fitted mesh, one place at a time.

First the faces with flat corners have sheets, those with the worst hexes first.  Then what is near
poor hexes is fitted anew with its boundary on the surface, and if that is not enough within an
envelope of it.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np

from polycube.fitting.cures import losses
from polycube.fitting.cures.envelope import envelopes, loosened
from polycube.fitting.cures.faces import Faces
from polycube.fitting.cures.fitted import Fitted, cost, fitted, poorness
from polycube.fitting.cures.neighbourhood import RINGS, Neighbourhood, neighbourhood, with_detours
from polycube.fitting.cures.refit import Refit, refit
from polycube.fitting.local_polish import region
from polycube.hexmesh.crossings import crossings
from polycube.hexmesh.feature_distances import TOLERANCE
from polycube.hexmesh.generation.sheets import with_sheet
from polycube.surface.fit_target import Target
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

ENOUGH = 0.4  # share of the cost of a place that a fit takes away, with which it is tried again
LEAST = 0.02  # the same with which a cure is kept
LITTLE = 1e-3  # cost whose loss is no gain
LOWER = 0.9  # share of the least scaled Jacobian that a cure may leave, if that is not
FINE = 0.2  # more than this
LIMITS = (0.95 * TOLERANCE, TOLERANCE)  # of a feature in an envelope: others sample it elsewhere
NEAR = 0.005  # distance of vertices from the surface, in diagonals, that any cure may leave
STRAY = 0.0025  # the same beyond what is no loss, from exact features


def cure(mesh: HexMesh, target: Target, aim: float, width: float) -> HexMesh:
    """The mesh with fewer poor hexes, and with sheets; no cure loses a feature or makes a crossing.

    Parameters
    ----------
    mesh : fitted, in model units, with exact features
    target : its surface
    aim : scaled Jacobian below which hexes are poor
    width : distance from the surface that poor hexes may have, in diagonals

    Returns
    -------
    The same object where no hex is poor or nothing helps.
    """
    cures = _Cures(fitted(mesh, target), aim, width)
    cures.under_faces()
    cures.in_an_envelope()
    found = cures.whole
    if not cures.kept:
        return mesh
    logger.info(
        "cure: %d places cured, %d additional hexes, smallest scaled Jacobian %.3f",
        cures.kept,
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
    """A cure that was tried: a neighbourhood, its fit, and what there was before."""

    near: Neighbourhood
    found: Refit
    before: float
    least: float
    off: tuple[float, float]  # largest distances before, as those of the fit

    @property
    def gain(self) -> float:
        """Cost that it takes away."""
        return self.before - self.found.cost

    def helps(self, worst: float) -> bool:
        """Whether the cost is lower, and neither a distance nor the worst hex much worse.

        worst : scaled Jacobian of the worst hex of the whole mesh
        """
        is_lower = self.gain > max(LITTLE, LEAST * self.before)
        is_on = self.found.gap.max() <= max(NEAR, self.off[0]) and self.found.strayed.max() <= max(
            STRAY, self.off[1]
        )
        return is_lower and is_on and self.found.least >= min(LOWER * self.least, max(FINE, worst))


class _Cures:
    """Trials on a mesh, one after the other; what helps is kept."""

    def __init__(self, whole: Fitted, aim: float, width: float) -> None:
        self.whole, self.kept = whole, 0
        self._aim, self._width = aim, width
        self._crossings = len(crossings(whole.mesh))

    def under_faces(self) -> None:
        """Put sheets under the CAD faces with flat corners."""
        tried = {0}
        while True:
            faces = Faces(self.whole)
            poor = poorness(self.whole.jacobian, self._aim)
            parts = [
                (poor[inside].sum(), cad_face, inside)
                for cad_face, inside in faces.with_flat_corners(self.whole.cad_face)
                if cad_face not in tried
            ]
            worst, cad_face, inside = max(parts, key=lambda each: each[:2], default=(0, 0, None))
            if worst == 0:
                return
            tried.add(cad_face)
            near = neighbourhood(self.whole, np.zeros(0, np.int64), inside)
            if near is not None:
                before = self._before(near)
                trial = _Trial(near, refit(near, self._aim, before[0]), *before)
                if trial.helps(self.whole.jacobian.min()):
                    self._keep(trial)

    def in_an_envelope(self) -> None:
        """Loosen the boundary round the poor hexes, place by place."""
        tried = np.zeros(len(self.whole.jacobian), bool)
        while True:
            jacobian, hexes = self.whole.jacobian, self.whole.mesh.hexes
            poor = (jacobian < self._aim) & ~tried
            if not poor.any():
                return
            worst = np.flatnonzero(poor)[[jacobian[poor].argmin()]]
            together = region(hexes, len(self.whole.gap), worst, RINGS).hexes
            seeds = together[jacobian[together] < self._aim]
            near = neighbourhood(self.whole, seeds)
            if near is None:
                seeds, near = worst, neighbourhood(self.whole, worst)
            tried[seeds] = near is None or not self._loosened(near)

    def _loosened(self, near: Neighbourhood) -> bool:
        """Keep the exact fit if no hex is poor with it, else a loosened one, else the exact one;
        whether much is gained.
        """
        before = self._before(near)
        exact = None
        for width, hold in envelopes(self._width):
            trial = _Trial(near, loosened(near, self._aim, width, hold), *before)
            if not trial.helps(self.whole.jacobian.min()):
                continue
            if width < self._width and trial.found.least < self._aim:
                exact = trial
            elif self._keep(trial, LIMITS):
                return trial.gain > ENOUGH * trial.before
        if exact is None or not self._keep(exact, LIMITS):
            return False
        return exact.gain > ENOUGH * exact.before

    def _before(self, near: Neighbourhood) -> tuple[float, float, tuple[float, float]]:
        """Cost of a place, least scaled Jacobian there, and the largest distances."""
        moving, now = near.moving, self.whole
        gap, strayed = now.gap[moving], now.strayed[moving]
        off = float(gap.max()), float(strayed.max())
        return *cost(now.jacobian[near.elements], gap, strayed, self._aim), off

    def _keep(self, trial: _Trial, limits: tuple[float, ...] = (TOLERANCE,)) -> bool:
        """Take a cure, if it brings no feature beyond a limit of its distance from the mesh, and
        the boundary crosses itself no more.
        """
        new = _with(self.whole, trial.near, trial.found)
        if any(not new.lost(limit) <= self.whole.lost(limit) for limit in limits):
            return False
        number = len(crossings(new.mesh))
        if number > self._crossings:
            return False
        self.whole, self._crossings = new, number
        self.kept += 1
        return True


def _with(whole: Fitted, near: Neighbourhood, found: Refit) -> Fitted:
    """The whole mesh with a neighbourhood as it was fitted."""
    mesh, before = whole.mesh, len(whole.gap)
    if near.inside is not None:
        inside = np.zeros(len(mesh.hexes), bool)
        inside[near.elements] = near.inside
        mesh = with_sheet(mesh, inside)
    number = np.append(near.used, np.arange(before, len(mesh.vertices)))  # in the whole
    moved = number[near.moves]
    vertices = mesh.vertices.copy()
    vertices[moved] = found.x[near.moves]
    none = np.zeros(len(vertices) - before)
    gap, strayed = np.append(whole.gap, none), np.append(whole.strayed, none)
    gap[moved], strayed[moved] = found.gap[near.moves], found.strayed[near.moves]
    detours = {
        (int(number[a]), int(number[b])): number[between].tolist()
        for (a, b), between in near.detours.items()
    }
    creases = whole.target.followed.creases
    new = replace(mesh, vertices=vertices, patch=np.arange(len(mesh.quads)))
    where = np.concatenate([whole.mesh.vertices[near.used], found.x])
    return replace(
        whole,
        mesh=new,
        patch=whole.patch[mesh.patch],
        paths={k: with_detours(p, creases[k].is_loop, detours) for k, p in whole.paths.items()},
        cad_face=whole.cad_face[mesh.patch],
        gap=gap,
        strayed=strayed,
        distance=losses.moved(whole.distance, new, losses.samples_of(whole.target), where),
    )
