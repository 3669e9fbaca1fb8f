"""What the documentation names is there: functions, files, and headings that are linked to."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.fixtures.pages import DOCS, PAGES

FUNCTION = re.compile(r"`((?:polycube|plugins|tests)/[\w/]+\.py):(\w+(?:\.\w+)?)`")
MOST_PAGES = 17  # in a folder
LINK = re.compile(r"\]\(([^)\s]+)\)")


def pages(pattern: re.Pattern) -> list:
    """Of every page, what matches."""
    return [
        pytest.param(page, match, id=f"{page.relative_to(ROOT)}: {match}")
        for page in PAGES
        for match in sorted(set(pattern.findall(page.read_text(encoding="utf-8"))))
    ]


@cache
def defined(path: Path) -> set[str]:
    """Names of the functions and classes of a file, methods as `Class.method`."""
    names = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
            inner = node.body if isinstance(node, ast.ClassDef) else []
            names |= {f"{node.name}.{n.name}" for n in inner if isinstance(n, ast.FunctionDef)}
    return names


@cache
def anchors(path: Path) -> set[str]:
    """Of the headings of a page, as GitHub makes them."""
    heads = re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize(("page", "named"), pages(FUNCTION))
def test_a_function_that_is_named_exists(page: Path, named: tuple[str, str]) -> None:
    path, name = named
    assert name in defined(ROOT / path)


@pytest.mark.parametrize(("page", "target"), pages(LINK))
def test_a_link_leads_somewhere(page: Path, target: str) -> None:
    if target.startswith("https://"):
        return
    path, _, anchor = target.partition("#")
    there = (page.parent / path).resolve() if path else page
    assert there.exists()
    assert not anchor or anchor in anchors(there)


def test_the_index_leads_to_every_page() -> None:
    index = DOCS / "index.md"
    linked = {(DOCS / target).resolve() for target in LINK.findall(index.read_text("utf-8"))}
    assert set(DOCS.rglob("*.md")) - {index} <= linked


def test_no_folder_has_too_many_pages() -> None:
    folders = {path.parent for path in DOCS.rglob("*.md")}
    assert all(len(list(folder.glob("*.md"))) <= MOST_PAGES for folder in folders)


def test_the_page_of_the_paper_names_functions_of_every_part() -> None:
    text = (ROOT / "docs" / "theory" / "polycube.md").read_text(encoding="utf-8")
    folders = {Path(path).parent.as_posix() for path, _ in FUNCTION.findall(text)}
    assert {"polycube/diffusion", "polycube/fitting", "polycube/spline", "plugins"} <= folders
    assert len(FUNCTION.findall(text)) > 40
