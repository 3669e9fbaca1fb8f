"""Truncated hierarchical splines: coarse functions on coarse elements, fine ones on fine ones.

Level l has functions C_l on Omega_l and on a ring of ghost elements. Functions with support in
Omega_l that meet an active element are active. Coarser functions are truncated by the active ones:
T_0 = E_0, T_l+1 = D S T_l + E, where S is the two-scale matrix, E the unit rows of active
functions, and D selects all others (Giannelli, Juettler, Speleers 2012). Active elements have the
rows C_l T_l + X_l, where the remainders R = cut(C_l) - C_l+1 S are carried along: X_l+1 = cut(X_l)
+ R A. They are 0 if the levels are nested; for h2s, which is not nested, they keep the levels
continuous. A is T_l, except that a function with support in Omega_l+1, which no longer exists,
follows the finer function to which it contributes most.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Protocol

import numpy as np
from scipy.sparse import csr_matrix, diags, vstack

from polycube.spline.boundary import Elements
from polycube.spline.spaces.extraction import NO_INDICES
from polycube.spline.spaces.subdivision import bezier_halves
from polycube.types import Spline

logger = logging.getLogger(__name__)

CORNER_NODES = [0, 3, 12, 15, 48, 51, 60, 63]
NESTED = 1e-10  # smaller remainders are rounding errors
TINY = 1e-13  # smaller coefficients are rounding errors


class Space(Elements, Protocol):
    """A spline space on some elements of one level, which can be refined separately."""

    @property
    def control(self) -> np.ndarray:
        """(C, 3) control points."""

    @property
    def patch(self) -> np.ndarray:
        """(Q,) polycube face of each boundary face."""

    def finer(self, elements: np.ndarray) -> tuple[Space, csr_matrix]:
        """The space of the children, 8 i to 8 i + 7 of elements[i] in VTK corner order, and S.

        S (C', C) represents the coarse functions. Both must be correct only where the neighbours of
        the children are children as well.
        """


@dataclass(frozen=True)
class Level:
    """One level of a hierarchy."""

    space: Space
    inside: np.ndarray  # (E,) whether an element is in Omega_l; the others are ghosts
    hex: np.ndarray  # (E,) original hex of each element
    halved: int = 0  # number of times that it was divided
    two_scale: csr_matrix = field(default_factory=lambda: csr_matrix((0, 0)))  # (C_l, C_l-1)
    # (E / 8,) parents in the level before
    parents: np.ndarray = field(default_factory=lambda: NO_INDICES)

    @property
    def refined(self) -> np.ndarray:
        """Elements of the level before that form Omega_l, in the order of their children."""
        return self.parents[: self.inside.sum() // 8]


def coarsest(space: Space, halvings: int = 0) -> Level:
    """Level 0: all elements of a space, each divided into eight repeatedly."""
    origin = np.arange(len(space.nodes))
    for _ in range(halvings):
        space, _ = space.finer(np.arange(len(space.nodes)))
        origin = np.repeat(origin, 8)
    return Level(space, np.ones(len(origin), bool), origin, halvings)


def finer_level(level: Level, elements: np.ndarray) -> Level:
    """The children of some elements, in their order, followed by a ring of ghost elements."""
    parents = np.concatenate([elements, np.setdiff1d(ring(level.space, elements), elements)])
    space, two_scale = level.space.finer(parents)
    inside = np.repeat(np.arange(len(parents)) < len(elements), 8)
    origin = np.repeat(level.hex[parents], 8)
    return Level(space, inside, origin, level.halved + 1, two_scale, parents)


def ring(space: Space, elements: np.ndarray) -> np.ndarray:
    """The elements and all elements that touch them, ascending."""
    corners = space.nodes[:, CORNER_NODES]
    near = np.zeros(space.nodes.max() + 1, bool)
    near[corners[elements]] = True
    return np.flatnonzero(near[corners].any(axis=1))


def hierarchical_spline(levels: list[Level], extraordinary_edges: int = 0) -> Spline:
    """The truncated hierarchical spline of some levels, the elements of the coarsest first."""
    pairs = zip(levels, [*(finer.refined for finer in levels[1:]), NO_INDICES], strict=True)
    # elements of Omega_l that are not refined further, ascending
    active = [np.setdiff1d(np.flatnonzero(level.inside), finer) for level, finer in pairs]
    functions = [_functions(*pair) for pair in zip(levels, active, strict=True)]
    truncated = _truncated(levels, [own for own, _ in functions])
    carried = _carried(levels, truncated, [removed for _, removed in functions])
    most = max(abs(part).max() for part in carried)
    if most > NESTED:
        affected = sum((abs(part).max(axis=1) > NESTED).sum() for part in carried)
        message = "levels are not nested: remainders up to %.3g carried to %d Bezier nodes"
        logger.info(message, most, affected)
    rows, nodes, sides, patch = [], [], [], []
    n_nodes = n_elements = 0
    for level, elements, coefficients, more in zip(levels, active, truncated, carried, strict=True):
        space = level.space
        used, local = np.unique(space.nodes[elements], return_inverse=True)
        rows.append(space.extraction[used] @ coefficients + more[used])
        nodes.append(n_nodes + local.reshape(-1, 64))
        number = np.full(len(space.nodes), -1)
        number[elements] = n_elements + np.arange(len(elements))
        outer = number[space.sides[:, 0]] >= 0
        sides.append(np.stack([number[space.sides[outer, 0]], space.sides[outer, 1]], axis=1))
        patch.append(space.patch[outer])
        n_nodes, n_elements = n_nodes + len(used), n_elements + len(elements)
    together = list(zip(levels, active, functions, strict=True))
    for level, elements, (own, _) in together:
        logger.info("level %d: %d elements, %d functions", level.halved, len(elements), len(own))
    return Spline(
        control=np.concatenate([level.space.control[own] for level, _, (own, _) in together]),
        extraction=vstack(rows, format="csr"),
        nodes=np.concatenate(nodes),
        element_hex=np.concatenate([level.hex[elements] for level, elements, _ in together]),
        level=np.repeat([level.halved for level in levels], [len(e) for e in active]),
        sides=np.concatenate(sides),
        patch=np.concatenate(patch),
        extraordinary_edges=extraordinary_edges,
    )


def _functions(level: Level, active: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Functions with support in Omega_l that meet an active element, and the other functions."""
    nodes, n_nodes = level.space.nodes, level.space.extraction.shape[0]
    support = abs(level.space.extraction).T
    meets_active, meets_outside = (
        support @ np.bincount(nodes[elements].ravel(), minlength=n_nodes) > TINY
        for elements in (active, ~level.inside)
    )
    inside = ~meets_outside
    return np.flatnonzero(inside & meets_active), np.flatnonzero(inside & ~meets_active)


def _truncated(levels: list[Level], active: list[np.ndarray]) -> list[csr_matrix]:
    """[l] T_l (C_l, all active functions)."""
    ends = np.cumsum([0, *map(len, active)])
    found: list[csr_matrix] = []
    for level, own, start in zip(levels, active, ends, strict=False):
        n = level.space.extraction.shape[1]
        unit = csr_matrix((np.ones(len(own)), (own, start + np.arange(len(own)))), (n, ends[-1]))
        if found:
            others = np.ones(n)
            others[own] = 0
            unit = (diags(others) @ level.two_scale @ found[-1] + unit).tocsr()
        found.append(unit)
    return found


def _carried(
    levels: list[Level], truncated: list[csr_matrix], removed: list[np.ndarray]
) -> list[csr_matrix]:
    """[l] X_l (B_l, all active functions)."""
    all_of = truncated.copy()
    for i in range(len(levels) - 2, -1, -1):
        coarse_to_fine = levels[i + 1].two_scale.tocsc()
        successors = np.asarray(coarse_to_fine[:, removed[i]].argmax(axis=0)).ravel()
        factor = np.ones(truncated[i].shape[0])
        factor[removed[i]] = 0
        shape = truncated[i].shape[0], truncated[i + 1].shape[0]
        follow = csr_matrix((np.ones(len(successors)), (removed[i], successors)), shape)
        all_of[i] = diags(factor) @ truncated[i] + follow @ all_of[i + 1]
    found = [csr_matrix((levels[0].space.extraction.shape[0], truncated[0].shape[1]))]
    for i, (coarse, fine) in enumerate(pairwise(levels)):
        found.append(remainder(coarse, fine) @ all_of[i])
        if found[i].nnz:
            found[-1] += _cut(coarse, fine, np.unique(fine.space.nodes[fine.inside])) @ found[i]
    return found


def _cut(coarse: Level, fine: Level, at: np.ndarray) -> csr_matrix:
    """(B_l+1, B_l) exact Bezier nodes `at` of Omega_l+1 from the coarser ones."""
    n = fine.space.extraction.shape[0], coarse.space.extraction.shape[0]
    halves = bezier_halves(coarse.space.nodes[fine.parents], fine.space.nodes, at, n[1])
    select = csr_matrix((np.ones(len(at)), (at, np.arange(len(at)))), (n[0], len(at)))
    return (select @ halves).tocsr()


def remainder(coarse: Level, fine: Level) -> csr_matrix:
    """(B_l+1, C_l) matrix R: error of the finer functions on Omega_l+1 for the coarser ones.

    It is computed only where two random combinations of coarser functions have an error.
    """
    at = np.unique(fine.space.nodes[fine.inside])
    before, after, two_scale = coarse.space.extraction, fine.space.extraction, fine.two_scale
    cut = _cut(coarse, fine, at)
    sample = np.random.default_rng(0).standard_normal((before.shape[1], 2))
    missed = abs(cut @ (before @ sample) - after @ (two_scale @ sample)).max(axis=1) > NESTED
    here = np.zeros(len(missed))
    here[at] = missed[at]
    mask = diags(here)
    return (mask @ cut) @ before - (mask @ after) @ two_scale
