"""A picture of random parts with their polycubes, as used to train a diffusion model:

    python -m docs.generators.sheet sheet.png         # the first 24 pairs of seed 0
    python -m docs.generators.sheet sheet.png 7 48    # pairs 48 to 71 of seed 7

Colours show the axes, lines separate faces of the polycube.
"""

from __future__ import annotations

import io
import sys
from dataclasses import replace
from pathlib import Path

from polycube.diffusion.pairs.any_structure import LatticePairs, Part
from polycube.io.atomic import atomic_write
from polycube.report.pictures.pictures import draw
from polycube.report.pictures.render import Scene, view
from polycube.report.pictures.scenes import labelled, polycube_faces
from polycube.types import Labels, TriMesh

COLUMNS, ROWS = 4, 6
TILE = (480, 250)  # size of a part and its polycube in pixels
GAP = 0.15  # gap between them, in units of the learning frame


def sheet(path: Path, seed: int = 0, first: int = 0) -> None:
    """Write a PNG of COLUMNS * ROWS pairs, starting with number `first`."""
    from PIL import Image

    pairs = LatticePairs(seed, n_points=0)
    scenes = {str(n): side_by_side(pairs.part(first + n)) for n in range(COLUMNS * ROWS)}
    page = Image.new("RGB", (COLUMNS * TILE[0], ROWS * TILE[1]), "white")
    for name, png in draw(scenes).items():
        tile = Image.open(io.BytesIO(png)).convert("RGBA")
        tile.thumbnail((TILE[0] - 20, TILE[1] - 20))
        row, column = divmod(int(name), COLUMNS)
        left, top = ((room - size) // 2 for room, size in zip(TILE, tile.size, strict=True))
        page.paste(tile, (column * TILE[0] + left, row * TILE[1] + top), tile)
    with atomic_write(path) as temporary:
        page.save(temporary, "PNG", optimize=True)


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
