"""Divide a planar face of lattice rectangles, such as an L or a ring, into rectangles."""

import numpy as np


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
        ends = np.flatnonzero(both[:-1] & ~both[1:])
        for first, last in zip(starts, ends, strict=True):
            if (before | after)[[first, last + 1]].any():
                found.append((row, int(first), int(last)))
    return found
