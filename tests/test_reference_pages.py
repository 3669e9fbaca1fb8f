"""The generated pages of docs/reference are up to date and complete."""

from functools import cache

import pytest

from docs.generators.reference.__main__ import PAGES, write
from docs.generators.reference.api import DATA
from docs.generators.reference.markdown import docstring, signature
from docs.generators.reference.plugins import EXAMPLES, examples
from polycube.kinds import KINDS
from polycube.registry import classes, options
from tests.conftest import ROOT


@cache
def made(name: str) -> str:
    """A page as the code says it."""
    return PAGES[name]()


@pytest.mark.parametrize("name", PAGES)
def test_the_page_is_what_the_code_says(name: str) -> None:
    committed = (ROOT / "docs" / "reference" / name).read_text(encoding="utf-8")
    assert committed == made(name), "run: python -m docs.generators.reference docs"


def test_all_pages_are_written(tmp_path) -> None:
    (tmp_path / "reference").mkdir()
    write(tmp_path)
    assert {path.name for path in (tmp_path / "reference").iterdir()} == set(PAGES)


def test_every_option_of_every_plugin_is_there() -> None:
    text = made("options.md")
    for (kind, name), cls in classes().items():
        if cls.__module__.startswith("polycube."):
            missing = [each for each in options(kind, cls) if f".{each}" not in text]
            assert not missing, (kind, name, missing)
    assert "| `meshing.size` | `5%` | wanted edge length of the hexes |" in text
    assert "| `cad.segments` | `48` | number of triangle edges on a full circle; down to" in text


def test_the_data_types_and_contracts_are_there() -> None:
    assert all(f"polycube.types.{name}" in made("api.md") for name in ("HexMesh", "Spline"))
    assert "HexMesh" in DATA and "part.save(" in made("api.md")
    assert "plugin(hexes: HexMesh, path: Path) -> Path" in made("plugins.md")


def test_a_docstring_becomes_a_list() -> None:
    def example(size: "float", *, name: str = "a") -> None:
        """Do it.

        Parameters
        ----------
        size : of the thing,
            in mm

        Raises
        ------
        ValueError
            Where it is negative.
        """

    assert docstring(example) == (
        "Do it.\n\n*Parameters*\n\n* `size`: of the thing, in mm\n\n"
        "*Raises*\n\n* ValueError: Where it is negative."
    )
    assert signature(example, "do") == "```python\ndo(size: float, *, name: str = a) -> None\n```"


def test_every_protocol_has_a_short_example() -> None:
    shown = {KINDS[kind].protocol for kind in KINDS if examples(kind)}
    assert shown == {kind.protocol for kind in KINDS.values()}
    for path in EXAMPLES.glob("*.py"):
        of_class = path.read_text(encoding="utf-8").partition("@register(")[2]
        assert len([line for line in of_class.splitlines() if line.strip()]) <= 30, path.name
