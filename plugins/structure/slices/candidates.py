"""Alignments of a part in several frames and along their axes, as candidates."""

from collections.abc import Iterable, Sequence

import numpy as np

from polycube.surface.frames import frames, rotations, turn
from polycube.surface.voxels import voxels
from polycube.types import Candidate, Polycube, TriMesh

from .alignment import Alignment, SlabPattern, View, align
from .options import Costs, SliceOptions
from .placement import misfit, place

TIE = 0.01  # weight of the lengths among equally good alignments


def views(options: SliceOptions, surface: TriMesh) -> list[View]:
    """The part in each of its frames, the best frame first."""
    return [
        View(frame, np.eye(3), voxels(surface, frame, options.resolution))
        for frame in frames(surface, options.frames)
    ]


def alignments(
    costs: Costs, view: View, turns: Iterable[np.ndarray], patterns: Sequence[SlabPattern]
) -> list[Alignment]:
    """Alignments along the first axis of each rotation (3, 3) of a view, best first."""
    found = [each for t in turns for each in align(view.turned(t), patterns, costs)]
    return sorted(found, key=lambda alignment: alignment.cost)


def as_candidate(alignment: Alignment, proposal: str, frame: int) -> Candidate:
    """The candidate of an alignment in a frame; its context has the most similar lengths."""
    polycubes = alignment.pattern.polycubes
    difference, index = min((misfit(alignment, p), i) for i, p in enumerate(polycubes))
    polycube = polycubes[index]
    cost = alignment.cost + TIE * difference
    key = structure_key(polycube, alignment.view.turn, frame)
    return Candidate(proposal, polycube, place(alignment, polycube), cost, key)


def structure_key(polycube: Polycube, view: np.ndarray, frame: int) -> str:
    """Key of the boxes of a polycube in a frame; equal for equal solids.

    view : (3, 3) rotation from the frame to the axes of the polycube
    """
    boxes = turn(polycube.occupancy, view.T)
    bits = "".join("01"[int(full)] for full in boxes.ravel())
    return f"frame {frame}, {'x'.join(map(str, boxes.shape))} boxes {bits}"


def distinct_turns(polycube: Polycube, of_row: bool = False) -> list[np.ndarray]:
    """Rotations (3, 3) with different results for a polycube, or for a row with another axis."""
    found: dict[tuple[int, str], np.ndarray] = {}
    for rotation in rotations():
        axis = int(np.abs(rotation[0]).argmax()) if of_row else 0
        found.setdefault((axis, structure_key(polycube, rotation, 0)), rotation)
    return list(found.values())
