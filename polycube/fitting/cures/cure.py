"""Improve the poor hexes of a fitted mesh, one neighbourhood at a time.

A cure either fits the neighbourhood of poor hexes again, within an envelope of the surface, or
inserts a sheet of hexes under a CAD face with flat corners. Those with the largest possible gain
for their cost are tried first. Several neighbourhoods without a common hex are fitted at the same
time. A hex whose Jacobian is not positive everywhere counts as flat.
"""

import logging
from collections import Counter
from collections.abc import Iterator
from contextvars import copy_context
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from polycube.fitting.cures import losses
from polycube.fitting.cures.envelope import evaluated, fit_in_envelope, refit
from polycube.fitting.cures.fitted import Fitted, cost, fitted, hex_costs, with_flat_corners
from polycube.fitting.cures.insertion import SUFFICIENT, Place, Trial, inserted, placed
from polycube.fitting.cures.neighbourhood import RINGS, Neighbourhood, neighbourhood
from polycube.numerics.lbfgs import count_more, counted
from polycube.numerics.threads import side_by_side
from polycube.surface.fit_target import Target
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

BATCH = 4  # neighbourhoods fitted at the same time
DENSE = 4e-3  # cost per hex of a neighbourhood above which a sheet is tried first
# evaluations times hexes, per hex of the mesh (at least FEW), after which no place is tried
BUDGET, FEW = 2000, 3000
FURTHER = 0.5  # the share of this work for passes without sheets
ABSOLUTE_GAIN = 2e-4  # smallest reduction of the cost of an accepted cure of poor hexes
SHARE = 2e-3  # smallest share of the cost of all hexes in a single place that is tried
# after a fit that loses features: the share of the envelope for vertices close to them in the next
# fit, and how close, relative to the size; without an envelope they are held
NARROWER = ((0.5, 1.0), (0.0, 0.5), (0.0, 1.0), (1.0, 0.0))
PARTS = 0.75, 0.5, 0.25  # parts of the moves of such a fit that are tried at last
# for poor hexes and for all: the rings of hexes whose vertices move, and whether fits start on the
# surface and are taken in part, or without being moved back, if they fail otherwise
POOR = (1, True), (2, True)
PASSES = (2, False), (RINGS, False), (2, True), (RINGS, True), (1, True)


def cure(mesh: HexMesh, target: Target, aim: float, width: float, further: float = 0.0) -> HexMesh:
    """The mesh with fewer poor hexes and with sheets; no cure loses a feature or adds a crossing.

    Returns the same object if no hex is poor or no cure is successful.

    mesh : fitted mesh in model units, with exact features
    target : its surface
    aim : scaled Jacobian below which hexes are poor
    width : permitted distance of poor hexes from the surface, in diagonals
    further : scaled Jacobian below which hexes are improved afterwards, without further sheets
    """
    cures = _Cures(fitted(mesh, target), aim, width)
    is_complete = cures.run(DENSE)
    if is_complete and cures.current.jacobian.min() < SUFFICIENT:
        is_complete = cures.run(0.0)  # again, with all sheets first
    if is_complete:
        cures.raise_to(aim, POOR)
        cures.raise_to(max(aim, further), PASSES)
    found = cures.current
    if not cures.accepted:
        return mesh
    more, least = len(found.mesh.hexes) - len(mesh.hexes), found.jacobian.min()
    form = "cure: %d places cured, %d additional hexes, smallest scaled Jacobian %.3f"
    logger.info(form, cures.accepted, more, least)
    return replace(
        mesh,
        vertices=target.to_model(found.mesh.vertices),
        hexes=found.mesh.hexes,
        quads=found.mesh.quads,
        patch=found.patch,
        cell=found.mesh.cell,
        paths={str(number): path for number, path in found.paths.items()},
    )


class _Cures:
    """Cures tried on a mesh; the successful ones are accepted.

    current : the mesh with the accepted cures
    accepted : their number
    """

    def __init__(self, fit: Fitted, aim: float, width: float) -> None:
        self.current, self.accepted = fit, 0
        self._aim, self._width, self._work = aim, width, 0  # work: evaluations times hexes
        self._tried = np.zeros(len(fit.jacobian), bool)  # hexes that were seeds
        self._faces = {0}  # CAD faces that had or cannot have a sheet
        self._dense: list[Place] | None = None  # faces with many poor hexes; None: not known
        self._limit: float | None = DENSE  # `dense` of `run`
        self._gain, self._rings, self._is_last = ABSOLUTE_GAIN, RINGS, False  # see PASSES
        self._failed: dict[int, Counter[str]] = {}  # efforts of failed trials, which count again

    def raise_to(self, aim: float, passes: tuple[tuple[int, bool], ...]) -> None:
        """Improve the hexes below an aim, without sheets, by any absolute gain."""
        self._aim, self._gain = aim, 0.0
        budget, before = FURTHER * BUDGET, -1
        while budget > 0 and self.accepted > before:  # again, next to the improved hexes
            before = self.accepted
            for self._rings, self._is_last in passes:
                self.run(None, budget)
                budget -= self._work / max(FEW, len(self._tried))

    def run(self, dense: float | None, budget: float = BUDGET) -> bool:
        """Try places until none is left, or the work per hex exceeds a budget; whether none is.

        dense : cost per hex of a neighbourhood above which a sheet is tried first; None: no sheets
        """
        self._tried[:], self._faces, self._work = False, {0}, 0
        self._dense, self._limit = None, dense
        while self._work < budget * max(FEW, len(self._tried)) and (batch := self._batch()):
            calls = [partial(copy_context().run, self._counted, *each) for each in batch]
            for (place, near), (trial, effort) in zip(batch, side_by_side(calls), strict=True):
                count_more(effort)
                self._work += effort["evaluations"] * len(near.problem.hexes)
                again = trial is not None and self._accept(trial) and trial.is_large
                if place.inside is None and not again:  # the worst hex is tried once more alone
                    self._tried[place.seeds[min(1, len(place.seeds) - 1) :]] = True
        return self._work < budget * max(FEW, len(self._tried))

    def _counted(self, place: Place, near: Neighbourhood) -> tuple[Trial | None, Counter[str]]:
        """A trial and its effort; one that failed before is not repeated."""
        now = self._aim, self._gain, self._is_last, self.current.jacobian.min(), place.face
        key = hash((*now, near.problem.mesh.vertices.tobytes(), near.moves.tobytes()))
        if key in self._failed:
            return None, self._failed[key]
        with counted(is_alone=True) as effort:
            trial = (self._envelope if place.inside is None else self._refitted)(near)
        if trial is None:
            self._failed[key] = effort
        return trial, effort

    def _batch(self) -> list[tuple[Place, Neighbourhood]]:
        """The next places and their neighbourhoods, which have no common hex."""
        taken = np.zeros(len(self._tried), bool)
        batch: list[tuple[Place, Neighbourhood]] = []
        for place in self._places():
            if taken[self.current.links.at(place.moving(self.current))].any():
                continue
            near = neighbourhood(self.current, place.seeds, place.inside, place.rings)
            if near is None and place.inside is None:
                place = replace(place, seeds=place.seeds[:1])
                near = neighbourhood(self.current, place.seeds, rings=place.rings)
            self._faces.add(place.face)
            if near is not None:
                taken[near.elements] = True
                batch.append((place, near))
            elif place.inside is None:
                self._tried[place.seeds] = True
            if len(batch) == BATCH:
                break
        return batch

    def _places(self) -> Iterator[Place]:
        """Places to cure: faces with many poor hexes, then single places, then other faces."""
        if self._dense is None:
            least = self._limit or 0.0
            self._dense = [place for density, place in self._sheets() if density > least]
        yield from (place for place in self._dense if place.face not in self._faces)
        poor, links = hex_costs(self.current.jacobian, self._aim), self.current.links
        least = max(self._gain, SHARE * poor.sum())
        left = np.where(self._tried, 0, poor)
        while left.any():
            together = links.at(links.around(links.hexes[left.argmax()], self._rings))
            seeds = together[np.argsort(-left[together], kind="stable")]
            seeds = seeds[left[seeds] > 0]
            if left[seeds].sum() > least:
                yield Place(seeds, rings=self._rings)
            left[seeds] = 0
        yield from (place for _, place in self._sheets())

    def _sheets(self) -> list[tuple[float, Place]]:
        """Places for sheets with the cost per hex of their neighbourhood, in descending order."""
        if self._limit is None:
            return []
        poor, links = hex_costs(self.current.jacobian, self._aim), self.current.links
        found = []
        for face, inside in with_flat_corners(self.current):
            gain = float(poor[inside].sum())
            if face not in self._faces and gain > self._gain:
                place = Place(np.flatnonzero(inside & (poor > 0)), inside, face)
                found.append((gain / len(links.at(place.moving(self.current))), place))
        return sorted(found, key=lambda each: (-each[0], each[1].face))

    def _refitted(self, near: Neighbourhood) -> Trial | None:
        """The fit of a neighbourhood outside of an envelope, if it improves."""
        before = self._before(near)
        trial = Trial(near, refit(near, self._aim, before[0]), *before)
        return trial if self._improves(trial) else None

    def _envelope(self, near: Neighbourhood) -> Trial | None:
        """The fit of a neighbourhood, if it improves; again or in part if it loses features.

        An invalid hex is repaired even then.
        """
        before, held = self._before(near), np.zeros(len(near.moves), bool)
        width, repair = np.full(len(held), self._width), None
        x, moves = near.problem.mesh.vertices, []
        for share, reach in NARROWER:
            fits = fit_in_envelope(near, self._aim, width, held, self._is_last)
            trials = (Trial(near, each, *before) for each in fits[: 1 + self._is_last])
            if (trial := next(filter(self._improves, trials), None)) is None:
                break
            if not (lost := self._lost(trial)).any():
                return trial
            moves.append(trial.found.x - x)
            repair = repair or (trial if trial.is_repair else None)
            samples = losses.samples_of(self.current.target)
            apart, _ = cKDTree(samples.points[lost[samples.feature]]).query(x)
            is_near = apart < reach * near.problem.size(x)
            width[is_near], held[is_near] = share * self._width, not share
        if before[1] <= 0:
            return repair or self._refitted(near)
        parts = (x + part * move for move in moves if self._is_last for part in PARTS)
        trials = (Trial(near, evaluated(near, part, self._aim), *before) for part in parts)
        return next((t for t in trials if self._improves(t) and not self._lost(t).any()), None)

    def _improves(self, trial: Trial) -> bool:
        return trial.improves(self.current.jacobian.min(), self._gain)

    def _lost(self, trial: Trial) -> np.ndarray:
        """(F,) whether a feature is lost by a trial, or about to be."""
        return placed(self.current, trial.near, trial.found.x).lost(self.current, True)

    def _before(self, near: Neighbourhood) -> tuple[float, float, tuple[float, float]]:
        """Cost of a neighbourhood, its least scaled Jacobian, and the largest distances."""
        moving, now = near.moving, self.current
        gap, strayed = now.gap[moving], now.strayed[moving]
        off = float(gap.max()), float(strayed.max())
        return *cost(now.jacobian[near.elements], gap, strayed, self._aim), off

    def _accept(self, trial: Trial) -> bool:
        """Accept a cure if it adds no crossing and loses no feature; a repair may lose features."""
        at = placed(self.current, trial.near, trial.found.x)
        loses = not trial.is_repair and at.lost(self.current, trial.near.inside is None).any()
        if loses or at.crosses(self.current, trial.near):
            return False
        self.current = inserted(self.current, trial.near, trial.found, at)
        more = len(self.current.mesh.hexes) - len(self._tried)
        self._tried = np.append(self._tried, np.zeros(more, bool))
        self._dense = None if more else self._dense
        self.accepted += 1
        return True
