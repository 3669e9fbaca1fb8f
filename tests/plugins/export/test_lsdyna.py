"""LS-DYNA keywords, read by columns."""

import re

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.hexmesh.named_sets import boundary_sets
from polycube.registry import build, provide
from tests.fixtures.exports import corners, export, fields, nodes_of
from tests.fixtures.hexmeshes import hex_box


def test_lsdyna_columns(mesh, tmp_path):
    """Read by the widths of the manual: 8 for numbers, 16 for coordinates, 10 in a set."""
    text = export(mesh, tmp_path, "lsdyna").read_text()
    blocks = re.split(r"^\*(\w+)\n", text, flags=re.MULTILINE)
    found = list(zip(blocks[1::2], blocks[2::2], strict=True))

    def columns(block: str, *widths: int) -> np.ndarray:
        return np.array([list(map(float, fields(line, *widths))) for line in block.splitlines()])

    nodes = columns(dict(found)["NODE"], 8, 16, 16, 16)
    np.testing.assert_allclose(nodes[:, 1:], mesh.vertices, rtol=1e-9)
    elements = columns(dict(found)["ELEMENT_SOLID"], *10 * [8])
    np.testing.assert_array_equal(elements[:, 2:], mesh.hexes + 1)
    np.testing.assert_array_equal(elements[:, 1], mesh.cell + 1)
    sets: dict[tuple[str, str], str] = {}
    for keyword, block in found:
        if keyword.startswith("SET_"):
            title, number, rows = block.split("\n", 2)
            assert len(number) == 10 and int(number) > 0
            sets[keyword, title] = rows
    for name, quads in mesh.sets.items():
        segments = columns(sets["SET_SEGMENT_TITLE", name], *4 * [10]) - 1
        np.testing.assert_array_equal(segments, mesh.quads[quads])
        own = [int(n) - 1 for n in sets["SET_NODE_LIST_TITLE", name].split()]
        assert own == nodes_of(mesh, name)
    for cell, name in enumerate(mesh.primitives):
        assert sets["SET_PART_LIST_TITLE", f"primitive_{name}"].split() == [str(cell + 1)]
        assert f"$ part {cell + 1}: cell_{cell}_{name}\n" in text
    assert text.startswith("*KEYWORD\n") and text.endswith("*END\n")
    assert max(map(len, text.splitlines())) <= 80


BOX = hex_box((4, 2, 2), (4.0, 2.0, 2.0))
PULL = {
    "plugin": "static",
    "units": "mm",
    "fixed": ["x_min", {"at": "y_min", "components": ["y"], "value": 0.5}],
    "loads": [
        {"at": "x_max", "force": [8, 0, 0]},
        {"at": {"plane": [0, 1, 0, 2]}, "pressure": 2e6},
    ],
    "gravity": [0, 0, -9.81],
}


def cards(folder, analysis, **options) -> list[tuple[str, list[str]]]:
    """Keywords and their lines, without comments."""
    plugin = build("export", {"plugin": "lsdyna", **options})
    path = provide(plugin, problem=build("analysis", analysis).problem)(BOX, folder / "hex")
    blocks = re.split(r"^\*(\w+)\n", path.read_text(), flags=re.MULTILINE)
    pairs = zip(blocks[1::2], blocks[2::2], strict=True)
    return [(word, [row for row in rows.splitlines() if row[0] != "$"]) for word, rows in pairs]


def of(found, word) -> list[list[float]]:
    """Numbers of all cards with a keyword."""
    own = (rows for name, rows in found if name == word)
    return [[float(x) for x in row.split(",")] for rows in own for row in rows]


def test_a_static_problem_is_complete(tmp_path) -> None:
    """A base acceleration is against the gravity that it stands for; 2 MPa on eight squares."""
    found = cards(tmp_path, PULL)
    assert dict(found)["PART"] == ["cell_0", "1,1,1"]
    assert of(found, "MAT_ELASTIC") == [[1, 7.85e-9, 210000, 0.3]]
    assert of(found, "SECTION_SOLID") == [[1, -1]]
    assert of(found, "DEFINE_CURVE") == [[1], [0, 0], [1, 1]]
    assert of(found, "CONTROL_TERMINATION") == of(found, "DATABASE_BINARY_D3PLOT") == [[1]]
    assert of(found, "CONTROL_IMPLICIT_GENERAL") == [[1, 1]]
    assert of(found, "CONTROL_IMPLICIT_SOLUTION") == [[1]]
    assert of(found, "LOAD_BODY_Z") == [[1, pytest.approx(9810)]]
    assert not {"LOAD_BODY_X", "LOAD_BODY_Y"} & dict(found).keys()
    at_x, at_y = (
        set(BOX.quads[boundary_sets(BOX)[n]].ravel().tolist()) for n in ("x_min", "y_min")
    )
    sets = {int(rows[1]): rows[2:] for word, rows in found if word == "SET_NODE_LIST_TITLE"}
    nodes = {k: {int(n) - 1 for row in rows for n in row.split()} for k, rows in sets.items()}
    held = [(nodes[row[0]], *np.flatnonzero(row[2:])) for row in of(found, "BOUNDARY_SPC_SET")]
    assert held == [(at_x, 0), (at_x - at_y, 1), (at_x, 2)]
    [moved] = of(found, "BOUNDARY_PRESCRIBED_MOTION_SET")
    assert nodes[moved[0]] == at_y and moved[1:] == [2, 2, 1, 0.5]
    [[pressed, curve, pressure]] = of(found, "LOAD_SEGMENT_SET")
    assert (curve, pressure) == (1, 2)
    segments = {int(rows[1]): rows[2:] for word, rows in found if word == "SET_SEGMENT_TITLE"}
    own = np.array([row.split() for row in segments[int(pressed)]], int) - 1
    assert corners(own) == corners(BOX.quads[boundary_sets(BOX)["y_max"]])
    a, b, c = (BOX.vertices[own[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 1] > 0).all()  # a pressure acts against the normal
    forces = np.array(of(found, "LOAD_NODE_POINT"))
    end = BOX.vertices[forces[:, 0].astype(int) - 1]
    assert (end[:, 0] == 4).all() and (forces[:, 1:3] == 1).all() and len(forces) == 9
    assert forces[:, 3].sum() == 8 and forces[:, 3] @ end[:, 1:] == pytest.approx([8, 8])


def test_modes(tmp_path) -> None:
    for mass in ("lumped", "consistent"):
        found = cards(tmp_path, {"plugin": "modal", "modes": 7, "mass": mass})
        assert of(found, "CONTROL_IMPLICIT_EIGENVALUE") == [[7]]
        assert ("CONTROL_IMPLICIT_CONSISTENT_MASS" in dict(found)) == (mass == "consistent")
        assert not {"CONTROL_IMPLICIT_SOLUTION", "LOAD_BODY_Z"} & dict(found).keys()


@pytest.mark.parametrize(
    ("analysis", "options"), [(PULL, {"step": False}), ({"plugin": "poisson"}, {})]
)
def test_without_a_step_and_for_heat_there_is_only_the_mesh(tmp_path, analysis, options) -> None:
    words = {word for word, _ in cards(tmp_path, analysis, **options)}
    sets = {"SET_NODE_LIST_TITLE", "SET_SEGMENT_TITLE"}
    assert words == {"KEYWORD", "NODE", "ELEMENT_SOLID", "END", *sets}


def test_a_place_that_does_not_exist_is_refused(tmp_path) -> None:
    with pytest.raises(InputError, match="no boundary set 'hole_1'"):
        cards(tmp_path, {"plugin": "modal", "fixed": ["hole_1"]})
    assert not list(tmp_path.iterdir())
