"""Move the control points of a spline so that its boundary follows the surface.

1. Least squares for the control points that contribute to the boundary: points of the spline and of
   the surface, matched again in each iteration, with a membrane term for the step.
2. The other control points follow harmonically, on a graph with the inverse squared length as the
   weight of an edge.
3. If det J of an element has decreased, the move is damped; then elements below the floor are
   raised.
"""

from dataclasses import replace
from operator import itemgetter

import numpy as np
from scipy.sparse import csr_matrix, diags, identity
from scipy.sparse.linalg import cg, splu

from polycube.spline.bezier import min_detj, scaled_detj
from polycube.spline.fit import Fit
from polycube.spline.matching import Matcher
from polycube.spline.positive import damped, raised, restored, shares
from polycube.spline.spaces.sharpness import HALVED_DETJ, KEPT, POOR
from polycube.surface.fit_target import target
from polycube.types import Spline, TriMesh

MEMBRANE = 0.02  # weight of the membrane relative to the squared gaps, by their mean diagonals
REGULARIZATION = 1e-6  # relative contribution below which control points stay fixed
EXACT = 1e-9  # move, in diagonals, below which the spline is on the surface
LOOSE = 0.5  # share of its scaled det J that an element keeps before it is raised
SYMMETRIC = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0}  # and positive definite
FIRST = 0.2  # share of the floor used first if the whole floor cannot be reached at once


def fit_to_surface(
    options: Fit, spline: Spline, surface: TriMesh, cad_face: np.ndarray | None = None
) -> Spline:
    """The spline with moved control points; the least scaled det J does not fall below the floor.

    cad_face : (S,) number of the CAD face of each side; 0 for any

    A spline that is certified positive is returned unchanged if the result would not be positive.
    """
    if options.iterations == 0:
        return spline
    goal = target(surface)
    unit = replace(spline, control=goal.to_unit(spline.control))
    on = np.zeros(len(spline.sides), np.int64) if cad_face is None else cad_face
    matcher, graph = Matcher(unit, goal, on), laplacian(unit)
    touched, places = _on_boundary(matcher, graph, options.iterations)
    if np.abs(places - unit.control[touched]).max() < EXACT:
        return spline
    moved = _follow(graph, touched, places, unit.control)
    result = replace(spline, control=goal.to_model(_positive(options, unit, moved, matcher, graph)))
    return spline if min_detj(result).lower_bound <= 0 < min_detj(spline).lower_bound else result


def _positive(
    options: Fit, spline: Spline, moved: np.ndarray, matcher: Matcher, graph: csr_matrix
) -> np.ndarray:
    """The moved control points (C, 3), moved back or further as det J requires."""
    share, old = shares(spline), scaled_detj(spline)
    reachable = np.clip(old.min(), 0, options.floor)

    def at(control: np.ndarray) -> tuple[Spline, np.ndarray]:
        now = replace(spline, control=control)
        return now, scaled_detj(now)

    def value(state: tuple[Spline, np.ndarray]) -> tuple[float, float]:
        least = state[1].min()
        if least <= 0:
            return 0.0, float(least)
        rows, goal, _, weight = matcher(state[0].control)
        gaps = np.linalg.norm(rows @ state[0].control - goal, axis=1)[weight > 0]
        cost = np.percentile(gaps, 99) + HALVED_DETJ * max(np.log2(options.floor / least), 0)
        return 1 + min(least, reachable), -cost - POOR * (least < KEPT * options.floor)

    best = at(damped(spline, moved, LOOSE * np.minimum(old, options.floor), share))
    best_value, part = value(best), 1.0
    for _ in range(options.rounds):
        low = best[1].min()
        wanted = options.floor * (part if low > 0 else FIRST)
        if low >= wanted:
            break
        higher = raised(*best, wanted, options.floor, share, matcher(best[0].control), graph)
        kept = np.minimum(best[1], KEPT * options.floor)
        tries = at(higher), at(damped(best[0], higher, kept, share))
        reached, tried = max(((value(each), each) for each in tries), key=itemgetter(0))
        if reached > best_value:
            best, best_value = tried, reached
        elif low <= 0 or part == FIRST:
            break
        else:
            part = FIRST
    control = best[0].control
    loose = np.minimum(old, max(reachable, LOOSE * options.floor))
    partly_restored = damped(spline, control, loose, share)
    fully_restored = restored(spline, control, np.minimum(old, reachable), share)
    others = {value(at(other)): other for other in (fully_restored, partly_restored)}
    controls = {best_value: control} | others
    return controls[max(controls)]


def laplacian(spline: Spline) -> csr_matrix:
    """(C, C) Laplacian of the graph of control points.

    The weights are the products of coefficients at neighbouring Bezier nodes, divided by the
    squared distance.
    """
    coefficients = abs(spline.extraction)
    pairs = (coefficients.T @ (_neighbours(spline) @ coefficients)).tocoo()
    apart = ((spline.control[pairs.row] - spline.control[pairs.col]) ** 2).sum(axis=1)
    off = pairs.row != pairs.col
    apart = np.maximum(apart[off], 1e-3 * np.median(apart[off]))
    graph = csr_matrix((pairs.data[off] / apart, (pairs.row[off], pairs.col[off])), pairs.shape)
    return (diags(np.asarray(graph.sum(axis=1)).ravel()) - graph).tocsr()


def _neighbours(spline: Spline) -> csr_matrix:
    """(B, B) matrix of ones for neighbours in the Bezier net."""
    place = np.arange(64).reshape(4, 4, 4)
    ends = [(place[:3], place[1:]), (place[:, :3], place[:, 1:]), (place[..., :3], place[..., 1:])]
    first, second = (
        np.concatenate([spline.nodes[:, pair[k].ravel()].ravel() for pair in ends]) for k in (0, 1)
    )
    size = spline.extraction.shape[0]
    graph = csr_matrix((np.ones(len(first)), (first, second)), (size, size))
    graph.data[:] = 1  # shared by elements, counted once
    return graph + graph.T


def _on_boundary(
    matcher: Matcher, graph: csr_matrix, iterations: int
) -> tuple[np.ndarray, np.ndarray]:
    """Control points (T,) that contribute to the boundary, and their goals (T, 3)."""
    control = matcher.spline.control.copy()
    touched = np.flatnonzero(np.bincount(matcher.rows.indices, minlength=len(control)))
    fair = graph[touched][:, touched]
    fair = fair - diags(np.asarray(fair.sum(axis=1)).ravel())  # among the touched ones
    longest = np.inf
    for _ in range(iterations):
        rows, goal, _, weight = matcher(control)
        at = rows[:, touched]
        weighted = at.T @ diags(weight)
        square = weighted @ at
        size = square.diagonal().mean()
        square = square + MEMBRANE * size / fair.diagonal().mean() * fair
        square = square + REGULARIZATION * size * identity(len(touched))
        factor = splu(square.tocsc(), **SYMMETRIC, options={"SymmetricMode": True})
        step = factor.solve(weighted @ (goal - rows @ control))
        last, longest = longest, np.linalg.norm(step, axis=1).max()
        if longest > last:  # the matches contradict each other
            break
        control[touched] += step
    return touched, control[touched]


def _follow(
    graph: csr_matrix, fixed: np.ndarray, places: np.ndarray, control: np.ndarray
) -> np.ndarray:
    """All control points (C, 3): the fixed ones (T,) at their positions, the others harmonic."""
    step = np.zeros_like(control)
    step[fixed] = places - control[fixed]
    free = np.setdiff1d(np.arange(len(control)), fixed)
    if len(free):
        inner, pull = graph[free][:, free], -graph[free][:, fixed] @ step[fixed]
        scale = diags(1 / inner.diagonal())
        for axis in range(3):
            step[free, axis], _ = cg(inner, pull[:, axis], rtol=1e-6, maxiter=400, M=scale)
    return control + step
