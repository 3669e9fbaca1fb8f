"""Nastran bulk data, read by columns."""

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.hexmesh.named_sets import boundary_sets
from polycube.registry import build, provide
from tests.fixtures.exports import cards_of, corners, export, nodes_of, read, volume_of
from tests.fixtures.hexmeshes import hex_box


def test_nastran_to_ten_digits(mesh, tmp_path):
    found = read(export(mesh, tmp_path, "nastran"))
    np.testing.assert_allclose(found.points, mesh.vertices, rtol=1e-9)
    np.testing.assert_array_equal(found.cells_dict["hexahedron"], mesh.hexes)
    np.testing.assert_array_equal(found.cell_data["nastran:ref"][0], mesh.cell + 1)
    assert volume_of(found.points, found.cells_dict["hexahedron"]) == pytest.approx(
        volume_of(mesh.vertices, mesh.hexes), rel=1e-5
    )


def test_nastran_sets_and_faces(mesh, tmp_path):
    """By the quick reference: PLOAD4 has G1 and its opposite."""
    pairs = cards_of(export(mesh, tmp_path, "nastran").read_text())
    names_of, cards = zip(*pairs, strict=True)
    sets = {
        (name, len(mesh.sets) < int(card[1])): [int(n) - 1 for n in card[2:] if n]
        for name, card in zip(names_of, cards, strict=True)
        if card[0] == "SET1"
    }
    for name in mesh.sets:
        assert sets[name, False] == nodes_of(mesh, name)
    for cell, name in enumerate(mesh.primitives):
        assert sets[f"primitive_{name}", True] == np.flatnonzero(mesh.cell == cell).tolist()
    hexes = {c[1]: [int(n) - 1 for n in c[3:] if n] for c in cards if c[0] == "CHEXA"}
    # faces by the quick reference, G1 to G8
    faces = [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    pressed: dict[str, list] = {}
    for name, card in zip(names_of, cards, strict=True):
        if card[0] == "PLOAD4":
            assert float(card[3]) == 1
            ends = {int(card[7]) - 1, int(card[8]) - 1}
            [face] = [f for f in faces if ends <= {hexes[card[2]][k] for k in f}]
            pressed.setdefault(name, []).append([hexes[card[2]][k] for k in face])
            diagonal = {hexes[card[2]].index(n) for n in ends}
            assert diagonal in ({face[0], face[2]}, {face[1], face[3]})
    for name, quads in mesh.sets.items():
        assert corners(np.array(pressed[name])) == corners(mesh.quads[quads])


BOX = hex_box((4, 2, 2), (4.0, 2.0, 2.0))
PULL = {
    "plugin": "static",
    "units": "mm",
    "fixed": ["x_min", {"at": "y_min", "components": ["y"], "value": 0.5}],
    "loads": [{"at": "x_max", "force": [8, 0, 0]}, {"at": "z_max", "pressure": 2e6}],
    "gravity": [0, 0, -9.81],
}


def deck(folder, analysis, **options):
    plugin = build("export", {"plugin": "nastran", **options})
    text = provide(plugin, problem=build("analysis", analysis).problem)(
        BOX, folder / "hex"
    ).read_text()
    return text, [card for _, card in cards_of(text.partition("BEGIN BULK\n")[2])]


def test_a_static_problem_is_complete(tmp_path):
    """Millimetres, newtons, tonnes; 8 N on four squares; 2 MPa on eight squares."""
    text, cards = deck(tmp_path, PULL)
    own = {card[0]: card for card in cards}
    assert [float(x) for x in own["MAT1"][2:] if x] == pytest.approx([210000, 0.3, 7.85e-9])
    assert own["MAT1"][3] == ""  # the shear modulus follows from the others
    assert "$ length mm, force N, time s, mass t, stress MPa\n" in text
    assert "SOL 101\nCEND\n" in text and "SPC = 1\nLOAD = 10\n" in text
    assert own["LOAD"][1:7] == ["10", "1.", "1.", "8", "1.", "9"]
    assert own["GRAV"][1:4] == ["9", "0", "1."]
    assert [float(x) for x in own["GRAV"][4:7]] == pytest.approx([0, 0, -9810])
    forces = np.array([card[5:8] for card in cards if card[0] == "FORCE"], float)
    assert forces.sum(axis=0) == pytest.approx([8, 0, 0]) and len(forces) == 9
    pressed = [card for card in cards if card[0] == "PLOAD4" and card[1] == "8"]
    assert len(pressed) == 8 and {float(card[3]) for card in pressed} == {2.0}
    fixed = {(int(card[2]), int(card[3])): float(card[4]) for card in cards if card[0] == "SPC"}
    at_x, at_y = (np.unique(BOX.quads[boundary_sets(BOX)[name]]) + 1 for name in ("x_min", "y_min"))
    wanted = {(n, c): 0.0 for n in at_x.tolist() for c in (1, 2, 3)}
    assert fixed == wanted | {(n, 2): 0.5 for n in at_y.tolist()}
    assert {card[2] for card in cards if card[0] == "PSOLID"} == {own["MAT1"][1]}


def test_modes_and_conduction(tmp_path):
    text, cards = deck(tmp_path, {"plugin": "modal", "modes": 7})
    assert text.startswith("SOL 103\nCEND\nMETHOD = 1\n") and "SPC = " not in text
    [eigrl] = [card for card in cards if card[0] == "EIGRL"]
    assert (eigrl[1], eigrl[4]) == ("1", "7")
    heat = {"plugin": "poisson", "units": "m", "flux": [{"at": "x_max", "value": 9}], "source": 5.0}
    text, cards = deck(tmp_path, heat)
    own = {card[0]: card for card in cards}
    assert text.startswith("SOL 153\nCEND\nANALYSIS = HEAT\n")
    assert float(own["MAT4"][2]) == 50 and float(own["QVOL"][2]) == 5
    faces = [[int(n) - 1 for n in card[5:9]] for card in cards if card[0] == "QHBDY"]
    assert corners(np.array(faces)) == corners(BOX.quads[boundary_sets(BOX)["x_max"]])
    assert own["QHBDY"][2] == "AREA4" and float(own["QHBDY"][3]) == 9


def test_without_a_step_there_is_only_the_mesh(tmp_path):
    _, cards = deck(tmp_path, PULL, step=False)
    assert {card[0] for card in cards} == {"PSOLID", "GRID", "CHEXA", "SET1", "PLOAD4", "ENDDATA"}
    assert build("export", {"plugin": "nastran", "step": False}).places == []


def test_a_place_that_does_not_exist_is_refused(tmp_path):
    with pytest.raises(InputError, match="no boundary set 'hole_1'"):
        deck(tmp_path, {"plugin": "modal", "fixed": ["hole_1"]})
    assert not list(tmp_path.iterdir())
