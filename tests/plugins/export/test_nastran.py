"""Nastran bulk data, read by columns."""

from itertools import pairwise

import numpy as np
import pytest

from tests.fixtures.exports import corners, export, nodes_of, read, volume_of


def fields(line: str, *widths: int) -> list[str]:
    ends = np.cumsum((0, *widths))
    return [line[a:b].strip() for a, b in pairwise(ends)]


def test_nastran_to_ten_digits(mesh, tmp_path):
    found = read(export(mesh, tmp_path, "nastran"))
    np.testing.assert_allclose(found.points, mesh.vertices, rtol=1e-9)
    np.testing.assert_array_equal(found.cells_dict["hexahedron"], mesh.hexes)
    np.testing.assert_array_equal(found.cell_data["nastran:ref"][0], mesh.cell + 1)
    assert volume_of(found.points, found.cells_dict["hexahedron"]) == pytest.approx(
        volume_of(mesh.vertices, mesh.hexes), rel=1e-5
    )


def test_nastran_sets_and_faces(mesh, tmp_path):
    """By the quick reference: fields of eight, `+` continues; PLOAD4 has G1 and its opposite."""
    cards, said, names_of = [], "", []
    for line in export(mesh, tmp_path, "nastran").read_text().splitlines():
        if line.startswith("$"):
            said = line.rpartition(": ")[2]
        elif line.startswith("+"):
            cards[-1] += fields(line, *9 * [8])[1:]
        else:
            cards.append(fields(line, *9 * [8]))
            names_of.append(said)
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
            assert card[3] == "1."
            ends = {int(card[7]) - 1, int(card[8]) - 1}
            [face] = [f for f in faces if ends <= {hexes[card[2]][k] for k in f}]
            pressed.setdefault(name, []).append([hexes[card[2]][k] for k in face])
            diagonal = {hexes[card[2]].index(n) for n in ends}
            assert diagonal in ({face[0], face[2]}, {face[1], face[3]})
    for name, quads in mesh.sets.items():
        assert corners(np.array(pressed[name])) == corners(mesh.quads[quads])
