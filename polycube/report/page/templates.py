"""The templates of the pages: Jinja2, which escapes all text from outside."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from markupsafe import Markup, escape

from polycube.report.numbers import formatting
from polycube.report.pictures import colours
from polycube.types import Json

if TYPE_CHECKING:
    from jinja2 import Environment

FOLDER = Path(__file__).parent / "templates"
NOTHING = Markup()

Pictures = Mapping[str, bytes]  # PNG or GIF by name
Row = dict[str, object]


@dataclass(frozen=True)
class Swatch:
    """A name with its colour, #rrggbb, or None."""

    name: str
    colour: str | None = None


@dataclass(frozen=True)
class Link:
    """A link to a file in the folder of the page or below it."""

    label: str
    target: str


def render(template: str, **values: object) -> Markup:
    """HTML of a template of the folder `templates`."""
    return Markup(environment().get_template(template).render(values))


def element(template: str, name: str, *values: object) -> Markup:
    """HTML of one macro of a template."""
    return Markup(getattr(environment().get_template(template).module, name)(*values))


@cache
def environment() -> Environment:
    """Jinja2 with the filters and names that the templates use."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    made = Environment(undefined=StrictUndefined, autoescape=True, loader=FileSystemLoader(FOLDER))
    made.trim_blocks = made.lstrip_blocks = True
    made.filters |= {"show": show, "data_uri": data_uri, "address": quote}
    made.filters |= {"faces": faces, "spaced": spaced}
    made.globals |= {"colours": colours, "formatting": formatting}
    made.globals |= {"source": source, "columns": columns}
    return made


def source(name: str) -> Markup:
    """A file of the folder `templates`, unchanged."""
    return Markup((FOLDER / name).read_text(encoding="utf-8"))


def show(value: object) -> Markup:
    """A value as escaped text: 12 345, 0.3142, yes, a, b."""
    if isinstance(value, Swatch):
        box = Markup('<i class=swatch style="background:{}"></i>{}')
        return box.format(value.colour or "none", value.name)
    if isinstance(value, Link):
        return Markup('<a href="{}">{}</a>').format(quote(value.target), value.label)
    if isinstance(value, Mapping):
        return show([Markup("{} {}").format(key, show(item)) for key, item in value.items()])
    if isinstance(value, Iterable) and not isinstance(value, str):
        return Markup(", ").join(map(show, value))
    return escape(value if isinstance(value, str) else formatting.text(value))


def data_uri(picture: bytes) -> str:
    """A PNG or GIF as an address."""
    kind = "gif" if picture.startswith(b"GIF") else "png"
    return f"data:image/{kind};base64,{base64.b64encode(picture).decode()}"


def columns(rows: Sequence[Row]) -> list[str]:
    """The columns that any of the rows has, in order."""
    return list(dict.fromkeys(name for row in rows for name in row))


def faces(found: Json, between: str = ", ") -> str:
    """The CAD faces of a feature or a contact, with their names in the file."""
    pairs = zip(found["faces"], found["names"], strict=True)
    return between.join(f"{face} ({name})" if name else face for face, name in pairs)


def spaced(measure: str) -> str:
    """The name of a measure in words."""
    return measure.replace("_", " ").replace("jacobian", "Jacobian")
