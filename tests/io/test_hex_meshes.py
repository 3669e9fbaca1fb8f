"""Hex meshes of other programs: read as they are, renumbered where needed, else one sentence."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.errors import InputError
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.quality import deviation, volume
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.io.hex_meshes import (
    BY_AXES,
    FORMATS,
    MIRRORED,
    boundary,
    check_place,
    patches,
    read_hexes,
    tidy,
)
from polycube.io.vtk import write_hex_vtu
from polycube.registry import build
from polycube.surface.measures import genus
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder
from tests.fixtures.surfaces import box

meshio = pytest.importorskip("meshio")
TURNED = np.array([0, 4, 5, 1, 3, 7, 6, 2])  # the same hex with zeta, xi, eta as its axes


def write(path: Path, points, cells) -> Path:
    meshio.write_points_cells(path, points, cells)
    return path


def cells_of(mesh) -> np.ndarray:
    return np.zeros(len(mesh.hexes), np.int64)


@pytest.mark.parametrize("suffix", FORMATS[:-2])  # meshio does not write these points as Nastran
def test_every_format_is_read_with_its_coordinates(suffix, tmp_path):
    mesh = hex_cylinder()
    points = 25.4 * mesh.vertices + [1e3, 0, -7]
    cells = [("quad", mesh.quads[:5]), ("hexahedron", mesh.hexes)]
    if suffix == ".inp":
        cells = cells[1:]
    found, notes = read_hexes(write(tmp_path / f"part{suffix}", points, cells))
    assert notes == []
    np.testing.assert_array_equal(found.hexes, mesh.hexes)
    np.testing.assert_allclose(found.vertices, points, rtol=1e-14)
    assert set(map(tuple, np.sort(found.quads, 1))) == set(map(tuple, np.sort(mesh.quads, 1)))


def test_our_own_file_keeps_its_grid_cells(tmp_path):
    mesh = hex_box((4, 2, 2))
    mesh = hex_mesh(mesh.vertices, mesh.hexes, cell=np.arange(16) // 8)
    found, _ = read_hexes(write_hex_vtu(tmp_path / "hex.vtu", mesh, ("cube", "hole_z")))
    np.testing.assert_array_equal(found.cell, mesh.cell)


def test_patches_end_at_sharp_edges_only():
    cube, rod, ball = hex_box((3, 3, 3)), hex_cylinder(4, 4), hex_ball(4)
    assert len(np.unique(patches(cube))) == 6
    assert np.bincount(patches(cube)).tolist() == [9] * 6
    flat = np.ptp(rod.vertices[rod.quads][:, :, 2], axis=1) == 0
    end = rod.vertices[rod.quads][:, 0, 2] > 0.5
    found = [np.unique(patches(rod)[on]) for on in (flat & end, flat & ~end, ~flat)]
    assert sorted(np.concatenate(found)) == [0, 1, 2]
    assert (patches(ball) == 0).all()
    assert len(np.unique(patches(cube, np.radians(91)))) == 1


@pytest.mark.parametrize("order", [MIRRORED, BY_AXES, np.array(BY_AXES)[MIRRORED]])
def test_another_vertex_order_is_converted_with_a_note(order):
    mesh = hex_cylinder()
    found, notes = tidy(mesh.vertices, mesh.hexes[:, order], cells_of(mesh))
    assert "renumbered" in "; ".join(notes)
    assert scaled_jacobian(found.vertices, found.hexes).min() == pytest.approx(
        scaled_jacobian(mesh.vertices, mesh.hexes).min()
    )
    assert volume(found) == pytest.approx(volume(mesh))


def test_single_mirrored_hexes_are_found_by_their_neighbours():
    mesh = hex_cylinder()
    some = np.random.default_rng(0).random(len(mesh.hexes)) < 0.3
    mixed = np.where(some[:, None], mesh.hexes[:, MIRRORED], mesh.hexes)
    found, notes = tidy(mesh.vertices, mixed, cells_of(mesh))
    assert notes == [f"renumbered mirrored hexes: {some.sum()}"]
    assert (scaled_jacobian(found.vertices, found.hexes) > 0).all()


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0, 1))
def test_no_order_of_vertices_hexes_and_corners_changes_the_mesh(seed, mirrored):
    """Vertices and hexes shuffled, every hex turned, some mirrored, and the mesh rotated."""
    mesh, rng = hex_cylinder(3), np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    order = rng.permutation(len(mesh.vertices))
    hexes = np.argsort(order)[mesh.hexes][rng.permutation(len(mesh.hexes))]
    for row in hexes:
        for _ in range(rng.integers(3)):
            row[:] = row[TURNED]
        row[:] = np.roll(row.reshape(2, 4), rng.integers(4), axis=1).ravel()
        if rng.random() < mirrored:
            row[:] = row[MIRRORED]
    vertices = mesh.vertices[order] @ turn.T + rng.normal(size=3)
    found, _ = tidy(vertices, hexes, cells_of(mesh))
    assert volume(found) == pytest.approx(volume(mesh))
    np.testing.assert_allclose(
        np.sort(scaled_jacobian(found.vertices, found.hexes)),
        np.sort(scaled_jacobian(mesh.vertices, mesh.hexes)),
        atol=1e-9,
    )
    assert sorted(np.bincount(found.patch)) == sorted(np.bincount(patches(mesh)))


def test_a_folded_hex_is_left_as_it_is():
    """Inverted by its vertices, not by its numbering: to be untangled, not mirrored."""
    mesh = hex_box((3, 3, 3))
    vertices = mesh.vertices.copy()
    inner = np.setdiff1d(np.arange(64), mesh.quads)[0]
    vertices[inner] += 0.6
    assert scaled_jacobian(vertices, mesh.hexes).min() < 0
    found, notes = tidy(vertices, mesh.hexes, cells_of(mesh))
    assert notes == []
    np.testing.assert_array_equal(found.hexes, mesh.hexes)


def test_removed_vertices_and_hexes_are_listed():
    mesh = hex_box((2, 2, 2))
    soup = mesh.vertices[mesh.hexes].reshape(-1, 3)
    vertices = np.vstack([soup, [[9.0, 9, 9]]])
    hexes = np.arange(64).reshape(8, 8)
    found, notes = tidy(vertices, np.vstack([hexes, hexes[:1]]), np.zeros(9, np.int64))
    assert len(found.vertices) == 27 and len(found.hexes) == 8 == len(found.cell)
    assert notes == [
        "removed vertices that no hex uses: 1",
        "welded vertices at the same place: 37",
        "removed duplicate hexes: 1",
    ]


def hanging() -> tuple[np.ndarray, np.ndarray]:
    """A cube next to four small ones."""
    big, small = hex_box((1, 1, 1)), hex_box((1, 2, 2), (0.5, 1, 1))
    moved = small.vertices + np.array([1, 0, 0])
    return np.vstack([big.vertices, moved]), np.vstack([big.hexes, small.hexes + 8])


def collapsed() -> tuple[np.ndarray, np.ndarray]:
    mesh = hex_box()
    hexes = mesh.hexes.copy()
    hexes[3, 1] = hexes[3, 0]
    return mesh.vertices, hexes


def two_pieces() -> tuple[np.ndarray, np.ndarray]:
    mesh = hex_box()
    return np.vstack([mesh.vertices, mesh.vertices + 5]), np.vstack([mesh.hexes, mesh.hexes + 27])


def hollow() -> tuple[np.ndarray, np.ndarray]:
    mesh = hex_box((3, 3, 3))
    return mesh.vertices, np.delete(mesh.hexes, 13, axis=0)


def edge_contact() -> tuple[np.ndarray, np.ndarray]:
    mesh = hex_box((2, 2, 2))
    return mesh.vertices, mesh.hexes[[0, 1, 2, 5, 6, 7][:5]]


def not_a_number() -> tuple[np.ndarray, np.ndarray]:
    mesh = hex_box()
    return np.where(mesh.vertices == 0.5, np.nan, mesh.vertices), mesh.hexes


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (hanging, "2 pieces that share no whole face"),
        (collapsed, "1 hexes have two equal corners, the first is number 3"),
        (two_pieces, "2 pieces that share no whole face"),
        (hollow, "inner void"),
        (edge_contact, "whole faces: boundary is not a closed manifold"),
        (not_a_number, "finite"),
    ],
)
def test_unusable_meshes_are_refused(made, message):
    vertices, hexes = made()
    with pytest.raises(InputError, match=message):
        tidy(vertices, hexes, np.zeros(len(hexes), np.int64))


def test_files_that_are_no_hex_mesh_are_refused_in_one_sentence(tmp_path, capfd):
    mesh = hex_box()
    tetra = write(tmp_path / "tetra.vtu", mesh.vertices, [("tetra", mesh.hexes[:, :4])])
    mixed = [("hexahedron", mesh.hexes), ("wedge", mesh.hexes[:1, :6])]
    mixed = write(tmp_path / "mixed.vtk", mesh.vertices, mixed)
    (tmp_path / "broken.vtu").write_text("<VTKFile")
    (tmp_path / "broken.msh").write_text("hello")
    for path, message in {
        tetra: "it has 8 tetra",
        mixed: "8 hexahedron, 1 wedge",
        tmp_path / "broken.vtu": "not a readable .vtu file",
        tmp_path / "broken.msh": "not a readable .msh file",
        tmp_path / "nowhere.vtk": "there is no such file",
        tmp_path / "part.stl": "unknown kind of hex mesh '.stl'",
    }.items():
        with pytest.raises(InputError, match=message) as caught:
            read_hexes(path)
        assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)
    output = capfd.readouterr()
    assert output.out == output.err == ""


def test_the_boundary_as_a_surface_is_where_the_mesh_is():
    mesh = hex_cylinder(4, 4)
    surface = boundary(mesh)
    assert genus(surface) == 0
    off = deviation(mesh, surface)
    assert off.vertices < 1e-12 and off.to_mesh.largest < 1e-12 and off.to_surface.largest < 1e-3


def test_mesh_and_surface_must_lie_in_the_same_place():
    mesh = hex_box((2, 2, 2))
    check_place(mesh, box())
    check_place(mesh, box(high=(1.05, 1, 1)))
    with pytest.raises(InputError, match=r"units: it is 0\.001 times as large"):
        check_place(mesh, box(high=(1000.0, 1000, 1000)))
    with pytest.raises(InputError, match="the same placement"):
        check_place(mesh, box((2.0, 0, 0), (3.0, 1, 1)))


@pytest.mark.slow
def test_published_meshes_are_taken_as_they_are(testdata):
    for path in sorted((testdata / "surfaces" / "ref_hex").glob("*.vtk")):
        mesh, notes = read_hexes(path)
        assert notes == [], path.name
        assert (scaled_jacobian(mesh.vertices, mesh.hexes) > 0).all()


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("abaqus", {"element": "C3D8R"}),
        ("abaqus", {"element": "C3D20R"}),
        ("gmsh", {"nodes": 20}),
        ("gmsh", {"nodes": 27}),
        ("gmsh", {"nodes": 27, "version": "4.1"}),
        ("vtk", {"nodes": 20}),
        ("vtk", {"nodes": 27}),
        ("nastran", {}),
        ("medit", {}),
    ],
)
def test_our_own_files_are_read_back(name, options, tmp_path):
    mesh = hex_cylinder()
    path = build("export", {"plugin": name, **options})(mesh, tmp_path / "hex")
    found, notes = read_hexes(path)
    np.testing.assert_array_equal(found.hexes, mesh.hexes)
    np.testing.assert_allclose(found.vertices, mesh.vertices, atol=1e-9)
    if options.get("nodes") or options.get("element") == "C3D20R":
        assert (
            notes[0]
            == f"only the corners of hexes with more than 8 nodes are read: {len(mesh.hexes)}"
        )
    else:
        assert notes == []


def test_an_abaqus_file_of_another_program(tmp_path):
    """Types that meshio refuses, comments, continued lines, gaps in the numbers."""
    mesh = hex_box()
    numbers = 10 * np.arange(len(mesh.vertices)) + 7
    lines = ["*Heading", " made elsewhere", "** comment", "*Node, nset=all"]
    lines += [f"{n}, {x}, {y}, {z}" for n, (x, y, z) in zip(numbers, mesh.vertices, strict=True)]
    lines += ["*ELEMENT, type=CPS8, ELSET=face", "1, 7, 17, 27, 37,", "47, 57, 67, 77"]
    lines += ["*ELEMENT, elset=all,", "type=C3D8IH"]
    for k, row in enumerate(numbers[mesh.hexes], start=2):
        lines += [f"{k}, {', '.join(map(str, row[:4]))},", ", ".join(map(str, row[4:]))]
    path = tmp_path / "part.inp"
    path.write_text("\n".join([*lines, "*NODE PRINT", "U", "*ELEMENT OUTPUT", "S"]))
    found, notes = read_hexes(path)
    assert notes == []
    np.testing.assert_array_equal(found.hexes, mesh.hexes)
    np.testing.assert_array_equal(found.vertices, mesh.vertices)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("*NODE\n1,0,0\n*ELEMENT,TYPE=C3D8\n1,1,2,3,4,5,6,7,8\n", "a node that does not exist"),
        ("*NODE\n1,0,0\n*ELEMENT,TYPE=C3D8\n1,1,1\n", "not a readable .inp"),
        ("*NODE\n1,0,0\n1,0,1\n*ELEMENT,TYPE=C3D8\n", "two places; give a file of one part"),
        ("*NODE\n1,0,0\n*ELEMENT,TYPE=C3D10\n" + 11 * "1," + "\n", "it has 1 c3d10"),
        ("*NODE\n1,0,x\n", "not a readable .inp"),
        ("words", "it has no cells"),
    ],
)
def test_abaqus_files_that_are_refused(text, sentence, tmp_path):
    path = tmp_path / "part.inp"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence):
        read_hexes(path)


CORNERS = (
    "1,0.,0.,0.;2,1.,0.,0.;3,1.,1.,0.;4,0.,1.,0.;5,0.,0.,2.5-1;6,1.,0.,2.5E-1;7,1.,1.,.25;8,,1.,.25"
)
FREE = "".join(f"GRID,{a[0]},,{a[2:]}\n" for a in CORNERS.split(";"))
FREE += "CHEXA,1,1,1,2,3,4,5,6,+A\n+A,7,8\n"
FIXED = "".join(
    f"GRID    {a:>8}{'':8}{x:>8}{y:>8}{z:>8}\n"
    for a, x, y, z in (corner.split(",") for corner in CORNERS.split(";"))
)
FIXED += "$ note\nCHEXA   " + "".join(f"{n:>8}" for n in (1, 1, 1, 2, 3, 4, 5, 6))
FIXED += "\n        " + "".join(f"{n:>8}" for n in (7, 8)) + "\nPSHELL  7\nCQUAD4  9"
CURVED = FREE.replace("7,8\n", "7,8,,,9,,,\n+,,,,12\n")


@pytest.mark.parametrize("text", [FREE, FIXED, CURVED, f"SOL 101\nBEGIN BULK\n{FREE}ENDDATA\nGRID"])
@pytest.mark.parametrize("suffix", [".bdf", ".nas"])
def test_forms_of_nastran_fields(text, suffix, tmp_path):
    path = tmp_path / f"part{suffix}"
    path.write_text(text)
    mesh, notes = read_hexes(path)
    assert mesh.hexes.tolist() == [[0, 1, 2, 3, 4, 5, 6, 7]]
    assert volume(mesh) == pytest.approx(0.25, rel=1e-12)
    assert ("only the corners" in "".join(notes)) == (text == CURVED)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (FREE.replace("GRID,3,,", "GRID,3,5,"), "node 3 is in another system of coordinates"),
        (FREE.replace("GRID,8", "GRID,9"), "a node that does not exist"),
        (FREE + "CTETRA,2,1,1,2,3,4\n", "1 hexahedron, 1 ctetra"),
        (FREE.replace(",1.,", ",one,"), "not a readable"),
        ("words", "it has no cells"),
    ],
)
def test_nastran_files_that_are_refused(text, sentence, tmp_path):
    path = tmp_path / "part.bdf"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence):
        read_hexes(path)
