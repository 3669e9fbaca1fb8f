"""The name of a file alone."""

from pathlib import Path

import pytest

from polycube.cli.arguments import with_mesh


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("part.step", "other.stl", "a=b.stl"):
        (tmp_path / name).touch()
    (tmp_path / "parts").mkdir()


@pytest.mark.parametrize("name", ["part.step", "./part.step", "a=b.stl"])
def test_the_only_file_is_the_mesh(name: str) -> None:
    assert with_mesh([name, "meshing.size=3"]) == [f"mesh={name}", "meshing.size=3"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["nowhere.step"],
        ["parts"],
        ["part.step", "other.stl"],
        ["mesh=other.stl", "part.step"],
        ["hex=other.stl", "part.step"],
        ["--help"],
        ["mesh=" + ",".join(f"parts/{n}.step" for n in range(1000))],
        [],
    ],
)
def test_anything_else_stays_as_it_is(arguments: list[str]) -> None:
    assert with_mesh(arguments) == arguments
