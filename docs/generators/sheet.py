"""A picture of random parts with their polycubes, as used to train a diffusion model:

    python -m docs.generators.sheet sheet.png         # the first 24 pairs of seed 0
    python -m docs.generators.sheet sheet.png 7 48    # pairs 48 to 71 of seed 7

Colours show the axes, lines separate faces of the polycube.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from docs.generators.tiles import Draw, write_tiles
from polycube.diffusion.pairs.any_structure import LatticePairs, Part
from polycube.report.pictures.pictures import draw
from polycube.report.pictures.render import Scene, view
from polycube.report.pictures.scenes import labelled, polycube_faces
from polycube.types import Labels, TriMesh

COLUMNS, ROWS = 4, 6
TILE = (460, 230)  # size of a part and its polycube in pixels
GAP = 0.15  # gap between them, in units of the learning frame


def sheet(
    path: Path, seed: int = 0, first: int = 0, rows: int = ROWS, *, draw: Draw = draw
) -> None:
    """Write a PNG of rows of COLUMNS pairs, starting with number `first`."""
    pairs = LatticePairs(seed, n_points=0)
    scenes = {str(n): side_by_side(pairs.part(first + n)) for n in range(COLUMNS * rows)}
    write_tiles(path, scenes, COLUMNS, TILE, is_named=False, draw=draw)


def side_by_side(part: Part) -> Scene:
    """A part with its polycube on its right."""
    surface = part.surface
    plane = 8 * surface.axis + surface.knot  # faces of one plane never touch
    labels = Labels(surface.axis, plane)
    [shape] = labelled(TriMesh(part.geometry, surface.faces), labels)
    [goal] = polycube_faces(part.polycube)
    right = view()[0]
    shift = (shape.points @ right).max() - (goal.points @ right).min() + GAP
    return [replace(shape, smooth=True), replace(goal, points=goal.points + shift * right)]


if __name__ == "__main__":
    sheet(Path(sys.argv[1]), *map(int, sys.argv[2:4]))
