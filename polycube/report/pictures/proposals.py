"""A sheet of the structures proposed for a part."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from polycube.report.pictures.render import Scene, view
from polycube.report.pictures.scenes import polycube_faces
from polycube.types import Ranked

MOST = 8  # largest number
COLUMNS = 4
APART = 1.1  # distance between the centres of two polycubes, in diagonals


def distinct(ranked: Sequence[Ranked]) -> list[Ranked]:
    """The best proposals of a ranking with different polycubes, at most `MOST`."""
    found: dict[str, Ranked] = {}
    for entry in ranked:
        if entry.candidate.blocks is None:
            found.setdefault(entry.candidate.key, entry)
    return list(found.values())[:MOST]


def sheet(shown: Sequence[Ranked]) -> Scene:
    """Polycubes of diagonal 1 in rows of `COLUMNS`, oriented as the model."""
    scene = []
    for number, entry in enumerate(shown):
        [shape] = polycube_faces(entry.candidate.polycube, entry.candidate.rough_map)
        low, high = shape.points.min(axis=0), shape.points.max(axis=0)
        centred = (shape.points - (low + high) / 2) / np.linalg.norm(high - low)
        row, column = divmod(number, COLUMNS)
        shift = APART * (column * view()[0] - row * view()[1])
        scene.append(replace(shape, points=centred + shift, line_width=2))
    return scene
