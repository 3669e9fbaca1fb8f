"""Names of CAD faces in every format: the sets are those of the faces, and no two are one."""

import random
import re
from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.cad_faces import with_sets
from polycube.io.surfaces import read_surface
from polycube.names import in_ascii, plain, unique
from polycube.types import HexMesh
from tests.fixtures import step_files
from tests.fixtures.exports import cards_of, corners, export, read
from tests.fixtures.hexmeshes import hex_box

LETTERS = [
    "abcXYZ 0129_",
    "固定面载荷安装孔焊缝",
    "éèßøÄÖñçЖДαβ",
    "'\";,.-/\\#()=*$&<>%",
    "😀ひカ한",
]
KNOWN = [
    "Face_1",
    "face_1",
    "face 3",
    "FACE-3",
    "cad_face_2",
    "x_min",
    "hole_1",
    "a.b",
    "a-b",
    "?!",
]


def names_of_faces(rng: random.Random) -> list[str]:
    """Six names, with a pair that differs in case, and one of 200 characters."""
    word = (
        "".join(rng.choice(rng.choice(LETTERS)) for _ in range(rng.randint(2, 12))).strip() or "a"
    )
    long = "".join(rng.choice(LETTERS[rng.randint(0, 2)]) for _ in range(200)).strip()
    names = [word, word.swapcase(), long, long[:-1] + "q", *rng.sample(KNOWN, 2)]
    names[rng.randrange(6)] = rng.choice(names)  # perhaps twice
    rng.shuffle(names)
    return names


def encoded(rng: random.Random, name: str) -> str:
    """A name as one of several programs writes it."""

    def one(letter: str) -> str:
        code = ord(letter)
        if letter in "'\\":
            return 2 * letter
        if letter.isascii() or rng.random() < 0.3:
            return letter
        if code < 256 and rng.random() < 0.5:
            return rng.choice(
                [rf"\X\{code:02X}", rf"\S\{chr(code - 128)}" if code >= 160 else letter]
            )
        if code < 65536 and rng.random() < 0.7:
            return rf"\X2\{code:04X}\X0" "\\"
        return rf"\X4\{code:08X}\X0" "\\"

    return "".join(map(one, name))


def sets_of_faces(mesh: HexMesh, surface, names: list[str]) -> dict[str, np.ndarray]:
    """Quads of each name by their places alone."""
    found: dict[str, list[int]] = {}
    middle = mesh.vertices[mesh.quads].mean(axis=1)
    for number, name in enumerate(names, start=1):
        own = surface.vertices[surface.faces[surface.region == number]].reshape(-1, 3)
        low, high = own.min(axis=0) - 1e-6, own.max(axis=0) + 1e-6
        inside = ((middle > low) & (middle < high)).all(axis=1)
        found.setdefault(name, []).extend(np.flatnonzero(inside).tolist())
    return {name: np.sort(own) for name, own in found.items()}


def nodes_and_quads(mesh: HexMesh, folder, name: str) -> dict[str, tuple]:
    """Nodes and, where the reader has them, sorted quads of each set, in the order of the file."""
    path = export(mesh, folder, name)
    if name == "abaqus":
        return {
            key: (own.tolist(), None) for key, own in read(path).point_sets.items() if key != "all"
        }
    if name == "nastran":
        cards = [(said, card) for said, card in cards_of(path.read_text()) if card[0] == "SET1"]
        return {said: ([int(n) - 1 for n in card[2:] if n], None) for said, card in cards}
    if name == "gmsh":
        found = read(path)
        quads = found.cells_dict["quad"]
        return {
            key: (np.unique(quads[own["quad"]]).tolist(), corners(quads[own["quad"]]))
            for key, own in found.cell_sets_dict.items()
            if "quad" in own and not key.startswith("gmsh:")
        }
    if name == "vtk":
        grid = pytest.importorskip("pyvista").UnstructuredGrid(path)
        return {
            key: (np.flatnonzero(grid.point_data[key]).tolist(), None) for key in grid.point_data
        }
    from scipy.io import netcdf_file

    with netcdf_file(str(path), "r", mmap=False) as file:
        rows = [b"".join(row).rstrip(b"\0").decode() for row in file.variables["ns_names"][:]]
        nodes = [file.variables[f"node_ns{k}"][:] - 1 for k in range(1, 1 + len(rows))]
    return {key: (own.tolist(), None) for key, own in zip(rows, nodes, strict=True)}


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_every_face_has_its_set_in_every_format(tmp_path, seed) -> None:
    rng = random.Random(seed)
    names = names_of_faces(rng)
    path = step_files.box(tmp_path / "a.step", [encoded(rng, name) for name in names])
    surface, _ = read_surface(path)
    assert list(surface.region_names) == names
    mesh = with_sets(hex_box((4, 3, 2), step_files.SIDES), surface)
    wanted = sets_of_faces(mesh, surface, names)
    assert {
        mesh.cad_names[key]: own.tolist() for key, own in mesh.sets.items() if key in mesh.cad_names
    } == {name: own.tolist() for name, own in wanted.items()}
    kept = {key: own for key, own in mesh.sets.items() if not key.startswith("patch_")}
    mesh = replace(mesh, sets=kept)
    for form in ("abaqus", "nastran", "exodus", "gmsh", "vtk"):
        found = nodes_and_quads(mesh, tmp_path, form)
        assert len(found) == len(kept) == len({key.lower() for key in found}), form
        for (key, quads), (new, (nodes, faces)) in zip(kept.items(), found.items(), strict=True):
            assert nodes == np.unique(mesh.quads[quads]).tolist(), (form, key, new)
            assert faces is None or faces == corners(mesh.quads[quads])
            if form in ("abaqus", "nastran", "vtk"):
                assert re.fullmatch(r"[A-Za-z]\w*", new, re.ASCII) and len(new) <= 200
            elif len(key.encode()) < 100:
                assert new == key


def test_names_are_unique_without_case_and_those_in_plain_form_stay() -> None:
    assert unique(["a", "A", "b", "a"]) == ["a", "A__2", "b", "a__3"]
    assert unique(["face_long", "face_lonG", "face_longer"], 8) == [
        "face_lon",
        "face___2",
        "face___3",
    ]
    assert [plain(name) for name in ("a.b", " a--b ", "固定 面;", "?!", "e\u0301")] == [
        *("a_b", "a_b", "固定_面", ""),
        "é",
    ]
    assert [in_ascii(name) for name in ("Größe", "面", "Ø8", "Ждα", "カ", "½")] == [
        *("Grosse", "u9762", "O8"),
        *("ZHEdealpha", "ka", "1u20442"),
    ]


def test_the_table_of_names_is_in_the_decks(mesh, tmp_path) -> None:
    sets = {"cad_固定面": mesh.sets["x_min"], "cad_a_b": mesh.sets["x_max"]}
    named = replace(
        mesh, sets=sets, cad_names={"cad_固定面": "固定面", "cad_a_b": "a;b"}, unit="in"
    )
    for form, mark in {"abaqus": "** ", "nastran": "$ ", "lsdyna": "$ ", "medit": "# "}.items():
        text = export(named, tmp_path, form).read_text(encoding="utf-8")
        first = "cad_固定面" if form == "medit" else "cad_u56fau5b9au9762"
        assert f"{mark}set {first} is '固定面' in the CAD file\n" in text
        assert f"{mark}set cad_a_b is 'a;b' in the CAD file\n" in text
        assert f"{mark}lengths in in\n" in text


BAD = ["*STEP", "x\n*STEP", "$EndComments", "]]>-->", "</febio_spec>", "\x07\x85", "ENDDATA " * 30]


def test_no_name_ends_a_comment(mesh, tmp_path) -> None:
    """Names are printable, and long ones continue in lines with a mark of their own."""
    sets = {f"cad_{k}": mesh.sets["x_min"] for k in range(len(BAD))}
    named = replace(mesh, sets=sets, cad_names=dict(zip(sets, BAD, strict=True)))
    for form in ("abaqus", "nastran", "lsdyna"):
        own, plain = (
            [
                row
                for row in export(each, tmp_path, form).read_text().splitlines()
                if row[:1] not in "$"
            ]
            for each in (named, replace(named, cad_names={}))
        )
        marked = [row for row in own if not row.startswith("** ")]
        assert marked == [row for row in plain if not row.startswith("** ")]
    assert set(read(export(named, tmp_path, "gmsh")).field_data) >= set(sets)
    from xml.etree import ElementTree

    ElementTree.parse(export(named, tmp_path, "febio"))
