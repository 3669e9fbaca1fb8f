"""Pictures of a solution: the boundary of the Bezier solid, deformed and coloured."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.sparse import csr_matrix

from polycube.report.pictures.colours import DISPLACEMENT_COLOURS, FIELD_COLOURS, ramp
from polycube.report.pictures.render import Film, Layer, Scene
from polycube.spline.boundary import grid, sampling
from polycube.types import Deformation, Modes, Potential, Solution, Spline

N_MODES = 4  # number of modes in pictures
AMPLITUDE = 0.08  # of the diagonal: the largest displacement in a picture
TINY = 1e-300


@dataclass(frozen=True, eq=False)
class Skin:
    """Small quads on the boundary; `points @ values` evaluates values of the Bezier nodes."""

    points: csr_matrix  # (P, B) weight of each Bezier node at each point
    places: np.ndarray  # (P, 3) the points at rest
    quads: np.ndarray  # (Q, 4) indices of points, counter-clockwise from outside
    edges: np.ndarray  # (L, 2) indices of points: parts of the edges of the elements

    def layer(self, colours: np.ndarray, shift: np.ndarray | float = 0.0) -> Layer:
        """The skin with colours of points (P, 3) or quads (Q, 3), displaced by (P, 3)."""
        return Layer(self.places + shift, self.quads, colours, self.edges, smooth=True)


def tessellate(spline: Spline, pieces: int = 4) -> Skin:
    """Boundary faces of the elements, each divided into pieces * pieces quads."""
    n = pieces + 1
    points = sampling(spline, *grid(np.arange(n) / pieces))[0]
    rows = np.arange(len(spline.sides) * n * n).reshape(-1, n * n)
    local = np.arange(n * n).reshape(n, n)
    corners = [local[:-1, :-1], local[:-1, 1:], local[1:, 1:], local[1:, :-1]]
    quads = rows[:, np.stack([c.ravel() for c in corners], 1)].reshape(-1, 4)
    rim = np.concatenate([local[0], local[1:, -1], local[-1, -2::-1], local[-2::-1, 0]])
    edges = rows[:, np.stack([rim[:-1], rim[1:]], 1)].reshape(-1, 2)
    return Skin(points, points @ (spline.extraction @ spline.control), quads, edges)


def makers(spline: Spline, solution: Solution) -> dict[str, Callable[[], Scene | Film]]:
    """Functions that make each picture of a solution."""
    if isinstance(solution, Modes):
        first = first_elastic(solution)
        numbers = range(first, min(first + N_MODES, len(solution.eigenvalues)))
        return {f"mode_{n}": partial(mode, spline, solution, n) for n in numbers}
    if isinstance(solution, Deformation):
        return {"static": partial(deformed, spline, solution)}
    return {"poisson": partial(potential, spline, solution)}


def mode(spline: Spline, modes: Modes, number: int, amplitude: float = AMPLITUDE) -> Film:
    """One mode, coloured by its displacement, which is scaled to the largest value `amplitude`."""
    skin = tessellate(spline)
    shift = skin.points @ (spline.extraction @ modes.shapes[number])
    length = np.linalg.norm(shift, axis=1)
    colours = ramp(length / max(length.max(), TINY), DISPLACEMENT_COLOURS)
    return Film(skin.layer(colours), exaggeration(skin.places, length.max(), amplitude) * shift)


def deformed(spline: Spline, found: Deformation) -> Scene:
    """The deformed solid, exaggerated, coloured by von Mises stress.

    The upper end of the colours is the largest stress away from singular places.
    """
    skin = tessellate(spline)
    shift = skin.points @ found.displacement
    stress = skin.points @ found.von_mises
    scale = exaggeration(skin.places, np.linalg.norm(shift, axis=1).max())
    largest = found.peak.value if found.peak else stress.max()
    return [skin.layer(ramp(stress / max(largest, TINY), FIELD_COLOURS), scale * shift)]


def potential(spline: Spline, found: Potential) -> Scene:
    """The solid coloured by u, from its smallest to its largest value on the surface."""
    skin = tessellate(spline)
    u = skin.points @ (spline.extraction @ found.values)
    return [skin.layer(ramp((u - u.min()) / max(np.ptp(u), TINY), FIELD_COLOURS))]


def first_elastic(modes: Modes) -> int:
    """Number of the first elastic mode."""
    return min(modes.rigid, len(modes.eigenvalues) - 1)


def exaggeration(points: np.ndarray, largest: float, amplitude: float = AMPLITUDE) -> float:
    """Factor that scales the largest displacement to a share of the diagonal of points (N, 3)."""
    return amplitude * np.linalg.norm(np.ptp(points, axis=0)) / max(largest, TINY)
