"""Truncated hierarchical splines: coarse functions where elements are coarse, fine where fine.

Level l has a spline space on some elements, Omega_l of them refined so far and a ring of ghosts
round these.  Its functions with support in Omega_l that meet an active element are active; those
of coarser levels lose what active ones span: T_0 = E_0, T_l+1 = D S T_l + E, with the two-scale
matrix S, E the unit rows of the active functions and D those of the others (Giannelli, Juettler
and Speleers 2012).  The Bezier points of an active element of level l are its rows of C_l T_l.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.sparse import csr_matrix, diags, vstack

from polycube.spline.subdivision import bezier_halves
from polycube.types import Spline

logger = logging.getLogger(__name__)

CORNER_NODES = [0, 3, 12, 15, 48, 51, 60, 63]
TINY = 1e-13  # coefficients below it are rounding


class Space(Protocol):
    """A spline space on some elements of one level, which are refined without their neighbours."""

    control: np.ndarray  # (C, 3)
    extraction: csr_matrix  # (B, C), rows sum to 1
    nodes: np.ndarray  # (E, 64)
    sides: np.ndarray  # (Q, 2) element and face, on the solid's boundary
    patch: np.ndarray  # (Q,)

    def finer(self, elements: np.ndarray) -> tuple[Space, csr_matrix]:
        """The space of the children, 8 i to 8 i + 7 of elements[i] in VTK corner order, and S.

        S (C', C) expresses the coarse functions.  Both need be right only where the children's
        neighbours are children too.
        """


@dataclass(frozen=True)
class Level:
    """One level of a hierarchy."""

    space: Space
    inside: np.ndarray  # (E,) whether in Omega_l; the others are ghosts
    hex: np.ndarray  # (E,) each comes from
    halved: int = 0  # how often it was
    two_scale: csr_matrix | None = None  # (C_l, C_l-1); None at level 0
    parents: np.ndarray | None = None  # (E / 8,) elements of the level before

    @property
    def refined(self) -> np.ndarray:
        """Elements of the level before that Omega_l consists of, in the order of their children."""
        return self.parents[: self.inside.sum() // 8]


def coarsest(space: Space, halvings: int = 0) -> Level:
    """All of a space, every element in eight so often, as level 0."""
    origin = np.arange(len(space.nodes))
    for _ in range(halvings):
        space, _ = space.finer(np.arange(len(space.nodes)))
        origin = np.repeat(origin, 8)
    return Level(space, np.ones(len(origin), bool), origin, halvings)


def finer_level(level: Level, elements: np.ndarray) -> Level:
    """The children of some elements, in their order, and after them a ring of ghosts."""
    parents = np.concatenate([elements, np.setdiff1d(ring(level.space, elements), elements)])
    space, two_scale = level.space.finer(parents)
    inside = np.repeat(np.arange(len(parents)) < len(elements), 8)
    origin = np.repeat(level.hex[parents], 8)
    return Level(space, inside, origin, level.halved + 1, two_scale, parents)


def ring(space: Space, elements: np.ndarray) -> np.ndarray:
    """The elements and all that touch them, ascending."""
    corners = space.nodes[:, CORNER_NODES]
    near = np.zeros(space.nodes.max() + 1, bool)
    near[corners[elements]] = True
    return np.flatnonzero(near[corners].any(axis=1))


def gaps(coarse: Level, fine: Level, at: np.ndarray) -> np.ndarray:
    """(N,) how far the finer functions at some Bezier nodes of Omega miss the coarser ones.

    The latter are cut exactly, by de Casteljau's rule; the difference is one of coefficients.
    """
    space, before = fine.space, coarse.space
    exact = bezier_halves(before.nodes[fine.parents], space.nodes, at, before.extraction.shape[0])
    missed = exact @ before.extraction - space.extraction[at] @ fine.two_scale
    return abs(missed).max(axis=1).toarray().ravel()


def interface(fine: Level) -> np.ndarray:
    """Bezier nodes that Omega shares with ghosts."""
    nodes = fine.space.nodes
    return np.intersect1d(nodes[fine.inside], nodes[~fine.inside])


def hierarchical_spline(levels: list[Level], extraordinary_edges: int = 0) -> Spline:
    """The truncated hierarchical spline of some levels, the elements of the coarsest first."""
    active = [
        _active_elements(level, finer)
        for level, finer in zip(levels, [*levels[1:], None], strict=True)
    ]
    functions = [_active_functions(*pair) for pair in zip(levels, active, strict=True)]
    for level, elements, own in zip(levels, active, functions, strict=True):
        logger.info("level %d: %d elements, %d functions", level.halved, len(elements), len(own))
    first = np.cumsum([0, *map(len, functions)])
    rows, nodes, sides, patch, truncated = [], [], [], [], None
    n_nodes = n_elements = 0
    for level, elements, own, start in zip(levels, active, functions, first, strict=False):
        space = level.space
        truncated = _truncated(level, truncated, own, start, first[-1])
        used, local = np.unique(space.nodes[elements], return_inverse=True)
        rows.append(space.extraction[used] @ truncated)
        nodes.append(n_nodes + local.reshape(-1, 64))
        number = np.full(len(space.nodes), -1)
        number[elements] = n_elements + np.arange(len(elements))
        outer = number[space.sides[:, 0]] >= 0
        sides.append(np.stack([number[space.sides[outer, 0]], space.sides[outer, 1]], axis=1))
        patch.append(space.patch[outer])
        n_nodes, n_elements = n_nodes + len(used), n_elements + len(elements)
    pairs = list(zip(levels, active, strict=True))
    return Spline(
        control=np.concatenate(
            [level.space.control[own] for level, own in zip(levels, functions, strict=True)]
        ),
        extraction=vstack(rows, format="csr"),
        nodes=np.concatenate(nodes),
        element_hex=np.concatenate([level.hex[elements] for level, elements in pairs]),
        level=np.concatenate([np.full(len(elements), level.halved) for level, elements in pairs]),
        sides=np.concatenate(sides),
        patch=np.concatenate(patch),
        extraordinary_edges=extraordinary_edges,
    )


def _active_elements(level: Level, finer: Level | None) -> np.ndarray:
    """Elements of Omega_l that are not refined further, ascending."""
    is_active = level.inside.copy()
    if finer is not None:
        is_active[finer.refined] = False
    return np.flatnonzero(is_active)


def _active_functions(level: Level, active: np.ndarray) -> np.ndarray:
    """Functions with support in Omega_l that meet an active element, ascending."""
    nodes, shape = level.space.nodes, (len(level.space.nodes), level.space.extraction.shape[0])
    has = csr_matrix((np.ones(nodes.size), nodes.ravel(), np.arange(len(nodes) + 1) * 64), shape)
    meets = has[active].sum(axis=0), has[~level.inside].sum(axis=0)
    support = abs(level.space.extraction).T
    mine, others = (support @ np.asarray(count).ravel() for count in meets)
    return np.flatnonzero((mine > TINY) & (others <= TINY))


def _truncated(
    level: Level, before: csr_matrix | None, own: np.ndarray, start: int, total: int
) -> csr_matrix:
    """T_l (C_l, total) from that of the level before; the active functions' columns from start."""
    n = level.space.extraction.shape[1]
    unit = csr_matrix((np.ones(len(own)), (own, start + np.arange(len(own)))), (n, total))
    if before is None:
        return unit
    others = np.ones(n)
    others[own] = 0
    return (diags(others) @ level.two_scale @ before + unit).tocsr()
