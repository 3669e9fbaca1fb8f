"""Files for faults that users of other programs reported: what is right for each of them."""

import time

import pytest

from polycube.errors import InputError
from polycube.hexmesh.named_sets import cad_sets
from polycube.io.hex_meshes import read_hexes
from polycube.io.surfaces import read_surface
from polycube.surface.measures import genus, volume

READ = {  # file -> unit, volume, genus, notes
    "bin_tail.stl": ("", 8, 0, ["ignored bytes after the last of 12 triangles: 40"]),
    "comment_before_format.ply": ("", 8, 0, []),
    "ngon_concave.ply": ("", 12, 0, []),
    "case_box.step": ("mm", 8000, 0, []),
    "cjk_box.step": ("mm", 8000, 0, []),
    "inch.step": ("in", 7498.42, 1, []),
    "metres.step": ("m", 7498.42, 1, []),
    "filleted.step": ("mm", 14803.9, 0, []),
    "gap_0.004.igs": ("mm", 1000027, 0, ["over gaps of up to 0.004 mm between its faces"]),
}
REFUSED = {
    "accessor_3e8.glb": "its accessors have more elements than the file has bytes",
    "lzf.pcd": "its 16 bytes do not hold 300000000 points",
    "newlines20k.stl": "the file has no triangles",
    "unitcycle.step": "the length unit #18 is defined by itself; export the part again",
}
SETS = {
    "case_box.step": {
        **{"Face_2": "cad_Face_2", "Face_1": "cad_Face_1", "Fixed": "cad_Fixed"},
        **{"FIXED": "cad_FIXED__2", "face_4": "cad_face_4", "load": "cad_load"},
    },
    "cjk_box.step": {
        **{"固定面": "cad_固定面", "载荷面": "cad_载荷面", "安装孔": "cad_安装孔"},
        **{"Weld; root": "cad_Weld_root", "O'Ring": "cad_O_Ring", "plain": "cad_plain"},
    },
}


def test_every_file_is_here(testdata) -> None:
    found = {path.name for path in (testdata / "cases3").iterdir() if path.suffix != ".md"}
    assert found == {*READ, *REFUSED, "gmsh_second_order.inp"}


@pytest.mark.slow
@pytest.mark.parametrize("name", READ)
def test_a_file_that_is_read(testdata, name) -> None:
    unit, size, handles, notes = READ[name]
    surface, found = read_surface(testdata / "cases3" / name)
    assert (surface.unit, genus(surface), len(found)) == (unit, handles, len(notes))
    assert volume(surface) == pytest.approx(size, rel=1e-5)
    assert all(note in own for note, own in zip(notes, found, strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("name", REFUSED)
def test_a_file_that_is_refused_at_once(testdata, name) -> None:
    begin = time.process_time()
    with pytest.raises(InputError, match=REFUSED[name]) as refused:
        read_surface(testdata / "cases3" / name)
    assert time.process_time() - begin < 5 and "\n" not in str(refused.value)


@pytest.mark.slow
@pytest.mark.parametrize("name", SETS)
def test_every_named_face_has_its_own_set(testdata, name) -> None:
    surface, _ = read_surface(testdata / "cases3" / name)
    sets = cad_sets(surface).numbers
    for number, called in enumerate(surface.region_names, start=1):
        assert sets[SETS[name][called]].tolist() == [number]
    assert len({each.lower() for each in sets}) == len(sets)


def test_second_order_hexes_are_read_as_their_corners(testdata) -> None:
    mesh, notes = read_hexes(str(testdata / "cases3" / "gmsh_second_order.inp"))
    assert len(mesh.hexes) == 8
    assert notes[0] == "only the corners of hexes with more than 8 nodes are read: 8"
