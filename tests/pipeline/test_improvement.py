"""`hex=mesh.vtu`: a mesh of another program improved, never worse, through to the modes."""

import json

import numpy as np
import pytest
import trimesh

from polycube.cli.infer import _command
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.io.hex_meshes import boundary, read_hexes
from polycube.io.vtk import write_hex_vtu
from polycube.registry import build
from tests.conftest import first_quick
from tests.fixtures.hexmeshes import false_friend, hex_box, hex_cylinder
from tests.fixtures.runs import config, run, tree

FAST = ["improve.optimize.soft_rounds=6", "improve.optimize.hard_rounds=4", "order=[meshing]"]


@pytest.fixture(scope="module")
def crooked(tmp_path_factory):
    """A box whose inner vertices were moved, 1000 units away: the file, and the least quality."""
    mesh = hex_box((4, 4, 4))
    inner = np.setdiff1d(np.arange(len(mesh.vertices)), mesh.quads)
    vertices = mesh.vertices.copy()
    vertices[inner] += 0.13 * np.random.default_rng(1).uniform(-1, 1, (len(inner), 3))
    path = tmp_path_factory.mktemp("crooked") / "box.vtu"
    mesh = type(mesh)(50 * vertices + 1000, mesh.hexes, mesh.quads, mesh.patch, mesh.cell)
    write_hex_vtu(path, mesh)
    return path, float(scaled_jacobian(mesh.vertices, mesh.hexes).min())


@pytest.mark.slow
def test_a_crooked_box_becomes_a_straight_one_in_its_place(crooked, tmp_path):
    path, before = crooked
    report = run(f"hex={path}", f"output_dir={tmp_path}", *FAST)
    assert before < 0.5
    assert report["given"]["min_scaled_jacobian"] == pytest.approx(before)
    assert report["hex"]["min_scaled_jacobian"] > 0.9
    assert report["hex"]["volume_error"] < 1e-9
    mesh, _ = read_hexes(tmp_path / "hex.vtu")
    assert mesh.vertices.min() == pytest.approx(1000) and mesh.vertices.max() == pytest.approx(1050)
    assert "polycube" not in report and "polycube.vtu" not in tree(tmp_path)


@pytest.mark.slow
def test_through_to_the_modes_and_again_from_there(tmp_path):
    path = write_hex_vtu(tmp_path / "rod.vtu", hex_cylinder())
    fast = [*FAST[:2], "order=[meshing,spline,analysis]"]
    first = run(f"hex={path}", f"output_dir={tmp_path / 'a'}", *fast, "analysis.modes=8")
    assert first["valid"]
    assert {"hex.vtu", "modes.csv", "report.json", "spline.bext"} <= tree(tmp_path / "a")
    squares = np.abs(first["modes"]["omega_squared"])
    assert squares[:6].max() < 1e-8 * squares[6]
    overrides = ["from=analysis", f"output_dir={tmp_path / 'b'}", *fast, "analysis.modes=7"]
    resumed = run(f"resume={tmp_path / 'a'}", *overrides)
    assert resumed["hex"] == first["hex"] and resumed["given"] == first["given"]
    assert len(resumed["modes"]["omega_squared"]) == 7


@pytest.mark.slow
@pytest.mark.parametrize("damage", [0.0, 0.05])
def test_never_worse_than_what_was_given(damage, tmp_path):
    """Even where the stages may do nothing good."""
    mesh = hex_cylinder(3, 3, 4)
    noise = damage * np.random.default_rng(0).normal(size=mesh.vertices.shape)
    noise[np.unique(mesh.quads)] = 0
    given = type(mesh)(mesh.vertices + noise, mesh.hexes, mesh.quads, mesh.patch, mesh.cell)
    path = write_hex_vtu(tmp_path / "given.vtu", given)
    idle = ["improve.optimize.soft_rounds=1", "improve.optimize.hard_rounds=1"]
    run(f"hex={path}", f"output_dir={tmp_path / 'out'}", "order=[meshing]", *idle)
    got, _ = read_hexes(tmp_path / "out" / "hex.vtu")
    surface = boundary(read_hexes(path)[0])
    judge = build("acceptance", {"plugin": "standard"})
    assert judge(got, surface).key >= judge(given, surface).key


@pytest.mark.slow
def test_an_inverted_hex_is_untangled(tmp_path):
    mesh = hex_box((3, 3, 3))
    vertices = mesh.vertices.copy()
    vertices[np.setdiff1d(np.arange(64), mesh.quads)[0]] += 0.6
    path = write_hex_vtu(
        tmp_path / "folded.vtu", type(mesh)(vertices, *list(vars(mesh).values())[1:])
    )
    report = run(f"hex={path}", f"output_dir={tmp_path / 'out'}", *FAST)
    assert report["given"]["inverted"] > 0 and report["hex"]["inverted"] == 0
    assert report["hex"]["min_scaled_jacobian"] > 0.8


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    first_quick(
        2,
        [
            (["hex=nowhere.vtu"], "there is no such file"),
            (["hex={box}", "mesh=example:rod"], "give both in the same units: it is "),
            (
                ["hex={box}", "acceptance.certify=somewhere"],
                "certify must be one of everywhere, corners",
            ),
            (["hex={box}", "improve.order=[meshing/subdivide]"], "needs polycube"),
        ],
    ),
)
def test_refusals(overrides, sentence, crooked, here, capsys):
    overrides = [text.replace("{box}", str(crooked[0])) for text in overrides]
    assert _command(config("quiet=true", *overrides)) == 2
    errors = capsys.readouterr().err
    assert errors.startswith("error: ") and errors.count("\n") == 1 and sentence in errors
    assert tree(here) == set()


@pytest.mark.slow
def test_a_hex_that_is_not_positive_everywhere_ends_with_code_3(tmp_path, capsys):
    path = write_hex_vtu(tmp_path / "one.vtu", false_friend())
    overrides = ["quiet=true", f"hex={path}", "improve.order=[meshing/pillow]", "order=[meshing]"]
    overrides += ["improve.portfolio=[{}]"]
    corners = ["acceptance.certify=corners", f"output_dir={tmp_path / 'a'}"]
    assert _command(config(*overrides, *corners)) == 0
    assert "valid (at corners only) hex mesh: 1 hexes" in (tmp_path / "a" / "run.log").read_text()
    assert _command(config(*overrides, f"output_dir={tmp_path / 'b'}")) == 3
    assert "the Jacobian of 1 of 1 hexes is not positive everywhere" in capsys.readouterr().err
    report = json.loads((tmp_path / "b" / "report.json").read_text())
    assert not report["valid"] and report["hex"]["certificate"]["not_positive"] == 1


@pytest.mark.parametrize("certify", ["corners", "everywhere"])
def test_a_mesh_with_the_requested_certificate_is_preferred(certify):
    good, friend = hex_box((1, 1, 1)), false_friend()
    limits = {"distance_limit": 9.0, "volume_limit": 9.0}
    acceptance = build("acceptance", {"plugin": "standard", "certify": certify, **limits})
    surface = boundary(friend)  # from which the good one is far
    better, other = acceptance(good, surface), acceptance(friend, surface)
    assert other.is_valid == (certify == "corners")
    assert other.is_valid or better.key > other.key


@pytest.mark.slow
def test_another_genus_gives_a_warning(tmp_path):
    block = hex_box((3, 3, 1))
    ring = hex_mesh(block.vertices, np.delete(block.hexes, 4, axis=0))
    path = write_hex_vtu(tmp_path / "ring.vtu", ring)
    surface = trimesh.creation.box(bounds=[[0, 0, 0], [1, 1, 1]])
    surface.export(tmp_path / "cube.stl")
    overrides = [f"hex={path}", f"mesh={tmp_path / 'cube.stl'}", f"output_dir={tmp_path / 'o'}"]
    report = run(*overrides, "order=[]")
    assert report["warnings"][-1] == "the hex mesh has genus 1, the surface 0"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "surface", "least"),
    [
        ("hepta_hexgen2020", "hepta.obj", 0.6),
        ("cube_blind_hole_cq2017", "cube_blind_hole.obj", 0.6),
        ("rod_hexgen2020", "rod.stl", 0.45),
    ],
)
def test_published_meshes_get_better(name, surface, least, testdata, tmp_path):
    """From 0.242, 0.309 and 0.319; measured 0.703, 0.763 and 0.561."""
    folder = testdata / "surfaces"
    report = run(
        f"hex={folder / 'ref_hex' / name}.vtk", f"mesh={folder / surface}",
        f"output_dir={tmp_path}", "order=[meshing]",
    )  # fmt: skip
    before, after = report["given"], report["hex"]
    assert after["min_scaled_jacobian"] > max(least, before["min_scaled_jacobian"])
    # the blind hole came with an error of 0.006 % of the diagonal, where 0.1 % costs no score
    assert after["surface_to_mesh_p99"] < 1.05 * before["surface_to_mesh_p99"] + 0.001
