"""Pictures side by side on one sheet, with their names below them."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from pathlib import Path

from polycube.io.atomic import atomic_write
from polycube.report.pictures.pictures import draw
from polycube.report.pictures.render import Picture

MARGIN = 10  # pixels round a picture
LABEL = 24  # pixels for its name
SHADES = 96  # colours of a sheet
Draw = Callable[[Mapping[str, Picture]], dict[str, bytes]]  # PNG pictures of scenes


def write_tiles(
    path: Path,
    pictures: Mapping[str, Picture],
    columns: int,
    size: tuple[int, int] = (280, 220),
    *,
    is_named: bool = True,
    draw: Draw = draw,
) -> None:
    """Write a PNG of pictures in rows, in their order.

    Parameters
    ----------
    path : the file
    pictures : scenes by their names
    columns : number of pictures in a row
    size : width and height of a picture in pixels
    is_named : whether the names are written below the pictures
    draw : what makes PNG pictures of scenes, by their names

    Raises
    ------
    RuntimeError
        If a picture cannot be drawn.
    """
    from PIL import Image, ImageDraw, ImageFont

    drawn = draw({str(number): shown for number, shown in enumerate(pictures.values())})
    width, height = size[0] + 2 * MARGIN, size[1] + 2 * MARGIN + LABEL * is_named
    page = Image.new("RGB", (columns * width, -(-len(pictures) // columns) * height), "white")
    pen, font = ImageDraw.Draw(page), ImageFont.load_default(15)
    for number, name in enumerate(pictures):
        if str(number) not in drawn:
            raise RuntimeError(f"the picture {name!r} of {path.name} was not drawn")
        row, column = divmod(number, columns)
        tile = Image.open(io.BytesIO(drawn[str(number)])).convert("RGBA")
        tile.thumbnail(size)
        left, top = column * width + MARGIN, row * height + MARGIN
        free = [(room - used) // 2 for room, used in zip(size, tile.size, strict=True)]
        page.paste(tile, (left + free[0], top + free[1]), tile)
        if is_named:
            place = left + size[0] / 2, top + size[1] + LABEL / 2
            pen.text(place, name, "#1f2a36", font, anchor="mm")
    with atomic_write(path) as temporary:
        page.quantize(SHADES, dither=Image.Dither.NONE).save(temporary, "PNG", optimize=True)
