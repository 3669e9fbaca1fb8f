"""Recognition of the polycube from noisy points on its boundary."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, product

import numpy as np
from scipy.special import ndtr

from polycube.structure.lattice import collapse, genus, is_manifold, lattice
from polycube.types import Polycube

CHANGES = 2  # largest number of cells that differ from the expected structure
NOISE = (0.03, 0.06, 0.12, 0.2)  # standard deviations of the noise, in cells
OUTLIERS = 1e-3  # density of outliers, per cell^3


def read_structure(
    points: np.ndarray,
    expected: Polycube,
    primitives: Mapping[str, np.ndarray],
    margin: float = 0.0,
) -> Polycube:
    """The most probable polycube of points (N, 3), with the grid and genus of the expected one.

    The candidates are all structures that differ from the expected one in at most CHANGES cells; on
    a grid of two cells these are all structures. For evenly distributed points, all 24 contexts of
    2x1 are recognised up to a noise of 0.1 cells; at 0.15, half the thickness of a wall, the
    directions of holes are lost.

    primitives : voxels (3, 3, 3) bool for each name
    margin : smallest gain in log-likelihood per point for a structure other than the expected one

    Returns the expected polycube itself, or another one, collapsed.
    """
    wanted = genus(expected)
    best, most = expected, log_likelihood(points, collapse(expected)) + margin * len(points)
    for context in _changed(expected.context, tuple(primitives)):
        polycube = lattice(expected.grid, context, primitives)
        if is_manifold(polycube) and genus(polycube) == wanted:
            log_p = log_likelihood(points, collapse(polycube))
            if log_p > most:
                best, most = collapse(polycube), log_p
    return best


def _changed(
    context: Sequence[str | None], names: Sequence[str]
) -> Iterator[tuple[str | None, ...]]:
    """Contexts that differ from the given one in one to CHANGES cells."""
    for n_cells in range(1, min(CHANGES, len(context)) + 1):
        for cells in combinations(range(len(context)), n_cells):
            others = [[n for n in (*names, None) if n != context[cell]] for cell in cells]
            for fillings in product(*others):
                changed = list(context)
                for cell, filling in zip(cells, fillings, strict=True):
                    changed[cell] = filling
                yield tuple(changed)


def log_likelihood(points: np.ndarray, polycube: Polycube) -> float:
    """Log-likelihood of points (N, 3) spread evenly over the boundary with Gaussian noise.

    The value is exact: over a rectangle, a Gaussian is a product of one-dimensional integrals. The
    noise is the most probable one of NOISE.
    """
    solid = np.pad(polycube.occupancy, 1)
    walls = []  # for each axis (knots, boxes, boxes) bool: whether a boundary face is there
    for axis in range(3):
        changes = np.diff(np.moveaxis(solid, axis, 0).astype(np.int8), axis=0) != 0
        walls.append(changes[:, 1:-1, 1:-1].astype(float))
    sides = zip(walls, _others([np.diff(knots) for knots in polycube.knots]), strict=True)
    area = sum(np.einsum("puv,u,v->", wall, *side) for wall, side in sides)
    best = -np.inf
    for sigma in NOISE:
        off = [(points[:, [k]] - polycube.knots[k]) / sigma for k in range(3)]  # (N, knots)
        within = [-np.diff(ndtr(o), axis=1) for o in off]
        across = [np.exp(-(o**2) / 2) / (np.sqrt(2 * np.pi) * sigma) for o in off]
        axes = zip(across, _others(within), walls, strict=True)
        parts = (("np,nu,nv,puv->n", normal, *side, wall) for normal, side, wall in axes)
        density = sum(np.einsum(*part, optimize=True) for part in parts)
        best = max(best, float(np.log(density / area + OUTLIERS).sum()))
    return best


def _others(values: list[np.ndarray]) -> list[tuple[np.ndarray, np.ndarray]]:
    """For each axis the values of the two other axes."""
    x, y, z = values
    return [(y, z), (x, z), (x, y)]
