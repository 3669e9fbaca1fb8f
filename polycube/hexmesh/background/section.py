"""Quads of a section, with edges along all its curves, without details that make them poor."""

import logging
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from polycube.hexmesh.background.arrangement import arrangement, cross, simplified
from polycube.hexmesh.background.background import Background, NoBackgroundError, distinct
from polycube.hexmesh.background.borders import Cell, borders, four_sides
from polycube.hexmesh.background.cells import cells
from polycube.hexmesh.background.curves import Curve, Sizes, curves, curves_round
from polycube.hexmesh.background.cuts import cuts
from polycube.hexmesh.background.smoothing import sines, smoothed
from polycube.hexmesh.generation.quads import Plane, quads
from polycube.surface.measures import diagonal
from polycube.types import TriMesh

logger = logging.getLogger(__name__)

SCALES = (1.0, 0.8)  # factors on the wanted size that are tried
STEP = 0.05  # of the smallest sine of an angle: smaller differences are decided by size and mean
SUFFICIENT = 0.7  # smallest sine above which only size and mean count
OVERLAP = 0.1  # largest relative error of the area of a cell
CHORDS = 0.02  # of the area of all cells: the same, for the chords of its curves
SAME = 1e-6  # of the extent: closer vertices are merged
NOTHING = np.zeros((0, 2)), np.zeros((0, 4), np.int64), np.zeros(0, np.int64)
# of the diagonal: sizes below which details are merged, one after the other
DETAILS = 1e-5, 5e-4, 1e-3, 2e-3
ENOUGH = 0.2  # smallest sine of an angle of the quads above which no more details are merged
TINY = 0.02  # of the wanted size: side of a quad that is as poor as such a sine of 1
BETTER = 0.08  # by how much it must be larger for each of these sizes, at most twice
SECTOR = 2.2  # largest ratio of opposite sides of a grid between cuts, such as of a ring
PRICE = 0.2  # of e times as many quads, as a gain of such a sine
ENDS = 1e-4  # of the diagonal: smallest tolerance for the ends of curves


@dataclass(frozen=True, eq=False)
class Section:
    """Quads in the plane."""

    vertices: np.ndarray  # (V, 2)
    quads: np.ndarray  # (Q, 4) counter-clockwise
    cell: np.ndarray  # (Q,) the cell of each quad


def section(
    chains: list[Curve], loops: list[list[list[int]]], full: np.ndarray, sizes: Sizes
) -> Section:
    """Quads of all cells of a planar graph, the best of several results.

    These are made with different sizes, with and without rings along smooth borders.

    Raises NoBackgroundError if Gmsh returns no quads, or if all results have folds.

    chains : its curves
    loops : for each cell its loops, the outer one first: curves by number from 1, negative for the
        opposite direction
    full : (C, K) whether each cell is full in each slab
    """
    variants = list(product(SCALES, (True, False)))
    drafts = []
    for scale, has_rings in variants:
        scaled = replace(sizes, size=scale * sizes.size)
        drafts.append(_draft(*borders(chains, loops, full, scaled, has_rings), scaled.size))
    planes = [draft.plane for draft in drafts]
    filled = quads(planes) if planes[0].regions else [NOTHING] * len(drafts)
    half = [cross(chain.points[:-1], chain.points[1:]).sum() / 2 for chain in chains]
    areas = [sum(np.sign(n) * half[abs(n) - 1] for loop in cell for n in loop) for cell in loops]
    wanted = np.array(areas)  # of the cells
    best, key = None, (0.0, 0.0, 0.0)
    for (scale, _), draft, made in zip(variants, drafts, filled, strict=True):
        if not (made and (flat := _smooth(draft, *made))):
            continue
        sine = sines(flat.vertices, flat.quads)
        least, mean = float(sine.min()), float(sine.mean())
        logger.info("sweep: %d quads, smallest sine %.3f, mean %.3f", len(sine), least, mean)
        rank = STEP * (min(least, SUFFICIENT) // STEP), scale, mean
        if least > 0 and rank > key and _fills(flat, wanted):
            best, key = flat, rank
    if best is None:
        raise NoBackgroundError("all quad meshes of its section have folds")
    return best


def _fills(flat: Section, wanted: np.ndarray) -> bool:
    """Whether the quads have the areas (C,) of the cells: rings may overlap in a narrow cell."""
    a, b, c, d = np.moveaxis(flat.vertices[flat.quads], 1, 0)
    area = np.bincount(flat.cell, cross(c - a, d - b) / 2, len(wanted))
    return bool((abs(area - wanted) < OVERLAP * wanted + CHORDS * wanted.sum()).all())


@dataclass(frozen=True, eq=False)
class Draft:
    """Borders of cells, and the regions to fill."""

    points: np.ndarray  # (P, 2) on the borders and in rings
    quads: np.ndarray  # (Q, 4) in rings, of the cells `own` (Q,)
    own: np.ndarray
    is_fixed: np.ndarray  # (P,) whether a point is fixed
    plane: Plane  # the remaining regions of the cells `open_`
    open_: np.ndarray
    known: np.ndarray  # (K,) points whose positions (K, 2) are searched in the quads
    places: np.ndarray


def _draft(points: np.ndarray, cells: list[Cell], size: float) -> Draft:
    """The given quads of cells, and the regions to fill."""
    open_ = [cell for cell in cells if cell.loops]
    every = [loop for cell in open_ for loop in cell.loops]
    coarse = np.unique(np.concatenate([np.zeros(0, np.int64), *(loop[::2] for loop in every)]))
    middles = [(points[loop[::2]] + points[np.roll(loop[::2], -1)]) / 2 for loop in every]
    is_fixed = np.ones(len(points), bool)
    is_fixed[np.concatenate([cell.inner for cell in cells])] = False
    return Draft(
        points,
        np.concatenate([cell.quads for cell in cells]),
        np.repeat(np.arange(len(cells)), [len(cell.quads) for cell in cells]),
        is_fixed,
        Plane(
            points[coarse],
            [[np.searchsorted(coarse, loop[::2]).tolist() for loop in c.loops] for c in open_],
            [np.searchsorted(coarse, c.corners).tolist() for c in open_],
            2 * size,
        ),
        np.flatnonzero([bool(cell.loops) for cell in cells]),
        np.concatenate([coarse, *(loop[1::2] for loop in every)]),
        np.concatenate([points[coarse], *middles]),
    )


def _smooth(
    draft: Draft, vertices: np.ndarray, faces: np.ndarray, region: np.ndarray
) -> Section | None:
    """Quads of rings and regions after smoothing; None if a border point is missing."""
    near = SAME * np.ptp(draft.points, axis=0).max()
    name = np.full(len(vertices), -1)
    if len(vertices):
        off, at = cKDTree(draft.places).query(vertices)
        name[off < near] = draft.known[at[off < near]]
    if len(np.setdiff1d(draft.known, name)):
        return None
    is_new = name < 0
    name[is_new] = len(draft.points) + np.arange(is_new.sum())
    used, every = np.unique(np.concatenate([draft.quads, name[faces]]), return_inverse=True)
    every = every.reshape(-1, 4)
    places = np.concatenate([draft.points, vertices[is_new]])[used]
    is_free = ~np.append(draft.is_fixed, np.zeros(is_new.sum(), bool))[used]
    cell = np.concatenate([draft.own, draft.open_[region]])
    return Section(smoothed(places, every, is_free), every, cell)


def section_of(
    surface: TriMesh, part: Background, sizes: Sizes
) -> tuple[Section, Background, np.ndarray]:
    """The quads of the section of a part, its levels, and the full cells in each slab (C, K).

    If quads with details such as the run-out of a fillet at a tangent are poor, or if there are
    none, the details are merged, at last after curves were simplified. Cells are cut at re-entrant
    corners if this makes the quads better.

    Raises NoBackgroundError if there are none without details, either; with the reason for all of
    them.
    """
    found: list[tuple[float, float, Background, Filled]] = []
    reasons, size = list[Exception](), diagonal(surface)
    trials = [*((share, False) for share in DETAILS), *((share, True) for share in DETAILS[1:])]
    for share, is_simple in trials:
        near = share * size
        levels = distinct(part.levels, near)
        levels[[0, -1]] = part.levels[[0, -1]]
        cut = replace(part, levels=levels)
        if is_simple:
            points, lines = simplified(cut.points, cut.lines, near, DETAILS[-1] * size)
            cut = replace(cut, points=points, lines=lines)
        try:
            made = _filled(surface, cut, near, sizes)
        except NoBackgroundError as reason:
            reasons.append(reason)
            continue
        flat = made.section
        side = np.linalg.norm(np.diff(flat.vertices[flat.quads], axis=1), axis=2).min()
        least = float(min(sines(flat.vertices, flat.quads).min(), side / (TINY * sizes.size)))
        more = _price(flat, found[0][3].section) if found else 0.0
        found.append((least - BETTER * min(len(found), 2) - more, near, cut, made))
        if least > ENOUGH:
            break
    if not found:
        raise reasons[0]
    _, near, cut, best = max(found, key=lambda each: each[0])
    if best.may_improve:
        with suppress(NoBackgroundError):
            other = _filled(surface, cut.with_lines(best.cuts), near, replace(sizes, uneven=SECTOR))
            if _is_better(other.section, best.section):
                best = other
    return best.section, cut, best.full


class Filled(NamedTuple):
    """Quads of all cells of a section."""

    section: Section
    full: np.ndarray  # (C, K) whether each cell is full in each slab
    cuts: np.ndarray  # (N, 2, 2) lines across cells
    may_improve: bool  # whether there are cuts, or sectors of rings that are no grids


def _filled(surface: TriMesh, part: Background, near: float, sizes: Sizes) -> Filled:
    """The quads of a section whose points are merged below a distance."""
    points, edges = arrangement(part.points, part.lines, near)
    loops, full = cells(surface, part, points, edges)
    chains = curves(points, edges, part.marks, max(near, ENDS * diagonal(surface)))
    around = curves_round(chains, loops)
    across = cuts(chains, around, sizes.size)
    grids = [[four_sides(chains, c, k) for c in around] for k in (sizes.uneven, SECTOR)]
    flat = section(chains, around, full, sizes)
    return Filled(flat, full, across, len(across) > 0 or grids[0] != grids[1])


def _is_better(new: Section, old: Section) -> bool:
    """Whether the smallest and the mean sine of the angles grow by more than the price of quads."""
    sine, before = (sines(each.vertices, each.quads) for each in (new, old))
    gain = min(sine.min(), SUFFICIENT) - min(before.min(), SUFFICIENT) + sine.mean() - before.mean()
    return bool(gain > _price(new, old))


def _price(new: Section, old: Section) -> float:
    """The price of the quads of a section beside those of another, as a gain of a sine."""
    return PRICE * max(float(np.log(len(new.quads) / len(old.quads))), 0.0)
