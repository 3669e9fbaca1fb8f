"""A part that is saved in several units has the same physical answer and the same deck."""

import re

import numpy as np
import pytest
from scipy.spatial import cKDTree

import polycube
from polycube.units import METRES
from tests.fixtures import step_files
from tests.fixtures.runs import FAST

PROBLEM = [
    "order=[meshing,spline,analysis]",
    "spline=c0",
    "analysis=static",
    "analysis.fixed=[x_min]",
    "analysis.loads=[{at: x_max, force: [0, 0, -100]}, {at: z_max, pressure: 1e5}]",
    "analysis.gravity=[0, 0, -9.81]",
    "export=[abaqus,nastran]",
]


def numbers(text: str, keyword: str, columns: slice) -> np.ndarray:
    block = re.search(rf"^\*{keyword}\b[^\n]*\n(.*?)(?=^\*)", text, re.M | re.S)[1]
    return np.array([row.split(", ")[columns] for row in block.splitlines()], float)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Result and deck of a box of 40 x 20 x 10 mm by its unit."""
    found = {}
    for unit in ("mm", "m", "in", "ft", "dm", "mil"):
        folder = tmp_path_factory.mktemp(unit)
        size = 0.01 / METRES[unit]
        path = step_files.box(folder / "a.step", unit=unit, size=size)
        result = polycube.mesh(path, *FAST, *PROBLEM, output_dir=folder / "out")
        found[unit] = result, (folder / "out" / "hex.inp").read_text()
    return found


@pytest.mark.slow
@pytest.mark.parametrize("unit", ["m", "in", "ft", "dm", "mil"])
def test_the_answer_and_the_deck_are_the_same_up_to_the_unit(runs, unit) -> None:
    (plain, deck), (result, own) = runs["mm"], runs[unit]
    factor = METRES[unit] / METRES["mm"]
    assert result.surface.unit == result.report["input"]["unit"] == unit
    assert result.report["problem"]["units"] == result.solution.units["length"] == unit
    # rounding decides in which of the orientations that a box allows its nodes are numbered
    away, node = cKDTree(factor * result.hexes.vertices).query(plain.hexes.vertices)
    assert away.max() < 0.01 and len(np.unique(node)) == len(result.hexes.vertices)
    solved, static = result.report["static"], plain.report["static"]
    assert factor * solved["max_displacement"] == pytest.approx(
        static["max_displacement"], rel=1e-4
    )
    for name in ("mass", "strain_energy"):
        assert getattr(result.solution, name) == pytest.approx(
            getattr(plain.solution, name), rel=1e-4
        )
    assert f"** length {unit}, force N, time s, mass " in own
    for keyword, columns, power in (
        ("ELASTIC", slice(0, 1), -2),
        ("DENSITY", slice(0, 1), -4),
        ("CLOAD", slice(2, 3), 0),
        ("DSLOAD", slice(2, 3), -2),
        ("DLOAD", slice(2, 3), 1),
    ):
        found, wanted = numbers(own, keyword, columns), numbers(deck, keyword, columns)
        assert len(found) == len(wanted)
        assert factor**power * found.sum() == pytest.approx(wanted.sum(), rel=1e-6)
    points = numbers(own, "NODE", slice(1, 4))
    np.testing.assert_allclose(points, result.hexes.vertices, rtol=1e-12, atol=1e-12)
