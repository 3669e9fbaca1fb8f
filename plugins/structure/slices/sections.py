"""Measures of each slice of a voxel solid: its components, its holes, its concavity.

Slices are perpendicular to the first axis; within a slice, rows are parallel to y and z. Areas are
in voxels, boxes are (y low, y high, z low, z high) in voxels, with exclusive upper ends.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

PLANE = np.zeros((3, 3, 3), bool)  # neighbours in a slice
PLANE[1] = True
CROSS = ndimage.generate_binary_structure(3, 1) & PLANE  # pixels with a common edge


@dataclass(frozen=True, eq=False)
class Slices:
    """Measures of X slices; a missing component or hole has area 0 and box 0."""

    area: np.ndarray  # (X,) solid
    piece_area: np.ndarray  # (X, 2) of the two largest solid components
    piece_box: np.ndarray  # (X, 2, 4)
    hole_total: np.ndarray  # (X,) of all holes: background enclosed by the slice
    hole_area: np.ndarray  # (X,) of the largest hole
    hole_box: np.ndarray  # (X, 4)
    between: np.ndarray  # (X, 3) background with solid on both sides: in y, in z, in either
    gain: np.ndarray  # (X, 2) best gain by removing a central band of y rows, of z rows
    span: np.ndarray  # (X, 2) extent of the solid in y, in z


def measure(solid: np.ndarray) -> Slices:
    """Measure every slice of voxels (X, Y, Z) with an empty outer layer."""
    piece_area, piece_box, _ = _largest(ndimage.label(solid, CROSS)[0], 2)
    background = ndimage.label(~solid, PLANE)[0]
    background[background == background[:, :1, :1]] = 0
    hole_area, hole_box, hole_total = _largest(background, 1)
    in_y, in_z = _between(solid, 1), _between(solid, 2)
    rows = solid.sum(axis=2), solid.sum(axis=1)  # (X, Y), (X, Z)
    gaps = in_y.sum(axis=2), in_z.sum(axis=1)
    return Slices(
        solid.sum(axis=(1, 2)),
        piece_area,
        piece_box,
        hole_total,
        hole_area[:, 0],
        hole_box[:, 0],
        np.stack([b.sum(axis=(1, 2)) for b in (in_y, in_z, in_y | in_z)], axis=1),
        np.stack([_band_gain(*pair) for pair in zip(rows, gaps, strict=True)], axis=1),
        np.stack([_extent(r > 0) for r in rows], axis=1),
    )


def _largest(labels: np.ndarray, keep: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Areas (X, keep) and boxes (X, keep, 4) of the largest regions of a slice; total area (X,)."""
    areas = np.bincount(labels.ravel())[1:]
    found = [box for box in ndimage.find_objects(labels) if box is not None]
    boxes = np.array([[x.start, y.start, y.stop, z.start, z.stop] for x, y, z in found], int)
    boxes, areas = boxes.reshape(-1, 5), areas[areas > 0]
    order = np.lexsort((-areas, boxes[:, 0]))
    boxes, areas = boxes[order], areas[order]
    at = boxes[:, 0]
    rank = np.arange(len(at)) - np.searchsorted(at, at)
    first = rank < keep
    area, box = np.zeros((len(labels), keep), int), np.zeros((len(labels), keep, 4), int)
    area[at[first], rank[first]] = areas[first]
    box[at[first], rank[first]] = boxes[first, 1:]
    return area, box, np.bincount(at, weights=areas, minlength=len(labels))


def _between(solid: np.ndarray, axis: int) -> np.ndarray:
    """Background voxels with solid before and after them along an axis."""
    before = np.logical_or.accumulate(solid, axis)
    return before & np.flip(np.logical_or.accumulate(np.flip(solid, axis), axis), axis) & ~solid


def _extent(used: np.ndarray) -> np.ndarray:
    """(X,) number of rows from the first used to the last used of (X, N)."""
    last = used.shape[1] - used[:, ::-1].argmax(axis=1)
    return np.where(used.any(axis=1), last - used.argmax(axis=1), 0)


def _band_gain(rows: np.ndarray, gaps: np.ndarray) -> np.ndarray:
    """(X,) largest sum of gaps / 2 - rows over a band of rows inside the solid.

    rows, gaps : (X, N) solid and enclosed background per row. The band does not include the
        outermost rows and is at least 12 % of the extent wide; -inf if there is no room for one.
    """
    gain = np.full(len(rows), -np.inf)
    for x, (row, gap) in enumerate(zip(rows, gaps, strict=True)):
        used = np.flatnonzero(row)
        low, high = (used[0] + 1, used[-1]) if len(used) else (0, 0)
        wide = max(2, int(0.12 * (high - low + 2)))
        if high - low < wide:
            continue
        total = np.append(0, np.cumsum(gap[low:high] / 2 - row[low:high]))
        gain[x] = (total[wide:] - np.minimum.accumulate(total[:-wide])).max()
    return gain
