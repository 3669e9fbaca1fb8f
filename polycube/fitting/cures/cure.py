"""Improve the poor hexes of a fitted mesh, one neighbourhood at a time.

A cure either fits the neighbourhood of poor hexes again, within an envelope of the surface, or
inserts a sheet of hexes under a CAD face with flat corners. Those with the largest possible gain
for their cost are tried first. Several neighbourhoods without a common hex are fitted at the same
time.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from polycube.fitting.cures import losses
from polycube.fitting.cures.envelope import fit_in_envelope
from polycube.fitting.cures.faces import Faces
from polycube.fitting.cures.fitted import Fitted, cost, fitted, hex_costs
from polycube.fitting.cures.insertion import inserted, placed
from polycube.fitting.cures.neighbourhood import RINGS, Neighbourhood, neighbourhood
from polycube.fitting.cures.refit import Refit, refit
from polycube.hexmesh.feature_distances import TOLERANCE
from polycube.surface.fit_target import Target
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

BATCH = 4  # neighbourhoods fitted at the same time
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
# of the size: vertices closer than this to features lost by a fit are held in the next one
HELD = (0.5, 1.0, 0.0)


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
    cures.run()
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
class _Place:
    """A place to cure.

    Parameters
    ----------
    gain : cost of its poor hexes
    seeds : these hexes
    inside : (H,) hexes to surround by a sheet; None: without a sheet
    face : CAD face over the sheet
    """

    gain: float
    seeds: np.ndarray
    inside: np.ndarray | None = None
    face: int = 0


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
    """Cures tried on a mesh; the successful ones are accepted.

    current : the mesh with the accepted cures
    accepted : their number
    """

    def __init__(self, fit: Fitted, aim: float, width: float) -> None:
        self.current, self.accepted = fit, 0
        self._aim, self._width = aim, width
        self._tried = np.zeros(len(fit.jacobian), bool)  # hexes that were seeds
        self._faces = {0}  # CAD faces that had or cannot have a sheet

    def run(self) -> None:
        """Try all places."""
        while batch := self._batch():
            calls = [partial(self._trial, near, place.inside is None) for place, near in batch]
            for (place, _), trial in zip(batch, [c() for c in calls], strict=True):
                is_good = trial is not None and self._accept(trial)
                if place.inside is None:
                    again = is_good and trial.gain > RETRY_GAIN * trial.before
                    self._tried[place.seeds] = not again

    def _batch(self) -> list[tuple[_Place, Neighbourhood]]:
        """The next places and their neighbourhoods, which have no common hex."""
        taken = np.zeros(len(self._tried), bool)
        batch: list[tuple[_Place, Neighbourhood]] = []
        for place in self._places():
            if len(batch) == BATCH:
                break
            if taken[place.seeds].any():
                continue
            near = neighbourhood(self.current, place.seeds, place.inside)
            if near is None and place.inside is None:
                place = replace(place, seeds=place.seeds[:1])
                near = neighbourhood(self.current, place.seeds)
            if near is None:
                self._faces.add(place.face)
                self._tried[place.seeds] |= place.inside is None
                continue
            if not taken[near.elements].any():
                taken[near.elements] = True
                batch.append((place, near))
                self._faces.add(place.face)
        return batch

    def _places(self) -> Iterator[_Place]:
        """Places to cure, those with the largest possible gain first."""
        poor = hex_costs(self.current.jacobian, self._aim)
        left = np.where(self._tried, 0, poor)
        links = self.current.links
        while left.any():
            worst = left.argmax()
            together = links.at(links.around(links.hexes[worst], RINGS))
            seeds = together[np.argsort(-left[together], kind="stable")]
            seeds = seeds[left[seeds] > 0]
            gain = float(left[seeds].sum())
            left[seeds] = 0
            if gain > ABSOLUTE_GAIN:
                yield _Place(gain, seeds)
        sheets = [
            _Place(float(poor[inside].sum()), np.flatnonzero(inside & (poor > 0)), inside, face)
            for face, inside in Faces(self.current).with_flat_corners(self.current.cad_face)
            if face not in self._faces
        ]
        yield from sorted(
            (each for each in sheets if each.gain > ABSOLUTE_GAIN), key=lambda each: -each.gain
        )

    def _trial(self, near: Neighbourhood, is_free: bool) -> _Trial | None:
        """The fit of a neighbourhood, if it improves; a second one if the first loses features."""
        before, worst = self._before(near), float(self.current.jacobian.min())
        if not is_free:
            trial = _Trial(near, refit(near, self._aim, before[0]), *before)
            return trial if trial.improves(worst) else None
        held: np.ndarray | None = None
        for reach in HELD:
            trial = _Trial(near, fit_in_envelope(near, self._aim, self._width, held), *before)
            if not trial.improves(worst):
                return None
            lost = placed(self.current, near, trial.found.x).lost(self.current, LIMITS)
            if not lost.any():
                return trial
            close = self._close_to(near, lost, reach)
            held = close if held is None else held | close
        return None

    def _close_to(self, near: Neighbourhood, features: np.ndarray, reach: float) -> np.ndarray:
        """(N',) whether a vertex is closer to one of the features (F,) than `reach` times its size."""
        x, samples = near.problem.mesh.vertices, losses.samples_of(self.current.target)
        tree = cKDTree(samples.points[features[samples.feature]])
        return tree.query(x)[0] < reach * near.problem.size(x)

    def _before(self, near: Neighbourhood) -> tuple[float, float, tuple[float, float]]:
        """Cost of a neighbourhood, its least scaled Jacobian, and the largest distances."""
        moving, now = near.moving, self.current
        gap, strayed = now.gap[moving], now.strayed[moving]
        off = float(gap.max()), float(strayed.max())
        return *cost(now.jacobian[near.elements], gap, strayed, self._aim), off

    def _accept(self, trial: _Trial) -> bool:
        """Accept a cure if no feature exceeds its limit of distance and no crossing is added."""
        at = placed(self.current, trial.near, trial.found.x)
        limits = LIMITS if trial.near.inside is None else (TOLERANCE,)
        if at.lost(self.current, limits).any() or at.crosses(self.current, trial.near):
            return False
        self.current = inserted(self.current, trial.near, trial.found, at)
        more = len(self.current.mesh.hexes) - len(self._tried)
        self._tried = np.append(self._tried, np.zeros(more, bool))
        self.accepted += 1
        return True
