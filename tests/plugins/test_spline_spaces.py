"""The three spline spaces, and user-supplied sharp edges."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.registry import build
from polycube.spline.bezier import bezier_points, min_detj
from polycube.spline.spaces.refinement import refined_spline
from polycube.spline.spaces.sharp_features import creases
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder
from tests.fixtures.hierarchies import space_on


def solid(mesh, name="h2s", **options):
    """The spline before it is fitted to a surface."""
    plugin = build("spline", {"plugin": name, **options})
    return refined_spline(space_on(plugin, mesh), plugin.refine, None)


@pytest.mark.parametrize("name", ["optimal", "c0"])
@pytest.mark.parametrize("mesh", [hex_box((3, 3, 3)), hex_cylinder(), hex_ball()])
def test_larger_spaces_have_the_same_solid(name, mesh):
    plain, larger = solid(mesh), solid(mesh, name)
    assert len(larger.control) > len(plain.control)
    assert np.array_equal(larger.nodes, plain.nodes)
    assert bezier_points(larger) == pytest.approx(bezier_points(plain), abs=1e-13)
    assert np.array_equal(larger.sides, plain.sides)


@pytest.mark.parametrize("name", ["optimal", "c0"])
def test_larger_spaces_have_the_same_solid_when_refined(name):
    mesh, refine = hex_ball(), {"elements": list(range(12))}
    plain, fine = (solid(mesh, name, refine=r) for r in ({}, refine))
    assert len(fine.nodes) == len(plain.nodes) + 12 * 7
    assert min_detj(fine).volume == pytest.approx(min_detj(plain).volume, rel=1e-13)


def test_numbers_of_functions():
    mesh = hex_box((3, 2, 4))
    count = {name: len(solid(mesh, name).control) for name in ("h2s", "optimal", "c0")}
    assert count == {"h2s": 4 * 3 * 5, "optimal": 6 * 5 * 7, "c0": 10 * 7 * 13}


@pytest.mark.parametrize("name", ["h2s", "optimal", "c0"])
def test_sharp_edges_by_list_and_by_file(name, tmp_path):
    mesh = hex_cylinder(2, 2, 2)  # its rims are sharp by single_hex_edges
    sides = creases(mesh, np.radians(44))
    sides = sides[np.ptp(mesh.vertices[sides][..., 2], axis=1) > 0]
    expected = 8 * np.sin(np.pi / 4) / 2  # the prism
    assert min_detj(solid(mesh, name, sharp="none")).volume < 0.99 * expected
    edges, vertices, published = (tmp_path / f"{k}.txt" for k in ("edges", "vertices", "published"))
    edges.write_text("".join(f"{a} {b}\n" for a, b in sides))
    on = np.unique(sides)
    vertices.write_text("".join(f"{v}\n" for v in on))
    published.write_text("".join(f"0\t\t{v}\t\t\r\n" for v in on))
    for sharp in (sides[:, ::-1].tolist(), str(edges), str(vertices), str(published)):
        found = min_detj(solid(mesh, name, sharp=sharp))
        assert found.volume == pytest.approx(expected, rel=1e-12)
        assert found.lower_bound > 0


def test_refuses_invalid_sharp_edges(tmp_path):
    mesh = hex_box((2, 2, 2))
    with pytest.raises(InputError, match=r"sharp edge \[4, 13\] is not on the boundary"):
        solid(mesh, sharp=[[0, 1], [13, 4]])
    (tmp_path / "words.txt").write_text("a b\n")
    with pytest.raises(InputError, match="must have as many vertex numbers in each line"):
        solid(mesh, sharp=str(tmp_path / "words.txt"))
    with pytest.raises(ValueError, match="sharp edges must be pairs of vertices"):
        build("spline", {"plugin": "h2s", "sharp": [[0, 1, 2]]})


@pytest.mark.parametrize("name", ["h2s", "optimal", "c0"])
def test_the_mesh_of_a_cad_part_is_refined(name):
    """CAD faces and sets of the mesh are of no use for the finer levels."""
    plain = hex_box((2, 2, 2))
    faces = np.ones(len(plain.quads), np.int64)
    mesh = replace(plain, cad_face=faces, sets={"cad_LID": np.arange(4)})
    for refine in ({"levels": 1}, {"boxes": [{"box": [0, 0, 0, 0.4, 1, 1]}]}):
        spline = solid(mesh, name, refine=refine)
        assert len(spline.nodes) == len(solid(plain, name, refine=refine).nodes) > 8
