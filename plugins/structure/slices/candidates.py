"""Readings of a part in several frames and along their axes, as candidates."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from polycube.surface.frames import frames, rotations, turn
from polycube.surface.voxels import voxels
from polycube.types import Candidate, Polycube, TriMesh

from .alignment import Reading, View, read
from .options import Costs, Reader
from .patterns import Word
from .placement import misfit, place

TIE = 0.01  # weight of the lengths among equally good readings


def views(options: Reader, surface: TriMesh) -> list[View]:
    """The part in each of its frames, the best frame first."""
    return [
        View(frame, np.eye(3), voxels(surface, frame, options.resolution))
        for frame in frames(surface, options.frames)
    ]


def readings(
    costs: Costs, view: View, turns: Iterable[np.ndarray], words: Sequence[Word]
) -> list[Reading]:
    """Readings of the words along the first axis of each turn (3, 3) of a view, best first."""
    found = [reading for t in turns for reading in read(view.turned(t), words, costs)]
    return sorted(found, key=lambda reading: reading.cost)


def as_candidate(reading: Reading, proposal: str, frame: int) -> Candidate:
    """The candidate of a reading in the frame of that number, named as its lengths suggest."""
    unlike, index = min((misfit(reading, p), i) for i, p in enumerate(reading.word.polycubes))
    polycube = reading.word.polycubes[index]
    cost = reading.cost + TIE * unlike
    key = structure_key(polycube, reading.view.turn, frame)
    return Candidate(proposal, polycube, place(reading, polycube), cost, key)


def structure_key(polycube: Polycube, view: np.ndarray, frame: int) -> str:
    """The boxes of a polycube as they lie in a frame; equal for equal solids in it.

    view : (3, 3) turn from the frame to the axes of the polycube
    """
    boxes = turn(polycube.occupancy, view.T)
    bits = "".join("01"[int(full)] for full in boxes.ravel())
    return f"frame {frame}, {'x'.join(map(str, boxes.shape))} boxes {bits}"


def distinct_turns(polycube: Polycube, of_row: bool = False) -> list[np.ndarray]:
    """Turns (3, 3) in which a polycube lies differently; of a row also those that move its axis."""
    found: dict[tuple[int, str], np.ndarray] = {}
    for rotation in rotations():
        axis = int(np.abs(rotation[0]).argmax()) if of_row else 0
        found.setdefault((axis, structure_key(polycube, rotation, 0)), rotation)
    return list(found.values())
