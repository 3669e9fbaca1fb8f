"""Damaged files: a result, or one short sentence."""

from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np
import pytest
import trimesh

from polycube.errors import InputError
from polycube.io.hex_meshes import read_hexes
from polycube.io.stl import write_stl
from polycube.io.surfaces import read_surface
from polycube.io.vtk import write_hex_vtu
from tests.fixtures.hexmeshes import hex_box
from tests.fixtures.mutations import mutations
from tests.fixtures.surfaces import box

SURFACES = (".stl", ".obj", ".ply", ".off", ".glb")
HEXES = (".vtu", ".vtk", ".mesh", ".inp")  # meshio may read a damaged .msh for minutes
LONGEST = 400  # characters of a message, the path included


def sample(folder: Path, suffix: str) -> Path:
    """A small sound file of a format."""
    path, solid, mesh = folder / f"sound{suffix}", box(), hex_box()
    if suffix == ".stl":
        write_stl(path, solid.vertices, solid.faces)
    elif suffix in SURFACES:
        trimesh.Trimesh(solid.vertices, solid.faces, process=False).export(path)
    elif suffix == ".vtu":
        write_hex_vtu(path, mesh)
    else:
        meshio.Mesh(mesh.vertices, [("hexahedron", mesh.hexes)]).write(path)
    return path


def read(path: Path) -> None:
    """Read a file; raises unless the outcome is a result or a short sentence."""
    reader: Callable[[str], object] = read_surface if path.suffix in SURFACES else read_hexes
    try:
        reader(str(path))
    except InputError as error:
        assert "\n" not in str(error) and len(str(error)) <= LONGEST, str(error)[:1000]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("number", [8, pytest.param(200, marks=pytest.mark.slow)])
@pytest.mark.parametrize("suffix", SURFACES + HEXES)
def test_a_damaged_file_is_read_or_refused(suffix: str, number: int, tmp_path: Path) -> None:
    data = sample(tmp_path, suffix).read_bytes()
    path = tmp_path / f"damaged{suffix}"
    for damaged in mutations(data, 0, number):
        path.write_bytes(damaged)
        read(path)


@pytest.mark.filterwarnings("ignore")
def test_the_message_of_a_damaged_ply_does_not_hold_the_file(tmp_path: Path) -> None:
    path = sample(tmp_path, ".ply")
    data = path.read_bytes().replace(b"format binary_little_endian", b"format ascii")
    path.write_bytes(data + bytes([0xFF, 0xFE]) * 5000)
    with pytest.raises(InputError) as refused:
        read_surface(str(path))
    assert len(str(refused.value)) < LONGEST


def test_hexahedra_of_four_nodes_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "flat.msh"
    points = np.eye(4)[:, :3]
    nodes = "".join(f"{i} {x} {y} {z}\n" for i, (x, y, z) in enumerate(points, 1))
    path.write_text(
        f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n{nodes}$EndNodes\n"
        "$Elements\n1\n1 5 0 1 2 3 4\n$EndElements\n"
    )
    with pytest.raises(InputError):
        read_hexes(str(path))
