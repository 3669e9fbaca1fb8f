"""The page of several results: their 3D views side by side, and their main numbers."""

import json
import os
import re
from collections.abc import Sequence
from pathlib import Path

from markupsafe import Markup

from polycube.errors import InputError
from polycube.io import manifest
from polycube.report.numbers.verdict import tiles, verdict
from polycube.report.page.html import page
from polycube.report.page.templates import Link, render

PAGE = "view.html"
VIEWER = re.compile(r'<div class="viewer">.*?</script>\s*</div>', re.DOTALL)


def write_view(results: Sequence[Path], folder: Path) -> Path:
    """Write `folder/view.html`.

    Raises InputError if a report has no 3D view, if its numbers cannot be read, or if the page
    would overwrite a file of the user.

    results : folders of results, whose reports have the views
    """
    text = _page(results, folder)
    with manifest.writing(folder) as scratch:
        (scratch / PAGE).write_text(text, encoding="utf-8")
    return folder / PAGE


def _page(folders: Sequence[Path], page_folder: Path) -> str:
    places = [folder.resolve() for folder in folders]
    parent, links = os.path.commonpath(places), []
    for place in places:
        name = place.relative_to(parent).as_posix()
        target = os.path.relpath(place, page_folder.resolve())
        label = place.name if name == "." else name
        links.append(Link(label, f"{Path(target).as_posix()}/report.html"))
    numbers = list(map(_main_numbers, folders))
    views = list(zip(links, map(_view, folders), strict=True))
    title = f"{len(folders)} results" if len(folders) > 1 else links[0].label
    return page(title, render("comparison.html", views=views, numbers=numbers))


def _main_numbers(folder: Path) -> dict[str, str]:
    """The verdict and the main numbers of a report, by name."""
    path = folder / "report.json"
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
        return {"verdict": verdict(report)[1], **{tile.name: tile.value for tile in tiles(report)}}
    except (OSError, ValueError, LookupError, AttributeError, TypeError):
        raise InputError("it is not the report of a run", str(path)) from None


def _view(folder: Path) -> Markup:
    """The 3D view of a report."""
    path = folder / "report.html"
    found = VIEWER.search(path.read_text(encoding="utf-8", errors="replace"))
    if found is None:
        raise InputError("it has no 3D view that can be shown here; run infer.py again", str(path))
    return Markup(found[0])
