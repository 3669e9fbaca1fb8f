"""Reading: formats agree to the last digit, and each refusal is reached."""

import struct
import subprocess
import sys

import numpy as np
import pytest
import trimesh

from polycube.errors import InputError
from polycube.io.surfaces import read_surface
from polycube.surface.checks import check_surface
from polycube.surface.measures import genus, volume
from tests.conftest import first_quick
from tests.fixtures.sound_files import write_fbx
from tests.fixtures.surfaces import box, torus

CUBE = box((1000.5, -2.25, 0.125), (1001.5, -1.25, 2.125))  # exact in single precision


def written(folder, kind, mesh=CUBE):
    path = folder / f"part.{kind}"
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(path)
    return path


@pytest.mark.parametrize("kind", ["stl", "obj", "ply", "off", "glb", "STL"])
def test_formats_keep_units_and_placement(tmp_path, kind):
    surface, warnings = read_surface(str(written(tmp_path, kind)))
    assert warnings == []
    assert len(surface.vertices) == 8 and len(surface.faces) == 12
    assert surface.vertices.min(axis=0).tolist() == [1000.5, -2.25, 0.125]
    assert surface.vertices.max(axis=0).tolist() == [1001.5, -1.25, 2.125]
    assert volume(surface) == pytest.approx(2)


@pytest.mark.slow
def test_fbx_is_read(tmp_path):
    pytest.importorskip("open3d", exc_type=ImportError)
    path = tmp_path / "part.fbx"
    write_fbx(path, CUBE)
    surface, _ = read_surface(path)
    assert genus(surface) == 0
    assert volume(surface) == pytest.approx(2, rel=1e-5)


def test_ascii_stl_with_odd_layout(tmp_path):
    lines = ["  SOLID vertex 1 2 3"]
    for triangle in CUBE.vertices[CUBE.faces]:
        corners = [f"\tVERTEX {x} {y} {z}" for x, y, z in triangle.tolist()]
        lines += ["facet normal 0 0 0", " outer loop", *corners, " endloop", "EndFacet"]
    path = tmp_path / "part.stl"
    path.write_bytes("\r\n".join([*lines, "endsolid"]).encode())
    assert volume(read_surface(path)[0]) == pytest.approx(2)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 one\n",
            "it ends after 1 vertices of 1 facets",
        ),
        (b"solid a\nendsolid a\n", "no triangles"),
        (
            b"solid\nfacet\nvertex 0 0 a\nvertex 1 0 0\nvertex 0 1 0\nendfacet\nendsolid",
            "a coordinate is not a number",
        ),
        (b"\0" * 90, "header gives 0 triangles"),
        (b"\0" * 80 + struct.pack("<I", 2) + b"\0" * 99, "its 183 bytes contain 1"),
        (b"\0" * 80 + struct.pack("<I", 2**32 - 1), "header gives 4294967295 triangles"),
        (b"good morning", "not an STL file"),
        (b"", "the file is empty"),
    ],
)
def test_broken_stl(tmp_path, text, sentence):
    path = tmp_path / "part.stl"
    path.write_bytes(text)
    with pytest.raises(InputError, match=sentence):
        read_surface(path)


@pytest.mark.parametrize("spare", [1, 40, 50, 512])
def test_bytes_after_the_triangles_are_ignored_with_a_note(tmp_path, spare):
    path = written(tmp_path, "stl")
    path.write_bytes(path.read_bytes() + b"#" * spare)
    surface, warnings = read_surface(path)
    assert volume(surface) == 2
    assert warnings == [f"ignored bytes after the last of 12 triangles: {spare}"]


def test_a_count_of_zero_is_replaced_by_that_of_the_size(tmp_path):
    path = written(tmp_path, "stl")
    data = path.read_bytes()
    path.write_bytes(data[:80] + bytes(4) + data[84:])
    surface, warnings = read_surface(path)
    assert volume(surface) == 2
    assert warnings == ["its header gives 0 triangles; its size gives 12, which were read"]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("v 0 0 0\nf 1 2 3\n", "vertex 3 of 1"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "line 4.*is before the first"),
        ("v 0 0 0\nf 0 1 2\n", "line 2.*vertex index 0"),
        ("v 0 0\n", "line 1"),
        ("v 0 0 zero\n", "line 1, 'v 0 0 zero'"),
        ("v 0 0 0\nv 1 0 0\nf 1 2\n", "has 2 corners"),
        ("# nothing\n", "no triangles"),
        ("v 0 0 0\nv 1 0 0\nv 0 1e999 0\nf 1 2 3\n", "must be finite"),
    ],
)
def test_broken_obj(tmp_path, text, sentence):
    path = tmp_path / "part.obj"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence):
        read_surface(path)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("none.step", "there is no such file"),
        ("none.IGS", "there is no such file"),
        ("part.docx", ".glb, .fbx, .pcd, .xyz, .step, .stp, .iges, .igs, .brep and example:NAME"),
        ("part", "unknown kind"),
        ("none.stl", "there is no such file"),
        ("none.fbx", "there is no such file"),
    ],
)
def test_names_that_can_not_be_read(tmp_path, name, sentence):
    with pytest.raises(InputError, match=sentence):
        read_surface(tmp_path / name)


@pytest.mark.parametrize("kind", first_quick(3, ["ply", "off", "obj", "glb", "fbx"]))
def test_garbage_is_refused_in_every_format(tmp_path, kind):
    path = tmp_path / f"part.{kind}"
    path.write_bytes(bytes(range(256)) * 8)
    with pytest.raises(InputError):
        read_surface(path)
    path.write_bytes(b"")
    with pytest.raises(InputError):
        read_surface(path)


def test_folder_is_refused(tmp_path):
    with pytest.raises(InputError, match="this is a folder; give one file"):
        (tmp_path / "a.stl").mkdir()
        read_surface(tmp_path / "a.stl")


def test_missing_libusb_names_the_cure(tmp_path, import_first):
    path = written(tmp_path, "stl").rename(tmp_path / "part.fbx")
    (tmp_path / "open3d.py").write_text("raise OSError('libusb-1.0.so.0: no such file')")
    import_first(tmp_path)
    with pytest.raises(InputError, match=r"apt-get install libusb-1\.0-0"):
        read_surface(path)


@pytest.mark.parametrize("kind", first_quick(4, ["stl", "obj", "ply", "off", "glb"]))
def test_damaged_files_are_read_or_refused(tmp_path, kind):
    path = written(tmp_path, kind, torus(8, 5))
    intact, rng = path.read_bytes(), np.random.default_rng(0)
    for _ in range(4 if kind == "glb" else 40):  # glb is read in a process of its own
        damaged = bytearray(intact)
        at = rng.integers(len(intact))
        damaged[at : at + rng.integers(20)] = rng.bytes(rng.integers(20))
        path.write_bytes(damaged[: rng.integers(2, 4) * len(damaged) // 3])
        try:
            surface, _ = read_surface(path)
        except InputError as error:
            assert "\n" not in str(error)
        else:
            check_surface(surface)


@pytest.mark.slow
def test_reading_imports_no_heavy_package(tmp_path):
    code = (
        "import sys; from polycube.io.surfaces import read_surface; read_surface(sys.argv[1]);"
        "assert not {'torch', 'open3d', 'trimesh', 'vtk', 'matplotlib'} & set(sys.modules)"
    )
    path = written(tmp_path, "stl")
    result = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
