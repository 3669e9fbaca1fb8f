"""Validity and warnings of a mesh, and which of two meshes is better."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.face_groups import facing, measure
from polycube.plugins.acceptance.standard import CRITERIA, Standard
from polycube.types import HexMesh, TriMesh
from tests.fixtures.hexmeshes import hex_beam, hex_box, surface_of
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
    assert found.reaches == pytest.approx(1)
    assert found.key == pytest.approx((0, 0, 0, 0, 0, 0.7 - crowd))
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


def test_the_order_of_the_criteria_is_the_users(mesh, surface):
    """One mesh has a wrong volume, the other a poor hex."""
    swapped = Standard(order=("scaled_jacobian", "validity", "features", "distances"))
    larger = moved(mesh, 1.015 * mesh.vertices)
    skewed = mesh.vertices.copy()
    inner = np.setdiff1d(np.arange(len(skewed)), mesh.quads)[0]
    skewed[inner] += 0.15
    poor = moved(mesh, skewed)
    assert JUDGE(poor, surface).key > JUDGE(larger, surface).key
    assert swapped(poor, surface).key < swapped(larger, surface).key


@pytest.mark.parametrize(
    "options",
    [{"order": CRITERIA[:2]}, {"certify": "nowhere"}, {"least_jacobian": 2.0}],
)
def test_options_are_checked(options):
    with pytest.raises(ValueError, match=next(iter(options))):
        Standard(**options)


def test_certify_everywhere_refuses_hexes_that_are_positive_at_corners_only(mesh, surface):
    bent = mesh.vertices.copy()
    hexa = mesh.hexes[0]
    bent[hexa[6]] = bent[hexa[0]] + 0.36 * (bent[hexa[6]] - bent[hexa[0]])
    tight = moved(mesh, bent)
    corners, everywhere = JUDGE(tight, surface), Standard(certify="everywhere")(tight, surface)
    assert len(everywhere.failures) >= len(corners.failures)


def test_features_of_a_cad_part_are_counted_and_named():
    part, mesh = halved_box(), cut(bar(), 0.25)
    assert JUDGE(mesh, part).key[1] == 0
    shifted = np.interp(mesh.vertices[:, 0], [0, 0.75, 1, 1.25, 2], [0, 0.8, 1.1, 1.3, 2])
    off = moved(mesh, np.column_stack([shifted, mesh.vertices[:, 1:]]))
    found = JUDGE(off, part)
    assert found.is_valid and found.lost == 3 and found.reaches == -np.inf
    times = 0.1 / np.sqrt(6) // JUDGE.features  # by which each is off
    assert found.key[1] == -3 * times < -3
    assert Standard(features=0.03)(off, part).key[1] == -3
    never_fine = Standard(poor_jacobian=1.1)
    assert never_fine(off, part).key[1] == -3 * times - 2
    assert never_fine(mesh, part).key[1] == 0
    assert any(
        w.startswith("3 of 32 points, curves and faces of the CAD model") for w in found.warnings
    )
    assert JUDGE(off, TriMesh(part.vertices, part.faces)).key[1] == 0  # no CAD faces: no curve


def test_a_cad_face_without_a_quad_counts_less_than_any_criterion():
    fine, mesh = hex_box((12, 12, 12)), hex_box((4, 4, 4))
    region = facing(measure(fine.vertices[fine.quads]).normal) + 1
    plain = surface_of(fine, region)
    own = plain.region.copy()
    own[0] = 7  # a triangle of its own, smaller than any quad
    tiny = TriMesh(plain.vertices, plain.faces, own)
    whole, bare = (Standard(features=0.1)(mesh, part) for part in (plain, tiny))
    assert (whole.lost, bare.lost) == (0, 1) and bare.reaches == -np.inf
    assert bare.key[:4] == whole.key[:4] and bare.key < whole.key
    assert "1 CAD face has no quad: cad_face_7" in bare.warnings
