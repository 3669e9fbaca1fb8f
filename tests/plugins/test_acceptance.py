"""Validity and warnings of a mesh, and which of two meshes is better."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.face_groups import facing, measure
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.plugins.acceptance.sentences import FORCED, least_jacobian
from polycube.plugins.acceptance.standard import MISSED, Standard
from polycube.types import Goal, HexMesh, TriMesh
from tests.fixtures.hexmeshes import (
    barrel,
    drilled_plate,
    drilled_plate_surface,
    false_friend,
    hex_beam,
    hex_box,
    surface_of,
    unit_cubes,
)
from tests.fixtures.polycubes import bar, cut
from tests.fixtures.surfaces import box as surface_box
from tests.fixtures.surfaces import halved_box

JUDGE = Standard()


@pytest.fixture(scope="module")
def mesh() -> HexMesh:
    return hex_box()


@pytest.fixture(scope="module")
def surface(mesh: HexMesh) -> TriMesh:
    return surface_of(mesh)


def moved(mesh: HexMesh, vertices: np.ndarray) -> HexMesh:
    return replace(mesh, vertices=vertices)


def test_an_exact_mesh_is_valid_and_good(mesh, surface):
    found = JUDGE(mesh, surface)
    assert found.is_valid and not found.warnings
    crowd = 0.01 * np.log2(len(mesh.hexes))
    assert found.shortfall == {} and found.lost == 0
    assert found.key == pytest.approx((0, 0, 0.7 - crowd))
    assert str(found) == "valid"


def test_an_inverted_mesh_is_not_valid_and_worse_than_any_valid_one(mesh, surface):
    inverted = moved(mesh, mesh.vertices * [-1, 1, 1])
    found = JUDGE(inverted, surface)
    assert "scaled Jacobian is -1.000; it must be above 0" in found.failures[0]
    assert str(found).startswith("not valid: the smallest scaled Jacobian is -1.000")
    far = moved(mesh, mesh.vertices * 3)
    assert JUDGE(far, surface).key > found.key and not JUDGE(far, surface).is_valid


def test_a_mesh_whose_boundary_crosses_itself_is_not_valid():
    """Two boxes of perfect hexes that intersect, as one mesh."""
    one = hex_box()
    other = one.vertices + 0.5 * np.ptp(one.vertices, axis=0)
    both = hex_mesh(
        np.vstack([one.vertices, other]), np.vstack([one.hexes, one.hexes + len(other)])
    )
    found = JUDGE(both, surface_box())
    assert any("the boundary intersects itself" in sentence for sentence in found.failures)
    assert found.key[0] <= -2


def test_a_missing_ligament_is_a_warning_although_it_is_small():
    found = JUDGE(hex_beam(cut=True), surface_of(hex_beam()))
    assert found.is_valid
    assert [w for w in found.warnings if w.endswith("of the wall thickness there, 1")]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"least_jacobian": 0.9}, "it must be 0.9 or more"),
        ({"volume_limit": 0.01}, "more than 1% off"),
        ({"distance_limit": 0.001}, "of the diagonal apart, more than 0%"),
    ],
)
def test_limits_beyond_which_a_mesh_is_not_valid(mesh, surface, options, sentence):
    skewed = mesh.vertices + 0.6 * mesh.vertices[:, [1, 2, 0]] * [1, 0, 0]
    found = Standard(**options)(moved(mesh, 1.02 * skewed), surface)
    assert any(sentence in failure for failure in found.failures), found.failures


def bent(mesh: HexMesh, least: float) -> HexMesh:
    """The mesh with an inner vertex moved until the smallest scaled Jacobian is `least`."""
    inner = np.setdiff1d(np.arange(len(mesh.vertices)), mesh.quads)[0]
    low, high = 0.0, 1.0
    for _ in range(50):
        vertices = mesh.vertices.copy()
        vertices[inner] += (low + high) / 2
        is_good = scaled_jacobian(vertices, mesh.hexes).min() > least
        low, high = ((low + high) / 2, high) if is_good else (low, (low + high) / 2)
    return moved(mesh, vertices)


def test_how_far_a_mesh_is_from_the_goal(mesh, surface):
    """Of a surface without CAD faces, and of a part with them."""
    poor = bent(mesh, 0.3)
    missed = MISSED + 1 - 0.3 / 0.6
    assert JUDGE(poor, surface).shortfall == pytest.approx({"scaled_jacobian": missed})
    part = surface_of(mesh, facing(measure(mesh.vertices[mesh.quads]).normal) + 1)
    missed = MISSED + (1 - 0.3 / 0.5) ** 2
    assert JUDGE(poor, part).shortfall == pytest.approx({"scaled_jacobian": missed})
    assert JUDGE(bent(mesh, 0.55), part).shortfall == {}
    larger = moved(mesh, 1.015 * mesh.vertices)  # its vertices are .6 % off, its volume 4.6 %
    missed = JUDGE(larger, surface).shortfall  # and so are its sharp edges
    assert (missed["distances"], missed["warnings"]) == (0.5, 0.25)
    assert 0 < missed["features"] <= 0.25 and 0 < missed["wishes"] <= 0.5 and len(missed) == 4
    assert JUDGE(poor, surface).key > JUDGE(larger, surface).key
    inverted = moved(mesh, mesh.vertices * [-1, 1, 1])
    assert JUDGE(inverted, surface).shortfall["validity"] == 3.0
    assert JUDGE(moved(mesh, 3 * mesh.vertices), surface).shortfall["validity"] == 2.5
    assert JUDGE(bent(mesh, 0.019), surface).shortfall["validity"] == 2.0
    assert "scaled_jacobian" in JUDGE(bent(mesh, 0.019), surface).shortfall


def test_fewer_hexes_are_better_beyond_a_number():
    meshes = [hex_box((n, n, n)) for n in (4, 8)]
    surface = surface_of(meshes[0])
    few, many = (Standard(hexes=64)(each, surface) for each in meshes)
    assert few.shortfall == {} and many.shortfall == pytest.approx({"hexes": 3 * Goal.many})
    assert few.key > many.key


@pytest.mark.parametrize(
    "options", [{"certify": "nowhere"}, {"least_jacobian": 2.0}, {"least_jacobian": -0.1}]
)
def test_options_are_checked(options):
    with pytest.raises(ValueError, match=next(iter(options))):
        Standard(**options)


def test_the_jacobian_is_positive_everywhere_not_at_corners_only():
    friend = false_friend()
    surface = surface_of(friend)
    assert scaled_jacobian(friend.vertices, friend.hexes).min() > 0.35
    sentence = "the Jacobian of 1 of 1 hexes is not positive everywhere; the first is number 0"
    ways = ("everywhere", "corners")
    everywhere, corners = (Standard(certify=way)(friend, surface).failures for way in ways)
    assert everywhere == (sentence, *corners)
    assert JUDGE(friend, surface).failures == everywhere


def test_no_hex_of_a_valid_mesh_is_nearly_flat(mesh, surface):
    found = JUDGE(bent(mesh, 0.019), surface)
    assert found.failures[0] == "the smallest scaled Jacobian is 0.019; it must be 0.02 or more"
    assert JUDGE(bent(mesh, 0.03), surface).is_valid


@pytest.mark.parametrize(("sine", "is_valid"), [(0.012, True), (0.3, False)])
def test_an_acute_angle_of_the_part_permits_flatter_hexes(sine, is_valid):
    """A box that is sheared to this angle; its hexes have the angle's sine, or .011."""
    box = hex_box((2, 2, 2), (40.0, 1.0, 20.0))
    shear = np.sqrt(1 / sine**2 - 1)
    part = surface_of(moved(box, box.vertices + shear * box.vertices[:, [1]] * [1, 0, 0]))
    mesh = bent(moved(box, box.vertices + shear * box.vertices[:, [1]] * [1, 0, 0]), 0.011)
    found = Standard(certify="corners")(mesh, part)
    assert found.is_valid == is_valid, found.failures
    least = FORCED * sine if is_valid else Goal.least_jacobian
    assert least_jacobian(JUDGE, part) == pytest.approx(least, rel=1e-3)


def test_a_square_is_no_round_hole_of_4_mm_in_a_plate_of_300_mm():
    part = drilled_plate_surface()
    square, octagon = (JUDGE(drilled_plate(n), part) for n in (4, 8))
    assert (square.lost, octagon.lost) == (2, 0)  # the rims
    assert "2 of 29 points, curves and faces of the CAD model are lost" in str(square)
    assert "or 20% of their size" in str(square) and "lost" not in str(octagon)
    assert square.shortfall["features"] > 0.1 and "features" not in octagon.shortfall
    assert Standard(feature_share=0.8)(drilled_plate(4), part).lost == 0


def test_a_small_excess_of_few_features_is_within_the_margin():
    part, mesh = halved_box(), cut(bar(), 0.25)
    shifted = np.interp(mesh.vertices[:, 0], [0, 0.75, 1, 1.25, 2], [0, 0.75, 1.0074, 1.25, 2])
    off = moved(mesh, np.column_stack([shifted, mesh.vertices[:, 1:]]))
    found = JUDGE(off, part)  # three of 32 are off by .0074 / sqrt(6), the limit is .003
    assert found.lost == 3 and "features" not in found.shortfall
    strict = Standard(margin=0.0)(off, part)
    assert strict.shortfall["features"] > 0 and found.key > strict.key


def test_lost_details_are_reported_but_do_not_keep_the_search_going():
    part, square = drilled_plate_surface(), drilled_plate(4)
    every, detail = JUDGE(square, part), Standard(detail=0.1)(square, part)
    assert detail.lost == every.lost == 2 and detail.warnings == every.warnings
    assert "features" not in detail.shortfall and detail.key > every.key


@pytest.mark.parametrize(("height", "counts"), [(0.015, True), (0.001, False)])
def test_faces_without_quads_count_only_if_they_are_no_details(height, counts):
    """A block whose boss of this height is missing; the distance is permitted."""
    around = tuple((x, y, 1) for x in range(5) for y in range(5) if (x, y) != (2, 2))
    vertices, cubes = unit_cubes(5, 5, 2, missing=around)
    with_boss = hex_mesh(vertices, cubes)
    middle = with_boss.vertices[with_boss.quads].mean(axis=1)
    region = np.where((middle[:, 2] > 1) & (middle[:, 2] < 2), 2, 1)
    low = with_boss.vertices.copy()
    low[:, 2] = np.where(low[:, 2] > 1, 1 + height, low[:, 2])
    part = surface_of(moved(with_boss, low), region)
    found = Standard(detail=0.001)(hex_mesh(*unit_cubes(5, 5, 1)), part)
    assert "1 CAD face has no quad: cad_face_2" in str(found)
    assert ("features" in found.shortfall) == counts
    assert "warnings" not in found.shortfall


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"at": [{"at": "z_max", "around": 12}]}, "meshing.at: the mesh has 8 edges round z_max"),
        ({"creases": 1e-9}, None),  # the edges of a box are on the edges of the mesh
    ],
)
def test_wishes_are_judged_by_the_mesh(options, sentence, mesh, surface):
    found = Standard(**options)(mesh, surface)
    assert found.is_valid
    assert [w for w in found.warnings if sentence and w.startswith(sentence)] == [
        *found.warnings
    ] and bool(found.warnings) == bool(sentence)
    assert ("wishes" in found.shortfall) == bool(sentence)
    assert (found.key < JUDGE(mesh, surface).key) == bool(sentence)


def test_a_wanted_deviation_and_wanted_creases_are_in_the_shortfall_by_doublings():
    coarse, part = barrel((4, 4, 4), 0.2), surface_of(barrel((4, 4, 32), 0.2))
    free = Standard(creases=None)(coarse, part)
    assert "wishes" not in free.shortfall
    shortfalls = [
        Standard(creases=None, deviation=f"{share}%")(coarse, part).shortfall.get("wishes", 0)
        for share in (50, 0.4, 0.2, 0.01)
    ]
    assert shortfalls[0] == 0 and shortfalls == sorted(shortfalls) and shortfalls[-1] == 0.5
    found = Standard(creases="0.01%")(coarse, part)
    assert found.shortfall["wishes"] > 0 and found.is_valid
    [sentence] = [w for w in found.warnings if w.startswith("meshing.creases")]
    assert sentence.endswith("of the diagonal of the mesh's edges, not within 0.01%")
    assert not [w for w in Standard(creases="auto")(coarse, part).warnings if "creases:" in w]


def test_features_of_a_cad_part_are_counted_and_named():
    part, mesh = halved_box(), cut(bar(), 0.25)
    assert JUDGE(mesh, part).shortfall == {}
    shifted = np.interp(mesh.vertices[:, 0], [0, 0.75, 1, 1.25, 2], [0, 0.8, 1.1, 1.3, 2])
    off = moved(mesh, np.column_stack([shifted, mesh.vertices[:, 1:]]))
    found = JUDGE(off, part)
    assert found.is_valid and found.lost == 3
    share = 3 / 32  # each is off by more than twice the permitted distance, so it counts in full
    assert found.shortfall == pytest.approx({"features": 0.4 + 1.2 * share / (share + 0.1)})
    wider = Standard(features=0.03)(off, part)  # by 36 %
    assert wider.lost == 3
    excess = 0.1 / np.sqrt(6) / 0.03 - 1
    share *= (1 + excess) / 2
    expected = {"features": 0.4 + 1.2 * share / (share + 0.1)}
    assert wider.shortfall == pytest.approx(expected, rel=0.05)
    assert any(
        w.startswith("3 of 32 points, curves and faces of the CAD model") for w in found.warnings
    )
    assert JUDGE(off, TriMesh(part.vertices, part.faces)).lost == 0  # no CAD faces: no curve


def test_a_cad_face_without_a_quad_is_a_lost_feature():
    fine, mesh = hex_box((12, 12, 12)), hex_box((4, 4, 4))
    region = facing(measure(fine.vertices[fine.quads]).normal) + 1
    plain = surface_of(fine, region)
    own = plain.region.copy()
    own[0] = 7  # a triangle of its own, smaller than any quad
    tiny = TriMesh(plain.vertices, plain.faces, own)
    whole, bare = (Standard(features=0.1, feature_share=9)(mesh, part) for part in (plain, tiny))
    assert (whole.lost, bare.lost) == (0, 1)
    assert "features" in bare.shortfall and "features" not in whole.shortfall
    assert bare.key < whole.key
    assert "1 CAD face has no quad: cad_face_7" in bare.warnings
