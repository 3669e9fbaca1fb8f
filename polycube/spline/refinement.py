"""Refine a spline where it was asked for, never with a crack.

Two levels meet without a crack where the finer functions, at the Bezier nodes that both have, are
the coarser ones cut exactly.  Near extraordinary edges those of h2s are not, so all elements at
such a node are refined, or none of them.
"""

from __future__ import annotations

import logging

import numpy as np

from polycube.spline.hierarchy import (
    Level,
    Space,
    coarsest,
    finer_level,
    gaps,
    hierarchical_spline,
    interface,
)
from polycube.spline.selection import Refinement, check_listed
from polycube.types import Spline, TriMesh

logger = logging.getLogger(__name__)

NONE = np.zeros(0, np.int64)
NESTED = 1e-10  # functions whose coefficients differ by no more are the same


def refined_spline(
    space: Space, refine: Refinement, surface: TriMesh, extraordinary_edges: int = 0
) -> Spline:
    """The truncated hierarchical spline; logs what was refined at each level."""
    levels = [coarsest(space, refine.levels)]
    listed = refine.listed()
    check_listed(listed, len(levels[0].inside))
    wanted = listed[0] if listed else NONE
    while True:
        level, depth = levels[-1], len(levels) - 1
        chosen = wanted[wanted >= 0]
        marked = np.setdiff1d(refine.marked(level, depth, surface), chosen)
        chosen = watertight(level, np.concatenate([chosen, marked]), refine.irregular)
        if len(chosen) == 0:
            return hierarchical_spline(levels, extraordinary_edges)
        levels.append(finer_level(level, chosen))
        wanted = _children(listed[depth + 1], wanted, chosen) if depth + 1 < len(listed) else NONE


def _children(listed: np.ndarray, wanted: np.ndarray, refined: np.ndarray) -> np.ndarray:
    """(M,) elements of the finer level that 8 i + child stand for, -1 where i was not refined.

    wanted : the elements that i numbers, refined : all of them, in the order of their children
    """
    parent, child = np.divmod(listed, 8)
    place = np.full(max(refined.max(), wanted.max(initial=0)) + 1, -1)
    place[refined] = np.arange(len(refined))
    at = np.where(wanted[parent] >= 0, place[wanted[parent]], -1)
    return np.where(at >= 0, 8 * at + child, -1)


def watertight(level: Level, elements: np.ndarray, irregular: str = "enlarge") -> np.ndarray:
    """The elements, with others after them or without some, so that no crack opens round them.

    irregular : enlarge or reject; where Omega has not all that is needed, the latter is done
    """
    if len(elements) == 0:
        return elements
    if irregular == "enlarge":
        larger = _enlarged(level, elements)
        if level.inside[larger].all():
            _tell(level, elements, larger)
            return larger
    smaller = _reduced(level, elements)
    _tell(level, elements, smaller)
    return smaller


def _tell(level: Level, asked: np.ndarray, chosen: np.ndarray) -> None:
    what = ""
    if len(chosen) > len(asked):
        what = f", {len(chosen) - len(asked)} of them so that none of an irregular edge is left out"
    if len(chosen) < len(asked):
        what = f"; {len(asked) - len(chosen)} more lie at irregular edges and stay as they are"
    logger.info("level %d: %d elements are refined%s", level.halved, len(chosen), what)


def _enlarged(level: Level, elements: np.ndarray) -> np.ndarray:
    """With all elements at a node where the levels do not meet, and so on."""
    done, front = elements, elements
    while len(front):
        fine = finer_level(level, front)
        nodes = interface(fine)
        rifts = nodes[gaps(level, fine, nodes) > NESTED]
        front = np.setdiff1d(_at(fine, rifts), done)
        done = np.concatenate([done, front])
    return done


def _reduced(level: Level, elements: np.ndarray) -> np.ndarray:
    """Without the elements at a node where the levels do not meet that others have, and so on."""
    fine = finer_level(level, elements)
    nodes = np.unique(fine.space.nodes[fine.inside])
    rifts = nodes[gaps(level, fine, nodes) > NESTED]
    child, place = np.nonzero(np.isin(fine.space.nodes, rifts))
    parent, node = child // 8, fine.space.nodes[child, place]
    is_kept = np.arange(len(fine.parents)) < len(elements)
    while True:
        open_nodes = np.intersect1d(node[is_kept[parent]], node[~is_kept[parent]])
        if len(open_nodes) == 0:
            return elements[is_kept[: len(elements)]]
        is_kept[parent[np.isin(node, open_nodes)]] = False


def _at(fine: Level, nodes: np.ndarray) -> np.ndarray:
    """Elements of the level before whose children have one of the nodes, ascending."""
    return np.unique(fine.parents[np.isin(fine.space.nodes, nodes).any(axis=1).nonzero()[0] // 8])
