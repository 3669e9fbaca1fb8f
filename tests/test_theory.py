"""The page that follows a part through the search is made from what the search did."""

import re
from pathlib import Path

import pytest

from docs.generators.theory.search import page, searched
from tests.conftest import ROOT

PICTURES = ROOT / "docs" / "theory" / "pictures"
LINK = re.compile(r"\]\((pictures/[^)]+)\)")


def test_every_picture_is_shown() -> None:
    text = "".join(path.read_text(encoding="utf-8") for path in PICTURES.parent.glob("*.md"))
    assert set(LINK.findall(text)) == {f"pictures/{path.name}" for path in PICTURES.iterdir()}


@pytest.mark.slow
def test_the_page_has_a_section_and_a_picture_for_each_move(tmp_path: Path) -> None:
    few = "meshing.size=14%", "structure=slices", "order=[meshing]"
    history, state = searched("example:dice", *few)
    text = page(history, tmp_path)
    assert text.count("\n## ") == len(history.moves) + 1
    assert all(f"## {number}. " in text for number in range(1, len(history.moves) + 1))
    shown = set(LINK.findall(text))
    assert shown == {f"pictures/{path.name}" for path in tmp_path.iterdir()}
    assert len(shown) >= 1 + len(history.outcomes)
    assert state.hexes is not None and f"{len(state.hexes.hexes):,} hexes" in text
