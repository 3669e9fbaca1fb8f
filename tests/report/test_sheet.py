"""The sheet of random parts: each next to its polycube, in the colours of the axes."""

import io
from pathlib import Path

import numpy as np
import pytest

from docs.generators import sheet
from docs.generators.tiles import MARGIN
from polycube.diffusion.pairs.any_structure import LatticePairs
from polycube.report.pictures.colours import AXIS_COLOURS, rgb
from polycube.report.pictures.render import view


def test_a_part_stands_left_of_its_polycube() -> None:
    part = LatticePairs(0, 0).part(3)
    shape, goal = sheet.side_by_side(part)
    right = view()[0]
    assert (goal.points @ right).min() == pytest.approx((shape.points @ right).max() + sheet.GAP)
    assert np.array_equal(shape.colours, rgb(AXIS_COLOURS)[part.surface.axis])
    assert np.array_equal(shape.points, part.geometry)
    assert {tuple(c) for c in goal.colours} == {tuple(c) for c in shape.colours}


def test_the_sheet_has_a_tile_for_each(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    images, scenes = {}, {}
    for colour in ("red", "white"):
        image.new("RGB", (400, 300), colour).save(file := io.BytesIO(), "PNG")
        images[colour] = file.getvalue()

    def draw(found: dict) -> dict[str, bytes]:
        scenes.update(found)
        return {name: images["red" if name == "5" else "white"] for name in found}

    sheet.sheet(tmp_path / "sheet.png", seed=2, first=10, draw=draw)
    assert len(scenes) == sheet.COLUMNS * sheet.ROWS
    assert np.array_equal(scenes["5"][0].points, LatticePairs(2, 0).part(15).geometry)
    page = np.asarray(image.open(tmp_path / "sheet.png").convert("RGB"))
    width, height = (size + 2 * MARGIN for size in sheet.TILE)
    assert page.shape == (sheet.ROWS * height, sheet.COLUMNS * width, 3)
    red = (page == [255, 0, 0]).all(axis=2)
    row, column = divmod(5, sheet.COLUMNS)
    assert red[row * height : (row + 1) * height, column * width : (column + 1) * width].sum() == (
        red.sum()
    )
    assert red.sum() > 40_000
    with pytest.raises(RuntimeError, match=r"of other\.png was not drawn"):
        sheet.sheet(tmp_path / "other.png", rows=1, draw=lambda found: {})
