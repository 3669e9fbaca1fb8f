"""Each format is read back by a reader that is not ours: points, node order, groups."""

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from polycube.geometry.hexes import hex_mesh
from polycube.registry import build, names
from polycube.types import HexMesh

CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
)


@pytest.fixture(scope="module")
def mesh() -> HexMesh:
    """3 x 2 x 2 hexes in inches, far from the origin; a patch per side, two cells along x."""
    number = np.arange(36).reshape(4, 3, 3)
    boxes = np.argwhere(np.ones((3, 2, 2)))
    hexes = number[tuple((boxes[:, None] + CORNERS).transpose(2, 0, 1))]
    grid = np.argwhere(number >= 0).astype(float)
    plain = hex_mesh(grid, hexes)
    side = grid[plain.quads]
    flat = np.ptp(side, axis=1) == 0
    axis = flat.argmax(1)
    high = side[np.arange(len(side)), 0, axis] > 0
    points = (grid + 0.1 * np.sin(grid[:, ::-1])) / 25.4 + 1000.1
    return hex_mesh(points, hexes, plain.quads, 2 * axis + 1 - high, (boxes[:, 0] > 0).astype(int))


def read(path: Path) -> object:
    meshio = pytest.importorskip("meshio")
    return meshio.read(path)


@pytest.mark.parametrize("name", ["vtk", "abaqus", "gmsh", "medit"])
def test_points_and_node_order_come_back(name: str, mesh: HexMesh, tmp_path: Path) -> None:
    path = build("export", {"plugin": name})(mesh, tmp_path / "hex")
    assert path.parent == tmp_path and path.stem == "hex"
    found = read(path)
    np.testing.assert_array_equal(found.points, mesh.vertices)
    np.testing.assert_array_equal(found.cells_dict["hexahedron"], mesh.hexes)


@pytest.mark.parametrize("name", names("export"))
def test_equal_meshes_give_equal_bytes(name: str, mesh: HexMesh, tmp_path: Path) -> None:
    plugin = build("export", {"plugin": name})
    assert plugin(mesh, tmp_path / "a").read_bytes() == plugin(mesh, tmp_path / "b").read_bytes()
    assert len(list(tmp_path.iterdir())) == 2


def test_vtk_reads_the_legacy_file_with_its_data(mesh: HexMesh, tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.read(build("export", {"plugin": "vtk"})(mesh, tmp_path / "hex"))
    np.testing.assert_array_equal(grid.cell_data["cell"], mesh.cell)
    verdict = grid.cell_quality(["scaled_jacobian"]).cell_data["scaled_jacobian"]
    np.testing.assert_allclose(grid.cell_data["scaled_jacobian"], verdict, atol=1e-12)


def test_gmsh_groups(mesh: HexMesh, tmp_path: Path) -> None:
    found = read(build("export", {"plugin": "gmsh"})(mesh, tmp_path / "hex"))
    tags = found.cell_data_dict["gmsh:physical"]
    np.testing.assert_array_equal(tags["hexahedron"], mesh.cell + 1)
    np.testing.assert_array_equal(tags["quad"], mesh.patch + 1)
    np.testing.assert_array_equal(found.cells_dict["quad"], mesh.quads)
    names_of_groups = {name: tuple(value) for name, value in found.field_data.items()}
    assert names_of_groups["patch_3"] == (4, 2) and names_of_groups["cell_1"] == (2, 3)


def test_medit_references(mesh: HexMesh, tmp_path: Path) -> None:
    found = read(build("export", {"plugin": "medit"})(mesh, tmp_path / "hex"))
    references = found.cell_data_dict["medit:ref"]
    np.testing.assert_array_equal(references["hexahedron"], mesh.cell)
    np.testing.assert_array_equal(references["quad"], mesh.patch)
    np.testing.assert_array_equal(found.cells_dict["quad"], mesh.quads)


def test_abaqus_sets(mesh: HexMesh, tmp_path: Path) -> None:
    path = build("export", {"plugin": "abaqus", "element": "C3D8R"})(mesh, tmp_path / "hex")
    assert "*ELEMENT, TYPE=C3D8R, ELSET=ALL" in path.read_text()
    found = read(build("export", {"plugin": "abaqus"})(mesh, tmp_path / "hex"))
    for patch in range(6):
        nodes = np.unique(mesh.quads[mesh.patch == patch])
        np.testing.assert_array_equal(np.sort(found.point_sets[f"PATCH_{patch}"]), nodes)
    (cells,) = found.cell_sets["CELL_1"]
    np.testing.assert_array_equal(np.sort(cells), np.flatnonzero(mesh.cell == 1))


def test_abaqus_surfaces_name_the_right_faces(mesh: HexMesh, tmp_path: Path) -> None:
    """Faces by the manual: S1 = 1234, S2 = 5876, S3 = 1562, S4 = 2673, S5 = 3784, S6 = 4851."""
    manual = ["1234", "5876", "1562", "2673", "3784", "4851"]
    text = build("export", {"plugin": "abaqus"})(mesh, tmp_path / "hex").read_text()
    for patch in range(6):
        block = text.split(f"NAME=PATCH_{patch}\n")[1].split("*")[0]
        found = [
            sorted(mesh.hexes[int(e) - 1][[int(n) - 1 for n in manual[int(s) - 1]]].tolist())
            for e, s in re.findall(r"(\d+), S(\d)\n", block)
        ]
        expected = [sorted(quad) for quad in mesh.quads[mesh.patch == patch].tolist()]
        assert sorted(found) == sorted(expected)


def test_no_line_of_an_abaqus_set_is_too_long(mesh: HexMesh, tmp_path: Path) -> None:
    text = build("export", {"plugin": "abaqus"})(mesh, tmp_path / "hex").read_text()
    assert max(line.count(",") for line in text.splitlines()) <= 15


def test_an_element_that_is_no_hexahedron_is_refused() -> None:
    with pytest.raises(ValueError, match="C3D8 or a variant of it; got 'C3D4'"):
        build("export", {"plugin": "abaqus", "element": "C3D4"})


def test_nastran_to_ten_digits(mesh: HexMesh, tmp_path: Path) -> None:
    found = read(build("export", {"plugin": "nastran"})(mesh, tmp_path / "hex"))
    np.testing.assert_allclose(found.points, mesh.vertices, rtol=1e-9)
    np.testing.assert_array_equal(found.cells_dict["hexahedron"], mesh.hexes)
    np.testing.assert_array_equal(found.cell_data["nastran:ref"][0], mesh.cell + 1)


def test_lsdyna_columns(mesh: HexMesh, tmp_path: Path) -> None:
    """Read by the widths of the manual: 8 for numbers, 16 for coordinates, 10 in a set."""
    text = build("export", {"plugin": "lsdyna"})(mesh, tmp_path / "hex").read_text()
    blocks = re.split(r"^\*(\w+)\n", text, flags=re.MULTILINE)
    found = list(zip(blocks[1::2], blocks[2::2], strict=True))

    def columns(block: str, *widths: int) -> np.ndarray:
        ends = np.cumsum((0, *widths))
        return np.array(
            [[float(line[a:b]) for a, b in pairwise(ends)] for line in block.splitlines()]
        )

    nodes = columns(dict(found)["NODE"], 8, 16, 16, 16)
    np.testing.assert_allclose(nodes[:, 1:], mesh.vertices, rtol=1e-9)
    elements = columns(dict(found)["ELEMENT_SOLID"], *10 * [8])
    np.testing.assert_array_equal(elements[:, 2:], mesh.hexes + 1)
    np.testing.assert_array_equal(elements[:, 1], mesh.cell + 1)
    sets = [block.split("\n", 1) for name, block in found if name == "SET_SEGMENT"]
    assert [int(number) for number, _ in sets] == [1, 2, 3, 4, 5, 6]
    quads = columns(sets[3][1], *4 * [10])
    np.testing.assert_array_equal(quads, mesh.quads[mesh.patch == 3] + 1)
    assert text.startswith("*KEYWORD\n") and text.endswith("*END\n")


@pytest.fixture(scope="module")
def named(mesh: HexMesh) -> HexMesh:
    return replace(mesh, primitives=("hole_z", "cube"))


def test_primitives_are_sets_names_or_comments(named: HexMesh, tmp_path: Path) -> None:
    made = {
        name: build("export", {"plugin": name})(named, tmp_path / "hex") for name in names("export")
    }
    found = read(made["abaqus"])
    for cell, name in enumerate(named.primitives):
        (own,) = found.cell_sets[f"PRIMITIVE_{name.upper()}"]
        np.testing.assert_array_equal(np.sort(own), np.flatnonzero(named.cell == cell))
    assert {"cell_0_hole_z", "cell_1_cube"} <= set(read(made["gmsh"]).field_data)
    assert "$ property 2: cell 1, cube\n" in made["nastran"].read_text()
    assert "$ part 1: cell 0, hole_z\n" in made["lsdyna"].read_text()
    np.testing.assert_array_equal(read(made["nastran"]).cell_data["nastran:ref"][0], named.cell + 1)
    assert made["vtk"].read_text().splitlines()[1].endswith("; primitive: 0 cube, 1 hole_z")
    vtk = read(made["vtk"])
    np.testing.assert_array_equal(vtk.cell_data["primitive"][0].ravel(), 1 - named.cell)
    np.testing.assert_array_equal(vtk.cell_data["cell"][0].ravel(), named.cell)
