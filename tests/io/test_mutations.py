"""Damaged files of every format that is read: a result, or one short sentence."""

import json
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.io.hex_meshes import read_hexes
from polycube.io.surfaces import read_surface
from tests.conftest import ROOT
from tests.fixtures.damaged_files import fault
from tests.fixtures.mutations import NUMBER, mutation
from tests.fixtures.sound_files import FORMATS, sound_file

LONGEST = 400  # characters of a message, the path included
EACH = 200  # files of a format; 6400 in all
CAD = ("step", "iges", "brep")
LONG = ("iges", "fbx")  # their readers take seconds for a damaged file
FOREIGN = ("glb", "gltf", *CAD)  # read in a process of their own
HEXES = ("vtu ascii", "vtk", "vtk binary", "medit")
HEXES = (*HEXES, *(f"gmsh {each}" for each in ("2", "2 binary", "4", "4 binary")))
OPEN3D = ("fbx", "pcd", "pcd binary", "pcd compressed", "xyz", "ply points", "ply points ascii")


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory):
    """A sound file of a format, in a folder of its own."""

    def write(name: str) -> Path:
        if name in CAD:
            pytest.importorskip("gmsh", exc_type=ImportError)
        if name in OPEN3D:
            pytest.importorskip("open3d", exc_type=ImportError)
        folder = tmp_path_factory.mktemp(name.replace(" ", "-"))
        return sound_file(name, folder)

    return write


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(each, marks=pytest.mark.slow if each in (*FOREIGN, *OPEN3D, *HEXES) else ())
        for each in FORMATS
        if each not in LONG
    ],
)
def test_a_sound_file_is_read_and_a_damaged_one_read_or_refused(name: str, sound) -> None:
    path = sound(name)
    suffix, _, read = FORMATS[name]
    read(path)
    damaged = path.with_name(f"damaged{suffix}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for seed in range(1 if name in FOREIGN else 3):
            damaged.write_bytes(mutation(path.read_bytes(), seed))
            assert fault(read, damaged) == "", seed


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMATS)
def test_many_damaged_files_are_read_or_refused(name: str, sound) -> None:
    """In a process of limited memory, which reports each file and what is wrong with it."""
    found = outcomes(name, sound(name))
    assert {seed: wrong for seed, wrong in found.items() if wrong} == {}


def outcomes(name: str, path: Path) -> dict[int, str]:
    """Of the files of a format, by seed: what is wrong, "" where nothing is."""
    found: dict[int, str] = {}
    while len(found) < EACH:
        start = len(found)
        command = ["tests.fixtures.damaged_files", name, path, start, EACH - start]
        ended = subprocess.run(
            [sys.executable, "-m", *map(str, command)],
            cwd=ROOT,
            capture_output=True,
            text=True,
            timeout=3000,
        )
        rows = [json.loads(line) for line in ended.stdout.splitlines()]
        found.update(enumerate(rows, start))
        if len(found) < EACH:  # the next one ended the process
            found[len(found)] = f"ended with {ended.returncode}: {ended.stderr[-2000:]}"
    return found


@pytest.mark.filterwarnings("ignore")
def test_the_message_of_a_damaged_ply_does_not_hold_the_file(sound) -> None:
    path = sound("ply binary")
    data = path.read_bytes().replace(b"format binary_little_endian", b"format ascii")
    path.write_bytes(data + bytes([0xFF, 0xFE]) * 5000)
    with pytest.raises(InputError) as refused:
        read_surface(str(path))
    assert len(str(refused.value)) < LONGEST


@pytest.mark.parametrize("name", ["off", "obj", "ply", "stl", "abaqus"])
def test_the_message_of_a_long_number_is_short(name: str, sound) -> None:
    path = sound(name)
    data, read = path.read_bytes(), FORMATS[name][2]
    for number in list(NUMBER.finditer(data[:400]))[:12]:
        for word in (b"9" * 400, b"-" + b"9" * 30):
            path.write_bytes(data[: number.start()] + word + data[number.end() :])
            assert fault(read, path) == "", number


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
