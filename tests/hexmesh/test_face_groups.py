"""Ends and holes of industrial parts, with exact areas."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.analysis.boundary_sets import quads_of
from polycube.errors import InputError
from polycube.hexmesh.cad_faces import with_sets
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.face_groups import ENDS, ends_and_holes, facing, measure
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.io.hex_meshes import patches
from tests.fixtures import industrial as part
from tests.fixtures.hexmeshes import hex_box, rings, surface_of


def groups(mesh):
    return ends_and_holes(mesh.vertices, mesh.quads, mesh.patch)


def areas(mesh):
    area = measure(mesh.vertices[mesh.quads]).area
    return {name: area[quads].sum() for name, quads in groups(mesh).items()}


def polygon(n, radius):
    """Length and area of a regular polygon."""
    return 2 * n * radius * np.sin(np.pi / n), n / 2 * radius**2 * np.sin(2 * np.pi / n)


@pytest.mark.parametrize("mesh", [part.bracket(), part.bracket(12.0), part.flange()])
def test_the_parts_are_meshes(mesh):
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.3


def test_the_legs_of_a_bracket_are_two_ends():
    mesh = part.bracket()
    outer = part.LEG * part.WIDE
    side = part.LEG**2 - (part.LEG - part.THICK) ** 2
    tip = part.THICK * part.WIDE
    expected = [outer, tip, side, side, outer, tip]
    assert areas(mesh) == pytest.approx(dict(zip(ENDS, expected, strict=True)))
    normal = measure(mesh.vertices[mesh.quads]).normal
    for end, quads in groups(mesh).items():
        assert (facing(normal[quads]) == ENDS.index(end)).all()


def test_a_rounded_bracket_is_cut_in_the_middle_of_its_corner():
    """Two of the four facets of the round corner face each way."""
    radius = 12.0
    found = areas(part.bracket(radius))
    arc = 4 * radius * np.sin(np.pi / 16)
    assert found["x_min"] == pytest.approx((part.LEG - radius + arc) * part.WIDE)
    assert found["z_min"] == pytest.approx(found["x_min"])


def test_a_flange_has_a_bore_and_all_bolt_holes():
    found = areas(part.flange())
    (round_hole, open_hole), (round_bore, open_bore) = (
        polygon(16, part.HOLE),
        polygon(24, part.BORE),
    )
    hole, bore = round_hole * part.PLATE, round_bore * part.HEIGHT
    ends = {
        "z_min": polygon(24, part.RIM)[1] - open_bore - 6 * open_hole,
        "z_max": polygon(24, part.HUB)[1] - open_bore,
    }
    walls = [hole, hole, hole, bore, hole, hole, hole]  # by the x of their middles
    holes = {f"hole_{k}": area for k, area in enumerate(walls, start=1)}
    assert found == pytest.approx(ends | holes)


@pytest.mark.parametrize("mesh", [part.bracket(), part.bracket(12.0), part.flange()])
def test_no_face_has_two_names(mesh):
    numbers = np.concatenate([*groups(mesh).values()])
    assert len(np.unique(numbers)) == len(numbers)


def test_without_patches_a_flange_has_the_same_holes():
    """The mesh of another program, whose boundary is one patch."""
    mesh = part.flange()
    one = hex_mesh(mesh.vertices, mesh.hexes, mesh.quads)
    assert areas(one) == pytest.approx(areas(mesh))


def test_ends_and_holes_of_a_cad_part_are_its_cad_faces():
    """The patches are wrong, as on a mesh that is torn: the CAD faces count."""
    mesh = part.bracket()
    region = np.zeros(len(mesh.quads), np.int64)
    for number, quads in enumerate(groups(mesh).values(), start=1):
        region[quads] = number
    region[region == 0] = 7 + facing(measure(mesh.vertices[mesh.quads]).normal)[region == 0]
    torn = replace(mesh, patch=np.arange(len(mesh.quads)) // 5)
    sets = with_sets(torn, surface_of(mesh, region)).sets
    for number, end in enumerate(ENDS, start=1):
        assert sets[end].tolist() == sets[f"cad_face_{number}"].tolist()


def test_a_face_that_is_not_outermost_is_no_end():
    """A thin rod on a block: its tip is slanted, so that only the block's face looks along it."""
    box = hex_box((4, 3, 3), (4, 3, 3))
    middle = box.vertices[box.hexes].mean(axis=1)
    is_inside = (middle[:, 0] > 2) | (abs(middle[:, 1:] - 1.5) < 0.1).all(axis=1)
    used, hexes = np.unique(box.hexes[is_inside], return_inverse=True)
    points = box.vertices[used] * [3, 1, 1]
    rod = hex_mesh(points, hexes.reshape(-1, 8))
    assert areas(replace(rod, patch=patches(rod)))["x_min"] == pytest.approx(1)
    tip = points[:, 0] == 0
    points[tip, 0] = 2.5 * (points[tip, 1] - 1)
    rod = hex_mesh(points, rod.hexes)
    rod = replace(rod, patch=patches(rod))
    assert set(areas(rod)) == set(ENDS) - {"x_min"}


@pytest.mark.parametrize("n", [3, 4, 5, 16])
def test_a_passage_of_any_section_is_a_hole(n):
    """A prism in a prism; the walls of a triangle do not face each other, but an axis."""
    mesh = rings([1.0, 3.0], n)
    mesh = replace(mesh, patch=patches(mesh))
    found = {name: area for name, area in areas(mesh).items() if name.startswith("hole")}
    assert found == pytest.approx({"hole_1": polygon(n, 1.0)[0] * 0.2})


def test_an_analysis_with_a_missing_end_is_refused():
    mesh = part.flange()
    with pytest.raises(InputError, match="no boundary set 'x_min'; there are z_min, z_max, hole_1"):
        quads_of(replace(mesh, sets=groups(mesh)), "x_min")
