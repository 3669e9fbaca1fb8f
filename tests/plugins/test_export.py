"""Each format is read back by a reader that is not ours: points, node order, sets by name."""

import re
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.named_sets import boundary_sets
from polycube.hexmesh.quality import volume
from polycube.io.vtk import write_hex_vtu
from polycube.registry import build, names
from polycube.types import HexMesh
from tests.fixtures.hexmeshes import hex_box

ENDS = ("x_min", "x_max", "y_min", "y_max", "z_min", "z_max")
PLUGINS = [(name, {}) for name in names("export")] + [("gmsh", {"version": "4.1"})]


@pytest.fixture(scope="module")
def mesh() -> HexMesh:
    """Box of 4 x 3 x 3 with a hole along z, bent, in inches, far from the origin.

    Two cells along x; a face of a CAD model that is no whole patch.
    """
    plain = hex_box((4, 3, 3), (4.0, 3.0, 3.0))
    middle = plain.vertices[plain.hexes].mean(axis=1)
    kept = ~((np.abs(middle[:, :2] - [1.5, 1.5]) < 0.1).all(axis=1))
    used, hexes = np.unique(plain.hexes[kept], return_inverse=True)
    plain = hex_mesh(plain.vertices[used], hexes.reshape(-1, 8))
    corners = plain.vertices[plain.quads]
    axis = (np.ptp(corners, axis=1) == 0).argmax(axis=1)
    level = corners[np.arange(len(corners)), 0, axis].astype(int)
    _, patch = np.unique(10 * axis + level, return_inverse=True)
    points = (plain.vertices + 0.05 * np.sin(plain.vertices[:, ::-1])) / 25.4 + 1000.1
    cell = (middle[kept][:, 0] > 2).astype(int)
    made = hex_mesh(points, plain.hexes, plain.quads, patch, cell)
    sets = boundary_sets(made)
    assert [name for name in sets if "patch" not in name] == [*ENDS, "hole_1"]
    sets["cad_face_1"] = np.array([0, 3, 5])
    return replace(made, primitives=("hole_z", "cube"), sets=sets)


def export(mesh: HexMesh, folder: Path, name: str, **options: object) -> Path:
    return build("export", {"plugin": name, **options})(mesh, folder / "hex")


def read(path: Path) -> object:
    meshio = pytest.importorskip("meshio")
    return meshio.read(path)


def corners(quads: np.ndarray) -> list[list[int]]:
    return sorted(np.sort(quads, axis=1).tolist())


def nodes_of(mesh: HexMesh, name: str) -> list[int]:
    return np.unique(mesh.quads[mesh.sets[name]]).tolist()


def volume_of(points: np.ndarray, hexes: np.ndarray) -> float:
    """By the divergence theorem on the reader's own cells."""
    return volume(hex_mesh(points - points.mean(axis=0), hexes))


@pytest.mark.parametrize(("name", "options"), PLUGINS)
def test_equal_meshes_give_equal_bytes(name, options, mesh, tmp_path):
    plugin = build("export", {"plugin": name, **options})
    assert plugin(mesh, tmp_path / "a").read_bytes() == plugin(mesh, tmp_path / "b").read_bytes()
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize("name", ["vtk", "abaqus", "gmsh", "medit"])
def test_points_and_node_order_come_back(name, mesh, tmp_path):
    path = export(mesh, tmp_path, name)
    assert path.parent == tmp_path and path.stem == "hex"
    found = read(path)
    np.testing.assert_array_equal(found.points, mesh.vertices)
    np.testing.assert_array_equal(found.cells_dict["hexahedron"], mesh.hexes)


# VTK


@pytest.mark.parametrize("suffix", ["vtk", "vtu"])
def test_vtk_reads_data_and_sets(suffix, mesh, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    path = (
        export(mesh, tmp_path, "vtk")
        if suffix == "vtk"
        else write_hex_vtu(tmp_path / "hex.vtu", mesh, mesh.primitives)
    )
    grid = pyvista.read(path)
    np.testing.assert_array_equal(grid.points, mesh.vertices)
    np.testing.assert_array_equal(grid.cell_data["cell"], mesh.cell)
    np.testing.assert_array_equal(grid.cell_data["primitive"], 1 - mesh.cell)
    verdict = grid.cell_quality(["scaled_jacobian"]).cell_data["scaled_jacobian"]
    np.testing.assert_allclose(grid.cell_data["scaled_jacobian"], verdict, atol=1e-12)
    assert grid.compute_cell_sizes()["Volume"].min() > 0
    #: VTK's numbers of the faces of a hexahedron, by vtkHexahedron.h
    faces = [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]]
    for name in (*ENDS, "hole_1", "cad_face_1"):
        assert np.flatnonzero(grid.point_data[name]).tolist() == nodes_of(mesh, name)
        on = [
            mesh.hexes[grid.cell_data[name] >> k & 1 == 1][:, face] for k, face in enumerate(faces)
        ]
        assert corners(np.concatenate(on)) == corners(mesh.quads[mesh.sets[name]])
    assert "patch_0" not in grid.array_names


# Exodus


def test_vtk_reads_exodus(mesh, tmp_path):
    pytest.importorskip("vtkmodules")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOExodus import vtkExodusIIReader

    reader = vtkExodusIIReader()
    reader.SetFileName(str(export(mesh, tmp_path, "exodus")))
    reader.UpdateInformation()
    kinds = (reader.ELEM_BLOCK, reader.SIDE_SET, reader.NODE_SET)
    for kind in kinds:
        for k in range(reader.GetNumberOfObjects(kind)):
            reader.SetObjectStatus(kind, k, 1)
    reader.SetGenerateGlobalElementIdArray(1)
    reader.SetGenerateGlobalNodeIdArray(1)
    reader.Update()
    output = reader.GetOutput()
    filled = [output.GetBlock(i) for i in range(output.GetNumberOfBlocks())]
    blocks, sides, nodes = [b for b in filled if b is not None and b.GetNumberOfBlocks()]
    names_of = [
        [reader.GetObjectName(k, i) for i in range(reader.GetNumberOfObjects(k))] for k in kinds
    ]
    assert names_of == [["cell_0_hole_z", "cell_1_cube"], list(mesh.sets), list(mesh.sets)]

    def grid(of, k):
        """Points, cells as numbers of the points in the mesh."""
        piece = of.GetBlock(k)
        number = vtk_to_numpy(piece.GetPointData().GetArray("GlobalNodeId")) - 1
        points = vtk_to_numpy(piece.GetPoints().GetData())
        np.testing.assert_array_equal(points, mesh.vertices[number].astype(np.float32))  # VTK's
        return piece, number[vtk_to_numpy(piece.GetCells().GetConnectivityArray())]

    for k in range(2):
        piece, cells = grid(blocks, k)
        own = vtk_to_numpy(piece.GetCellData().GetArray("GlobalElementId")) - 1
        np.testing.assert_array_equal(cells.reshape(-1, 8), mesh.hexes[own])
        assert own.tolist() == np.flatnonzero(mesh.cell == k).tolist()
    for k, (name, quads) in enumerate(mesh.sets.items()):
        faces = grid(sides, k)[1].reshape(-1, 4)
        assert corners(faces) == corners(mesh.quads[quads]), name
        assert np.unique(grid(nodes, k)[1]).tolist() == nodes_of(mesh, name)


def test_exodus_sides_look_outwards(mesh, tmp_path):
    """Sides by the manual of Exodus II, table of HEX: 1265 2376 3487 1584 1432 5678 (corners)."""
    from scipy.io import netcdf_file

    manual = (
        np.array([list(map(int, side)) for side in "1265 2376 3487 1584 1432 5678".split()]) - 1
    )
    with netcdf_file(export(mesh, tmp_path, "exodus"), mmap=False) as file:
        hexes = np.concatenate([file.variables[f"connect{k}"][:] for k in (1, 2)]) - 1
        for k, quads in enumerate(mesh.sets.values(), start=1):
            element, side = (file.variables[f"{what}_ss{k}"][:] - 1 for what in ("elem", "side"))
            found = hexes[element[:, None], manual[side]]
            turned = [np.roll(row, -row.argmin()).tolist() for row in found]
            given = [np.roll(row, -row.argmin()).tolist() for row in mesh.quads[quads]]
            assert sorted(turned) == sorted(given)
        points = np.stack([file.variables[f"coord{axis}"][:] for axis in "xyz"], axis=1)
        np.testing.assert_array_equal(points, mesh.vertices)


# Gmsh


GMSH = """
import json, sys, gmsh
gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
gmsh.open(sys.argv[1])
tags, points, _ = gmsh.model.mesh.getNodes()
kinds, numbers, nodes = gmsh.model.mesh.getElements()
hexes = dict(zip(kinds, nodes))[5]
least = gmsh.model.mesh.getElementQualities(dict(zip(kinds, numbers))[5], "minDetJac")
groups = {}
for dimension, tag in gmsh.model.getPhysicalGroups():
    own = []
    for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag):
        for n in gmsh.model.mesh.getElements(dimension, entity)[2]:
            own += n.tolist()
    groups[gmsh.model.getPhysicalName(dimension, tag)] = own
json.dump([tags.tolist(), points.tolist(), hexes.tolist(), min(least), groups], sys.stdout)
"""


@pytest.mark.parametrize(
    ("name", "options"),
    [("gmsh", {}), ("gmsh", {"version": "4.1"}), ("medit", {}), ("nastran", {}), ("vtk", {})],
)
def test_gmsh_reads_it(name, options, mesh, tmp_path):
    pytest.importorskip("meshio")
    import json

    path = export(mesh, tmp_path, name, **options)
    done = subprocess.run([sys.executable, "-c", GMSH, str(path)], capture_output=True, text=True)
    if "ImportError" in done.stderr or "OSError" in done.stderr:
        pytest.skip("gmsh does not load")
    assert done.returncode == 0, done.stderr
    tags, points, hexes, least, groups = json.loads(done.stdout)
    points = np.reshape(points, (-1, 3))[np.argsort(tags)]
    np.testing.assert_allclose(points, mesh.vertices, rtol=1e-9 if name == "nastran" else 0)
    found = np.reshape(hexes, (-1, 8)) - 1
    assert sorted(found.tolist()) == sorted(mesh.hexes.tolist())
    assert least > 0
    cells = {f"cell_{k}_{what}": mesh.cell == k for k, what in enumerate(mesh.primitives)}
    if name == "gmsh":
        for group, own in cells.items():
            assert corners(np.reshape(groups[group], (-1, 8)) - 1) == corners(mesh.hexes[own])
    if options:
        assert set(groups) == {*mesh.sets, *cells, "primitive_hole_z", "primitive_cube"}
        for group, quads in mesh.sets.items():
            assert corners(np.reshape(groups[group], (-1, 4)) - 1) == corners(mesh.quads[quads])
    elif name == "gmsh":
        assert set(groups) == {*ENDS, "hole_1", *cells}  # a quad is in the first of its sets
        for group in (*ENDS, "hole_1"):
            quads = mesh.quads[mesh.sets[group]]
            assert corners(np.reshape(groups[group], (-1, 4)) - 1) == corners(quads)


def test_meshio_reads_the_groups_of_gmsh(mesh, tmp_path):
    found = read(export(mesh, tmp_path, "gmsh"))
    tags = found.cell_data_dict["gmsh:physical"]
    np.testing.assert_array_equal(tags["hexahedron"], mesh.cell + 1)
    np.testing.assert_array_equal(found.cells_dict["quad"], mesh.quads)
    named = {name: tuple(value) for name, value in found.field_data.items()}
    assert named["cell_1_cube"] == (2, 3)
    for name in (*ENDS, "hole_1"):
        tag, dimension = named[name]
        assert dimension == 2
        assert np.flatnonzero(tags["quad"] == tag).tolist() == sorted(mesh.sets[name])


def test_a_version_of_gmsh_that_is_not_written_is_refused():
    with pytest.raises(ValueError, match=r"version must be 2\.2 or 4\.1; got '3'"):
        build("export", {"plugin": "gmsh", "version": "3"})


# Medit


def test_medit_references_and_their_legend(mesh, tmp_path):
    path = export(mesh, tmp_path, "medit")
    found = read(path)
    references = found.cell_data_dict["medit:ref"]
    np.testing.assert_array_equal(references["hexahedron"], mesh.cell)
    np.testing.assert_array_equal(references["quad"], mesh.patch)
    np.testing.assert_array_equal(found.cells_dict["quad"], mesh.quads)
    legend = path.read_text().split("End\n")[1]
    for name, quads in mesh.sets.items():
        what, *own = re.search(rf"# {name}: quadrilaterals with (.*)\n", legend)[1].split()
        chosen = references["quad"] if what == "references" else 1 + np.arange(len(mesh.quads))
        assert np.flatnonzero(np.isin(chosen, np.array(own, int))).tolist() == sorted(quads)
    assert "# cell_1_cube: hexahedra with reference 1\n" in legend


# Abaqus


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
    with pytest.raises(ValueError, match="C3D8 or a variant of it; got 'C3D4'"):
        build("export", {"plugin": "abaqus", "element": "C3D4"})


# Nastran and LS-DYNA: columns


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


def test_a_mesh_without_names_has_those_of_its_geometry(mesh, tmp_path):
    plain = replace(mesh, primitives=(), sets={})
    found = read(export(plain, tmp_path, "abaqus"))
    assert {*ENDS, "hole_1", "patch_0"} <= set(found.point_sets)
    assert set(found.cell_sets) == {"all", "cell_0", "cell_1"}
    for name in set(names("export")) - {"abaqus"}:
        assert export(plain, tmp_path, name).stat().st_size > 0
