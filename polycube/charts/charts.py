"""Flatten every patch of a segmented surface onto its planar face of the polycube.

The arcs are mapped to the straight edges of the polycube, and the patches by harmonic maps to the
faces between them. A face need not be convex (an L, a ring), and a harmonic map may then fold. A
patch that folds is divided along lattice lines into rectangles, onto which the map with mean-value
weights cannot fold.
"""

import logging

import numpy as np
from scipy.optimize import isotonic_regression

from polycube.charts.harmonic import cotangent, extend, flipped, mean_value
from polycube.charts.mapped_surface import Sheet, Sides
from polycube.charts.segmentation import Segmentation
from polycube.charts.tracing import Cost, Drawing, near
from polycube.errors import MeshingError

logger = logging.getLogger(__name__)

EVEN = 0.3  # weight of the arc length in the positions along an arc; the rest follows the guidance
SMOOTH = 8  # smoothing passes of the guidance, for as many samples squared
WIDTH = 0.1  # width of the guidance of cuts, in cells


def flatten(segmentation: Segmentation) -> Sheet:
    """The sheet, refined locally, with the position of every vertex on the boundary of the
    polycube.

    Its tags are the patches. Raises MeshingError if a patch folds even in rectangles.
    """
    drawing, outside = segmentation.drawing, segmentation.outside
    at: dict[int, int] = {}  # sheet vertex of each lattice vertex on an arc
    for number, arc in enumerate(segmentation.net.arcs):
        stops = settle(drawing, number, outside.vertices[list(arc.vertices)])
        at |= dict(zip(arc.vertices, stops.tolist(), strict=True))
    for patch, axis in enumerate(outside.patch_axis.tolist()):
        folds = _map_patch(drawing, patch, axis)
        if folds == 0:
            continue
        name = segmentation.describe(patch)
        left = _map_rectangles(segmentation, patch, axis, at)
        if left:
            what = f"{left} triangles of {name} are flipped in the plane, even in rectangles"
            raise MeshingError(what)
        message = "map: %s: %d triangles flipped, none after a division into rectangles"
        logger.info(message, name, folds)
    return drawing.sheet


def settle(drawing: Drawing, number: int, knots: np.ndarray) -> np.ndarray:
    """Put a path on the straight line through knots (K, 3); returns the vertices at the knots.

    The positions along the line are a mean of the guidance, made ascending and smoothed, and of the
    arc length of the path.
    """
    path, sheet = drawing.paths[number], drawing.sheet
    step = np.linalg.norm(np.diff(sheet.vertices[path], axis=0), axis=1)
    length = np.append(0, np.cumsum(step)) / step.sum()
    along = knots[-1] - knots[0]
    share = (knots - knots[0]) @ along / (along @ along)
    guided = (sheet.places[path] - knots[0]) @ along / (along @ along)
    at = EVEN * length + (1 - EVEN) * _evened(length, isotonic_regression(np.clip(guided, 0, 1)).x)
    stops = np.abs(at - share[:, None]).argmin(axis=1)
    last = len(knots) - 1
    for k in range(1, last + 1):  # a separate vertex for each knot
        stops[k] = max(stops[k], stops[k - 1] + 1)
    for k in range(last, -1, -1):
        stops[k] = min(stops[k], len(path) - 1 - (last - k))
    drawing.move(path, knots[0] + np.interp(at, at[stops], share)[:, None] * along)
    return path[stops]


def _evened(length: np.ndarray, ascending: np.ndarray) -> np.ndarray:
    """Ascending numbers (N,) at the given lengths, smoothed and scaled to the range 0 to 1."""
    even = np.linspace(0, 1, SMOOTH**2)
    values = np.interp(even, length, ascending)
    values[[0, -1]] = 0, 1
    for _ in range(SMOOTH):
        values[1:-1] = (values[:-2] + 2 * values[1:-1] + values[2:]) / 4
    return np.interp(length, even, values)


def plane_of(axis: int) -> list[int]:
    """The two coordinates in a face with the given axis label, right-handed seen from outside."""
    plane = [(axis // 2 + 1) % 3, (axis // 2 + 2) % 3]
    return plane[::-1] if axis % 2 else plane


def _map_patch(drawing: Drawing, patch: int, axis: int) -> int:
    """Map the regions of a patch with fixed borders; returns the number of flipped triangles."""
    is_own = drawing.sheet.tag == patch
    region, faces = drawing.regions(is_own), drawing.sheet.faces[is_own]
    return sum(_map_region(drawing, faces[region == r], axis) for r in range(region.max() + 1))


def _map_region(drawing: Drawing, faces: np.ndarray, axis: int) -> int:
    """Map a region (F, 3) harmonically; returns the number of flipped triangles."""
    sheet, plane = drawing.sheet, plane_of(axis)
    used, local = np.unique(faces, return_inverse=True)
    local = local.reshape(-1, 3)
    fixed = drawing.taken()[used]
    places = sheet.places[used]
    places[:, axis // 2] = places[fixed.argmax(), axis // 2]
    folds = len(faces) + 1
    for weights in (cotangent, mean_value):
        found = extend(weights(sheet.vertices[faces], local, len(used)), places[:, plane], fixed)
        number = int(flipped(found, local).sum())
        if number < folds:
            folds, best = number, found
        if folds == 0:
            break
    places[:, plane] = best
    drawing.move(used, places)
    return folds


def _map_rectangles(segmentation: Segmentation, patch: int, axis: int, at: dict[int, int]) -> int:
    """Divide a patch into rectangles and map each; returns the number of flipped triangles."""
    drawing, outside = segmentation.drawing, segmentation.outside
    number = {tuple(place): i for i, place in enumerate(outside.vertices.tolist())}
    for knots in seams(outside.vertices[outside.quads[outside.patch == patch]], plane_of(axis)):
        start, stop = (at[number[tuple(knots[end].tolist())]] for end in (0, -1))
        guide = near(knots, WIDTH)

        def cost(sheet: Sheet, sides: Sides, guide: Cost = guide) -> np.ndarray:
            return np.where(sides.inside(sheet.tag == patch), guide(sheet, sides), np.inf)

        name = len(drawing.paths)
        if not drawing.draw(name, (start, stop), cost, least=2 * len(knots)):
            return int((drawing.sheet.tag == patch).sum())
        settle(drawing, name, knots)
    return _map_patch(drawing, patch, axis)


def seams(quads: np.ndarray, plane: list[int]) -> list[np.ndarray]:
    """Straight cuts, each (K, 3) lattice points between two borders; the shorter of two choices.

    quads : (Q, 4, 3) rectangles of one plane; plane : the two coordinates in it
    """
    lines = [np.unique(quads[..., d]) for d in plane]
    middle = quads.mean(axis=1)[:, plane]
    filled = np.zeros([len(line) + 1 for line in lines], bool)  # with an empty border
    filled[tuple(np.searchsorted(line, m) for line, m in zip(lines, middle.T, strict=True))] = True
    choices: list[list[np.ndarray]] = []
    for cells, order in ((filled, (0, 1)), (filled.T, (1, 0))):
        along, across = (lines[d] for d in order)
        choices.append([])
        for row, first, last in _runs(cells):
            points = np.tile(quads[0, 0], (last - first + 1, 1))
            points[:, plane[order[0]]] = along[first : last + 1]
            points[:, plane[order[1]]] = across[row]
            choices[-1].append(points)
    return min(choices, key=lambda cuts: sum(np.ptp(cut, axis=0).sum() for cut in cuts))


def _runs(filled: np.ndarray) -> list[tuple[int, int, int]]:
    """Line across, first and last line along, of each seam between different runs of cells.

    filled : (I + 2, J + 2) cells with an empty border; cell i is in front of line i
    """
    found = []
    for row in range(1, filled.shape[1] - 2):
        before, after = filled[:, row], filled[:, row + 1]
        both = before & after
        starts = np.flatnonzero(both[1:] & ~both[:-1])
        for first, last in zip(starts, np.flatnonzero(both[:-1] & ~both[1:]), strict=True):
            if (before | after)[[first, last + 1]].any():
                found.append((row, int(first), int(last)))
    return found
