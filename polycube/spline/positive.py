"""Keep det J of a spline positive during the fit: damp a move, or raise the lowest elements.

Scaled det J is det J divided by the volume of its element.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.sparse import csr_matrix

from polycube.numerics.lbfgs import descend
from polycube.numerics.threads import parts, side_by_side
from polycube.spline.bezier import scaled_detj
from polycube.spline.det_kernels import detj, squared_shortfall
from polycube.spline.matching import Matches
from polycube.types import Spline

LINE = np.arange(5) / 4  # samples of an element while it is raised, in each direction
DAMPINGS = 8  # largest number of dampings; the last one restores the old positions
DAMPED = 0.6  # factor of a damping
INFLUENCE = 0.02  # smallest coefficient, on an element to raise, of a control point that moves
ABOVE = 1.1  # factor on the floor for samples, because det J is lower between them
ITERATIONS = 60
DESCENTS = 2  # largest number; the second one watches elements that fell in the first one
WATCHED = 3.0  # factor on the wanted value; higher elements are only checked after a descent
TANGENTIAL = 0.05  # weight of a gap along the surface, relative to one across it
ELEMENTS = 64  # smallest number of elements for a thread
GAPS = 2000  # smallest number of gaps for a thread
STIFF = 0.02  # stiffness of the membrane of the step, relative to the mean diagonals

Term = Callable[[np.ndarray], tuple[float, np.ndarray]]  # control points -> value and gradient


def shares(spline: Spline) -> csr_matrix:
    """(E, C) largest Bezier coefficient of each control point on each element."""
    found = spline.element_functions()
    rows = found.coefficients
    most = np.maximum.reduceat(np.abs(rows.data), rows.indptr[:-1])
    shape = (len(spline.nodes), len(spline.control))
    return csr_matrix((most, found.functions, found.offsets), shape)


def damped(spline: Spline, moved: np.ndarray, floor: np.ndarray, share: csr_matrix) -> np.ndarray:
    """Control points between those of the spline and `moved` (C, 3).

    They are closer to the spline at elements whose scaled det J would fall below their floor (E,).
    """
    step = moved - spline.control
    factor, scaled = np.ones(len(step)), np.empty(len(floor))
    near: np.ndarray | slice = slice(None)  # elements that changed
    for number in range(DAMPINGS):
        now = replace(spline, control=spline.control + factor[:, None] * step)
        scaled[near] = scaled_detj(now, near)
        low = np.flatnonzero(scaled < floor)
        if len(low) == 0:
            break
        influence = np.minimum(3 * share[low].max(axis=0).toarray().ravel(), 1)
        factor *= (DAMPED if number < DAMPINGS - 1 else 0.0) ** influence
        near = np.flatnonzero(share @ influence)
    return spline.control + factor[:, None] * step


def restored(spline: Spline, moved: np.ndarray, floor: np.ndarray, share: csr_matrix) -> np.ndarray:
    """`moved` (C, 3), with the control points of the spline at elements below their floor (E,).

    The floor is at most the scaled det J of the spline, so no element is below it then.
    """
    control, scaled = moved.copy(), np.empty(len(floor))
    near: np.ndarray | slice = slice(None)  # elements that changed
    while True:
        scaled[near] = scaled_detj(replace(spline, control=control), near)
        affected = share[np.flatnonzero(scaled < floor)].getnnz(axis=0) > 0
        if np.array_equal(control[affected], spline.control[affected]):
            return control
        control[affected] = spline.control[affected]
        near = np.flatnonzero(share @ affected)


def raised(
    spline: Spline,
    scaled: np.ndarray,
    wanted: float,
    floor: float,
    share: csr_matrix,
    matches: Matches,
    graph: csr_matrix,
) -> np.ndarray:
    """Control points (C, 3) with the elements below `wanted`, at most the floor, raised to it.

    scaled : (E,) scaled det J of the spline

    The objective consists of the squared shortfall of scaled det J at 5^3 points of each element
    divided by the square of the floor, the gaps between the boundary and its matches divided by the
    mean area of a face, and a membrane.
    """
    moves = np.flatnonzero((share[scaled < wanted] > INFLUENCE).sum(axis=0))
    near = np.flatnonzero((share[:, moves] > INFLUENCE).sum(axis=1))
    chosen = np.flatnonzero(matches.rows[:, moves].getnnz(axis=1))
    gaps = [_gaps(spline.control, moves, matches, chosen[p]) for p in parts(len(chosen), GAPS)]
    membrane = graph[moves][:, moves]
    stiff = STIFF * matches.weight.mean() / membrane.diagonal().mean()
    start, control = spline.control[moves], spline.control.copy()

    def function(y: np.ndarray, terms: list[Term]) -> tuple[float, np.ndarray]:
        values, slopes = zip(*side_by_side([partial(term, y) for term in terms]), strict=True)
        pull = stiff * (membrane @ (y - start))
        return sum(values) + float(np.vdot(pull, y - start)), sum(slopes) + 2 * pull

    watched = near[scaled[near] < WATCHED * wanted]
    for _ in range(DESCENTS):
        slices = parts(len(watched), ELEMENTS)
        short = [_shortfall(spline, moves, watched[part], wanted, floor) for part in slices]
        control[moves] = descend(partial(function, terms=short + gaps), control[moves], ITERATIONS)
        low = scaled_detj(replace(spline, control=control), near) < wanted
        missed = np.setdiff1d(near[low], watched)
        if not len(missed):
            break
        watched = np.union1d(watched, missed)
    return control


def _shortfall(
    spline: Spline, moves: np.ndarray, elements: np.ndarray, wanted: float, floor: float
) -> Term:
    """Squared shortfall of det J in elements (e,), as a function of control points (n,)."""
    values = detj(spline.extraction @ spline.control, spline.nodes[elements], LINE)
    volume = np.abs(values.mean(axis=1))  # sufficient as a scale
    nodes, local = np.unique(spline.nodes[elements], return_inverse=True)
    all_rows = spline.extraction[nodes]
    rows = all_rows[:, moves]
    rest = all_rows @ spline.control - rows @ spline.control[moves]
    how = local.reshape(-1, 64), LINE, floor * volume, ABOVE * wanted / floor

    def function(y: np.ndarray) -> tuple[float, np.ndarray]:
        value, by_point = squared_shortfall(rows @ y + rest, *how)
        return value, rows.T @ by_point

    return function


def _gaps(control: np.ndarray, moves: np.ndarray, matches: Matches, chosen: np.ndarray) -> Term:
    """Weighted squared gaps of some matches (m,), as a function of control points (n,)."""
    all_rows = matches.rows[chosen]
    rows = all_rows[:, moves]
    rest = all_rows @ control - rows @ control[moves] - matches.goal[chosen]
    normal, weight = matches.normal[chosen], matches.weight[chosen, None]

    def function(y: np.ndarray) -> tuple[float, np.ndarray]:
        gap = rows @ y + rest
        pull = weight * ((gap * normal).sum(axis=1, keepdims=True) * normal + TANGENTIAL * gap)
        return float(np.vdot(pull, gap)), 2 * (rows.T @ pull)

    return function
