"""What the pictures show of a solution: the outside of the solid, moved and coloured."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from polycube.report.pictures.bezier import Skin, tessellate
from polycube.report.pictures.colours import DISPLACEMENT_COLOURS, FIELD_COLOURS, ramp
from polycube.report.pictures.render import Film, Layer, Scene
from polycube.types import Deformation, Modes, Potential, Solution, Spline

N_MODES = 4  # drawn
AMPLITUDE = 0.08  # of the diagonal: the largest displacement as it is drawn
TINY = 1e-300


def makers(spline: Spline, solution: Solution) -> dict[str, Callable[[], Scene | Film]]:
    """How each picture of a solution is made."""
    if isinstance(solution, Modes):
        first = first_elastic(solution)
        numbers = range(first, min(first + N_MODES, len(solution.eigenvalues)))
        return {f"mode_{n}": partial(mode, spline, solution, n) for n in numbers}
    if isinstance(solution, Deformation):
        return {"static": partial(deformed, spline, solution)}
    return {"poisson": partial(potential, spline, solution)}


def mode(spline: Spline, modes: Modes, number: int, amplitude: float = AMPLITUDE) -> Film:
    """One mode, coloured by its displacement, the largest of which is drawn as `amplitude`."""
    skin, points = _skin(spline)
    shift = skin.points @ (spline.extraction @ modes.shapes[number])
    length = np.linalg.norm(shift, axis=1)
    scale = exaggeration(points, length.max(), amplitude)
    colours = ramp(length / max(length.max(), TINY), DISPLACEMENT_COLOURS)
    return Film(Layer(points, skin.quads, colours, skin.edges, smooth=True), scale * shift)


def deformed(spline: Spline, found: Deformation) -> Scene:
    """The solid moved, exaggerated, in the colour of its von Mises stress.

    The last colour is that of the largest stress away from singular places, and of all above.
    """
    skin, points = _skin(spline)
    shift = skin.points @ (spline.extraction @ found.displacement)
    stress = skin.points @ found.von_mises
    scale = exaggeration(points, np.linalg.norm(shift, axis=1).max())
    largest = found.peak.value if found.peak else stress.max()
    colours = ramp(stress / max(largest, TINY), FIELD_COLOURS)
    return [Layer(points + scale * shift, skin.quads, colours, skin.edges, smooth=True)]


def potential(spline: Spline, found: Potential) -> Scene:
    """The solid in the colour of u, from its least to its largest on the surface."""
    skin, points = _skin(spline)
    u = skin.points @ (spline.extraction @ found.values)
    colours = ramp((u - u.min()) / max(np.ptp(u), TINY), FIELD_COLOURS)
    return [Layer(points, skin.quads, colours, skin.edges, smooth=True)]


def first_elastic(modes: Modes) -> int:
    """Number of the first mode that deforms the body."""
    return min(modes.rigid, len(modes.eigenvalues) - 1)


def exaggeration(points: np.ndarray, largest: float, amplitude: float = AMPLITUDE) -> float:
    """Factor that makes the largest displacement a share of the diagonal of points (N, 3)."""
    return amplitude * np.linalg.norm(np.ptp(points, axis=0)) / max(largest, TINY)


def _skin(spline: Spline) -> tuple[Skin, np.ndarray]:
    skin = tessellate(spline)
    return skin, skin.points @ (spline.extraction @ spline.control)
