"""Energy of a mesh in which hexes that may be inverted inside are halved in each direction.

The energy of a hex contains its eight corners and its centre, but det J can be negative elsewhere.
The corners of the eight halves of a trilinear hex are at the 27 nodes of det J, which has degree 2
in each parameter.
"""

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_matrix

from polycube.fitting import energy
from polycube.fitting.energy import Terms
from polycube.fitting.springs import NO_SPRINGS, Springs
from polycube.hexmesh.certificate import certify
from polycube.hexmesh.connectivity import CHILDREN, GRID, PLACES
from polycube.hexmesh.scaled_jacobian import scaled_jacobian

DOUBTFUL = 0.5  # scaled Jacobian below which det J may be negative inside a hex
CLEAR = 0.05  # det J, relative to its mean, above which a hex is not halved
NODES = GRID / 2  # (27, 3) parameters, zeta fastest
WEIGHTS = np.where(PLACES, NODES[:, None], 1 - NODES[:, None]).prod(axis=2)  # (27, 8) of corners


def certified_jacobian(vertices: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """(H,) scaled Jacobians, at most 0 where det J is not positive everywhere in the hex."""
    found = scaled_jacobian(vertices, hexes)
    doubtful = np.flatnonzero((found > 0) & (found < DOUBTFUL))
    found[doubtful[~certify(vertices, hexes[doubtful]).positive]] = 0.0
    return found


def halved_energy(
    x: np.ndarray, hexes: np.ndarray, lengths: np.ndarray, terms: Terms, springs: Springs
) -> Callable[[np.ndarray], tuple[float, np.ndarray]]:
    """Function of the positions (V, 3) that gives the energy and its gradient (V, 3).

    The arguments are those of `polycube.fitting.energy.energy`. Hexes whose det J is not clearly
    positive at x count twice: whole, and halved. The halves have no floor.
    """
    some = np.flatnonzero(scaled_jacobian(x, hexes) < DOUBTFUL)
    some = some[certify(x, hexes[some]).least < CLEAR]
    shape = 27 * len(some), len(x)
    row, column = np.repeat(np.arange(shape[0]), 8), np.repeat(hexes[some], 27, axis=0).ravel()
    nodes = csr_matrix((np.tile(WEIGHTS.ravel(), len(some)), (row, column)), shape=shape)
    halves = (27 * np.arange(len(some))[:, None, None] + CHILDREN).reshape(-1, 8)
    half = np.repeat(lengths[some] / 2, 8, axis=0)
    free = terms._replace(floor=-np.inf)

    def function(y: np.ndarray) -> tuple[float, np.ndarray]:
        value, gradient = energy.energy(y, hexes, lengths, terms, springs)
        if not len(some):
            return value, gradient
        more, by_node = energy.energy(nodes @ y, halves, half, free, NO_SPRINGS)
        return value + more, gradient + nodes.T @ by_node

    return function
