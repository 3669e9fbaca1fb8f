"""Alignments of a part in several frames and along their axes, as candidates."""

from collections.abc import Iterable, Sequence
from functools import partial

import numpy as np
from scipy.ndimage import gaussian_filter1d

from polycube.surface.frames import frames, rotations, turn
from polycube.surface.voxels import voxels
from polycube.types import Candidate, Polycube, RoughMap, TriMesh

from .alignment import Alignment, SlabPattern, View, align
from .options import Costs, SliceOptions

NARROW = 0.35  # of the median: smallest width of a slice
BLUR = 1.5  # standard deviation of the smoothing along the row, in slices
TIE = 0.01  # weight of the lengths among equally good alignments
THIRDS = np.array([0, 1 / 3, 2 / 3, 1])


def views(options: SliceOptions, surface: TriMesh) -> list[View]:
    """The part in each of its frames, the best frame first."""
    best = frames(surface)[: options.frames]
    return [View(frame, np.eye(3), voxels(surface, frame, options.resolution)) for frame in best]


def alignments(
    costs: Costs, view: View, turns: Iterable[np.ndarray], patterns: Sequence[SlabPattern]
) -> list[Alignment]:
    """Alignments along the first axis of each rotation (3, 3) of a view, best first."""
    found = [each for t in turns for each in align(view.turned(t), patterns, costs)]
    return sorted(found, key=lambda alignment: alignment.cost)


def as_candidate(alignment: Alignment, proposal: str, frame: int) -> Candidate:
    """The candidate of an alignment in a frame; its context has the most similar lengths."""
    polycubes = alignment.pattern.polycubes
    difference, index = min((misfit(alignment, p), i) for i, p in enumerate(polycubes))
    polycube = polycubes[index]
    cost = alignment.cost + TIE * difference
    key = structure_key(polycube, alignment.view.turn, frame)
    return Candidate(proposal, polycube, place(alignment, polycube), cost, key)


def structure_key(polycube: Polycube, view: np.ndarray, frame: int) -> str:
    """Key of the boxes of a polycube in a frame; equal for equal solids.

    view : (3, 3) rotation from the frame to the axes of the polycube
    """
    boxes = turn(polycube.occupancy, view.T)
    bits = "".join("01"[int(full)] for full in boxes.ravel())
    return f"frame {frame}, {'x'.join(map(str, boxes.shape))} boxes {bits}"


def distinct_turns(polycube: Polycube, of_row: bool = False) -> list[np.ndarray]:
    """Rotations (3, 3) with different results for a polycube, or for a row with another axis."""
    found: dict[tuple[int, str], np.ndarray] = {}
    for rotation in rotations():
        axis = int(np.abs(rotation[0]).argmax()) if of_row else 0
        found.setdefault((axis, structure_key(polycube, rotation, 0)), rotation)
    return list(found.values())


def place(alignment: Alignment, polycube: Polycube) -> RoughMap:
    """Rough map of the (collapsed) polycube onto the slices of an alignment, in model units.

    Control planes are at the ends of every slice, each with 4 x 4 lines at thirds of the cell.
    """
    bounds = alignment.bounds
    planes = np.arange(bounds[0], bounds[-1] + 1)
    lines = _lines(alignment)  # (X, 2, 4)
    ends = np.concatenate([lines[:1], lines, lines[-1:]])
    lines = (ends[1:] + ends[:-1]) / 2  # (X + 1, 2, 4)
    points = np.empty((len(planes), 4, 4, 3))
    points[..., 0] = planes[:, None, None]
    points[..., 1] = lines[:, 0, :, None]
    points[..., 2] = lines[:, 1, None, :]
    x = np.interp(planes, bounds, polycube.x)
    return RoughMap(x, THIRDS, THIRDS, alignment.view.to_model(points))


def _lines(alignment: Alignment) -> np.ndarray:
    """(X, 2, 4) y lines and z lines of every slice, in voxels, smoothed along the row."""
    outer, inner = (_fill(values) for values in _measured_lines(alignment))
    centre, width = outer.mean(axis=-1), np.ptp(outer, axis=-1)
    width = np.maximum(width, NARROW * np.median(width, axis=0))
    low, high = np.clip(inner[..., 0], 0.08, 0.8), np.clip(inner[..., 1], 0.2, 0.92)
    middle, half = (low + high) / 2, np.maximum(high - low, 0.12) / 2
    inner = np.stack([(middle - half).clip(0.06, 0.82), (middle + half).clip(0.18, 0.94)], axis=-1)
    blurred = partial(gaussian_filter1d, sigma=BLUR, axis=0, mode="nearest")
    centre, width, inner = map(blurred, (centre, width, inner))
    fractions = np.insert(inner, [0, 2], [0, 1], axis=-1)
    return (centre - width / 2)[..., None] + width[..., None] * fractions


def _measured_lines(alignment: Alignment) -> tuple[np.ndarray, np.ndarray]:
    """Outer lines in voxels and inner lines as fractions (X, 2 axes, 2 ends); nan if missing."""
    bounds, slabs = alignment.bounds, np.array(list(alignment.pattern.slabs))
    here = slice(bounds[0], bounds[-1])
    slab = np.repeat(slabs, np.diff(bounds))
    areas, holes = alignment.slices.piece_area[here], alignment.slices.hole_area[here]
    solid = areas[:, 0] + alignment.slices.hole_total[here] * np.isin(slab, ["F", "R"])
    pieces = alignment.slices.piece_box[here]
    first, second = _shrunk(pieces[:, 0], solid), _shrunk(pieces[:, 1], areas[:, 1])
    hole = _shrunk(alignment.slices.hole_box[here], holes)
    outer, inner = np.full((2, len(slab), 2, 2), np.nan)
    ring = (slab == "R") & (holes > 0)
    is_single = ((slab == "F") & (areas[:, 0] > 0)) | ring
    outer[is_single] = first[is_single]
    inner[ring] = _fractions(hole, first)[ring]
    for name, gap in (("Y", 1), ("Z", 0)):
        bars = (slab == name) & (areas[:, 1] > 0)
        ahead = first[:, gap].sum(axis=1) < second[:, gap].sum(axis=1)
        swap = ahead[:, None, None]
        before, after = np.where(swap, first, second), np.where(swap, second, first)
        share = np.where(ahead, areas[:, 0], areas[:, 1]) / np.maximum(areas.sum(axis=1), 1)
        both = share[:, None, None] * before + (1 - share)[:, None, None] * after
        both[:, gap] = np.stack([before[:, gap, 0], after[:, gap, 1]], axis=1)
        between = np.stack([before[:, gap, 1], after[:, gap, 0]], axis=1)
        outer[bars] = both[bars]
        inner[bars, gap] = _fractions(between, both[:, gap])[bars]
    return np.where(np.isfinite(outer).any(axis=0), outer, first), inner


def _shrunk(boxes: np.ndarray, area: np.ndarray) -> np.ndarray:
    """(X, 2 axes, 2 ends) boxes with about the area of their content, at most 30 % narrower."""
    ends = boxes.reshape(-1, 2, 2).astype(float)
    centre, size = ends.mean(axis=2, keepdims=True), ends[..., 1] - ends[..., 0]
    fill = np.sqrt(area / np.maximum(size.prod(axis=1), 1)).clip(0.7, 1)
    return centre + (ends - centre) * fill[:, None, None]


def _fractions(inner: np.ndarray, outer: np.ndarray) -> np.ndarray:
    """Inner ends (..., 2) as fractions of the outer ones."""
    return (inner - outer[..., :1]) / np.maximum(np.ptp(outer, axis=-1)[..., None], 1e-9)


def _fill(values: np.ndarray) -> np.ndarray:
    """Interpolate the nan of (X, 2, 2) along the first axis; thirds if there are no values."""
    x, filled = np.arange(len(values)), values.copy()
    for i, j in np.ndindex(values.shape[1:]):
        column = filled[:, i, j]
        has_value = np.isfinite(column)
        given = (x[has_value], column[has_value]) if has_value.any() else ([0], [THIRDS[1 + j]])
        column[~has_value] = np.interp(x[~has_value], *given)
    return filled


def misfit(alignment: Alignment, polycube: Polycube) -> float:
    """Difference in length between the slabs of an alignment and those of a polycube.

    They are compared as shares of the row, and the aspect ratio of a cell with that of a cube.
    """
    bounds, span = alignment.bounds, np.ptp(polycube.x)
    shares = (bounds - bounds[0]) / (bounds[-1] - bounds[0])
    sections = alignment.slices.span[bounds[0] : bounds[-1]].prod(axis=1)
    aspect = (bounds[-1] - bounds[0]) / np.sqrt(np.median(sections))
    slabs = (polycube.x - polycube.x[0]) / span
    return float(((slabs - shares) ** 2).sum() + 0.02 * np.log(aspect / span) ** 2)
