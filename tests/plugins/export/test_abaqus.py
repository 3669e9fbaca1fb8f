"""Abaqus: sets, surfaces, element types."""

import re

import numpy as np
import pytest

from polycube.registry import build
from polycube.spline.second_order import hex_elements
from tests.fixtures.exports import corners, export, nodes_of, read


def test_meshio_reads_the_sets_of_abaqus(mesh, tmp_path):
    found = read(export(mesh, tmp_path, "abaqus"))
    for name in mesh.sets:
        assert np.sort(found.point_sets[name]).tolist() == nodes_of(mesh, name)
    for cell, name in enumerate(mesh.primitives):
        for group in (f"cell_{cell}_{name}", f"primitive_{name}"):
            (own,) = found.cell_sets[group]
            np.testing.assert_array_equal(np.sort(own), np.flatnonzero(mesh.cell == cell))


def test_abaqus_surfaces_name_the_right_faces(mesh, tmp_path):
    """Faces by the manual: S1 = 1234, S2 = 5876, S3 = 1562, S4 = 2673, S5 = 3784, S6 = 4851."""
    manual = ["1234", "5876", "1562", "2673", "3784", "4851"]
    text = export(mesh, tmp_path, "abaqus").read_text()
    for name, quads in mesh.sets.items():
        block = text.split(f"*SURFACE, TYPE=ELEMENT, NAME={name}\n")[1].split("*")[0]
        found = [
            mesh.hexes[int(e) - 1][[int(n) - 1 for n in manual[int(s) - 1]]]
            for e, s in re.findall(r"(\d+), S(\d)\n", block)
        ]
        assert corners(np.array(found)) == corners(mesh.quads[quads])


def test_abaqus_element_type_and_length_of_lines(mesh, tmp_path):
    text = export(mesh, tmp_path, "abaqus", element="C3D8R").read_text()
    assert "*ELEMENT, TYPE=C3D8R, ELSET=all" in text
    assert max(line.count(",") for line in text.splitlines()) <= 15
    with pytest.raises(ValueError, match=r"one of C3D8, C3D8H, C3D8I, .*C3D20R, .*got 'C3D10'"):
        build("export", {"plugin": "abaqus", "element": "C3D10"})


def test_meshio_reads_hexes_of_20_nodes_and_their_sets(mesh, tmp_path):
    path = export(mesh, tmp_path, "abaqus", element="C3D20R")
    assert max(line.count(",") for line in path.read_text().splitlines()) <= 15
    found, own = read(path), hex_elements(mesh, None, 20)
    np.testing.assert_array_equal(found.points, own.points)
    np.testing.assert_array_equal(found.cells_dict["hexahedron20"], own.hexes)
    for name, quads in mesh.sets.items():
        expected = np.unique(own.quads[quads]).tolist()
        assert np.sort(found.point_sets[name]).tolist() == expected
