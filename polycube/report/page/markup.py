"""Elements of the page: numbers, tables, figures, sections. Text from outside is escaped."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from urllib.parse import quote

import numpy as np

Pictures = Mapping[str, bytes]  # PNG or GIF by name


@dataclass(frozen=True)
class Swatch:
    """A name with its colour, #rrggbb, or None."""

    name: str
    colour: str | None = None


@dataclass(frozen=True)
class Link:
    """A link to a file beside the page."""

    words: str
    target: str


def show(value: object) -> str:
    """A value as escaped text: 12 345, 0.3142, yes, a, b."""
    if value is None:
        return "–"
    if isinstance(value, Swatch):
        box = f'<i class=swatch style="background:{value.colour or "none"}"></i>'
        return f"{box}{escape(value.name)}"
    if isinstance(value, Link):
        return f'<a href="{_address(value.target)}">{escape(value.words)}</a>'
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    large = isinstance(value, float | np.floating) and 1e4 <= abs(value) < 1e9
    if large or isinstance(value, int | np.integer):
        return f"{value:,.0f}".replace(",", "\u202f")
    if isinstance(value, float | np.floating):
        return f"{value:.4g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{escape(str(k))} {show(v)}" for k, v in value.items())
    if isinstance(value, Iterable) and not isinstance(value, str):
        return ", ".join(show(item) for item in value)
    return escape(str(value))


def _address(path: str) -> str:
    """The address of a file beside the page, which never looks like one with a scheme."""
    return escape(quote(path))


def point(where: Sequence[float], digits: int) -> str:
    """Coordinates with a number of decimals."""
    return f"({', '.join(f'{round(c, digits) + 0.0:.4g}' for c in where)})"


def facts(rows: Mapping[str, object]) -> str:
    """A two-column table of names and values; rows with the value None are omitted."""
    cells = (
        f"<tr><th>{_words(name)}</th><td>{show(value)}</td></tr>"
        for name, value in rows.items()
        if value is not None
    )
    return f'<table class="facts">{"".join(cells)}</table>'


def table(rows: Sequence[Mapping[str, object]], chosen: int | None = None) -> str:
    """Rows with the names of their columns; `chosen` is emphasised."""
    columns = list(dict.fromkeys(name for row in rows for name in row))
    head = "".join(f"<th>{_words(name)}</th>" for name in columns)
    body = "".join(
        f"<tr{' class=chosen' if i == chosen else ''}>"
        + "".join(f"<td>{show(row.get(name))}</td>" for name in columns)
        + "</tr>"
        for i, row in enumerate(rows)
    )
    rows_of_table = f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody>"
    return f'<div class="scroll"><table>{rows_of_table}</table></div>'


def _words(name: str) -> str:
    return escape(name.replace("_", " "))


def distance_table(
    numbers: Mapping[str, float], ways: Mapping[str, str], diagonal: float | None
) -> str:
    """Distances between two solids, in per cent of the diagonal and, if it is known, as lengths.

    numbers : fractions of the diagonal, `<way>_max`, `<way>_p99`, `<way>_mean`
    ways : title -> way
    """
    titles = {"largest": "max", "99th percentile": "p99", "mean": "mean"}
    rows = []
    for name, way in ways.items():
        found = {title: numbers.get(f"{way}_{part}") for title, part in titles.items()}
        cells = {title: _distance(value, diagonal) for title, value in found.items()}
        if any(cells.values()):
            rows.append({"from": name, **cells})
    if not rows:
        return ""
    return table(rows) + "<p class=note>Per cent of the diagonal; in brackets model units.</p>"


def _distance(value: float | None, diagonal: float | None) -> str | None:
    if value is None:
        return None
    length = f" ({show(value * diagonal)})" if diagonal else ""
    return f"{100 * value:.3g} %{length}" if value > 1e-9 else "0"


def folded(title: str, body: str, is_long: bool = False) -> str:
    """Details that are folded behind their title; unfolded in print unless they are long."""
    kind = " class=long" * is_long
    return f"<details{kind}><summary>{escape(title)}</summary>{body}</details>"


def figure(picture: bytes | None, caption: str, legend: str = "", wide: bool = False) -> str:
    """A PNG or GIF inside the page; empty if there is none.

    caption : plain text
    wide : use the whole width of the page
    """
    if picture is None:
        return ""
    data = base64.b64encode(picture).decode()
    kind = "gif" if picture.startswith(b"GIF") else "png"
    text = escape(caption)
    return (
        f"<figure{' class=wide' * wide}>"
        f'<img alt="{text}" src="data:image/{kind};base64,{data}">{legend}'
        f"<figcaption>{text}</figcaption></figure>"
    )


def gradient(colours: Sequence[str], low: str, high: str) -> str:
    """Colour bar below a picture."""
    return (
        f'<div class="legend"><span>{escape(low)}</span>'
        f'<i style="background:linear-gradient(90deg,{",".join(colours)})"></i>'
        f"<span>{escape(high)}</span></div>"
    )


def swatches(names: Sequence[str], colours: Sequence[str]) -> str:
    """Legend of named colours below a picture."""
    items = (
        f'<span><i style="background:{colour}"></i>{escape(name)}</span>'
        for name, colour in zip(names, colours, strict=True)
    )
    return f'<div class="swatches">{"".join(items)}</div>'


def section(anchor: str, title: str, *parts: str) -> str:
    """A section of the page; empty if all its parts are."""
    body = "".join(parts)
    return f'<section id="{anchor}"><h2>{escape(title)}</h2>{body}</section>' if body else ""


def grid(*parts: str) -> str:
    """Figures side by side; empty ones are omitted."""
    body = "".join(parts)
    return f'<div class="grid">{body}</div>' if body else ""
