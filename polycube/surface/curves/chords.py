"""Distance between a crease and a polygon with vertices on it."""

from collections.abc import Callable

import numpy as np

from polycube.surface.curves.features import Crease

SAMPLES = 16  # points on the crease for every chord
MOST = 95  # per cent of the points that are within the given distance


def chord_error(crease: Crease, number: int) -> float:
    """Distance that contains 95 % of a crease, for chords of equal arc length.

    number : number of chords, at least 1; at least 3 for a loop
    """
    ends = crease.at(np.linspace(0, crease.length, number + 1)[:-1])[0]
    last = ends[0] if crease.is_loop else crease.at(np.array([crease.length]))[0][0]
    chord = np.diff(np.vstack([ends, last]), axis=0)[:, None]
    arc = crease.length / number * (np.arange(number * SAMPLES) + 0.5) / SAMPLES
    apart = crease.at(arc)[0].reshape(number, SAMPLES, 3) - ends[:, None]
    square = np.maximum((chord * chord).sum(axis=2), 1e-30)
    share = np.clip((apart * chord).sum(axis=2) / square, 0, 1)
    gaps = np.linalg.norm(apart - share[:, :, None] * chord, axis=2)
    return float(np.percentile(gaps, MOST))


def chords_needed(error: Callable[[int], float], wanted: float, least: int, most: int) -> int:
    """The smallest number of chords, from `least` to `most`, that are within a distance.

    If no number meets the distance: the number with the smallest error.

    Parameters
    ----------
    error : distance for a number of chords, as `chord_error` gives it
    """
    numbers = range(least, most + 1)
    errors = []
    for number in numbers:
        errors.append(error(number))
        if errors[-1] <= wanted:
            return number
    return numbers[int(np.argmin(errors))]
