"""Sweeps of parts with leaning faces: these are set upright or flat, and the hexes moved back."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import polycube
from polycube.hexmesh.background.background import NoBackgroundError
from polycube.hexmesh.background.columns import columns as layered
from polycube.hexmesh.background.curves import Sizes
from polycube.hexmesh.background.section import DETAILS, section_of
from polycube.hexmesh.connectivity import check_conforming, genus
from polycube.hexmesh.generation.requests import requests_of
from polycube.hexmesh.generation.requests_met import missing
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.quality import volume
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.io.surfaces import read_surface
from polycube.plugins.structure.background.leaning import between
from polycube.plugins.structure.background.moved_back import moved_back
from polycube.plugins.structure.background.stack import stack
from polycube.plugins.structure.background.upright import Upright, upright
from polycube.surface import measures
from polycube.surface.edge_splits import refined
from polycube.types import HexMesh, TriMesh
from tests.conftest import first_quick
from tests.fixtures import columns
from tests.fixtures.cad_parts import write
from tests.fixtures.columns import check_fills
from tests.fixtures.lofted import CHAMFERED, DRAFTED, SQUARE, inset, lofted
from tests.fixtures.machined import bored, prism, rod
from tests.fixtures.surfaces import torus
from tests.fixtures.turned import revolved

SIZES = Sizes(size=1.0, chord=0.1, across_wall=2, around_hole=12)
UP = np.array([0.0, 0, 1])
TURN = Rotation.random(random_state=5).as_matrix()
COUNTERSUNK = revolved((0, 2), (0, 6), (3, 6), (3, 2.5), (2.5, 2))
SCREW_HOLE = revolved((0, 2), (0, 9), (6, 9), (6, 5), (3, 2))  # a wide cone
SHOULDER = revolved((0, 2), (0, 6), (2, 6), (2.5, 5), (6, 5), (6, 2))
DRILLED = revolved((0, 0), (0, 6), (6, 6), (6, 2), (3, 2), (2, 0))
GROOVED = revolved((0, 2), (0, 6), (2, 6), (3, 5), (4, 6), (6, 6), (6, 2))
ROOF = revolved((0, 5), (0, 6), (1.5, 6), (2, 5.5), (1.5, 5))  # two cones meet


def joined(surface: TriMesh, first: int, last: int) -> TriMesh:
    """A surface with some consecutive faces as one."""
    is_own = (surface.region >= first) & (surface.region <= last)
    return replace(surface, region=np.where(is_own, first, surface.region))


ROUNDED = (2, 6), (2.4, 5.92), (2.71, 5.71), (2.92, 5.4), (3, 5)
FILLETED = joined(revolved((0, 2), (0, 6), *ROUNDED, (3, 2)), 3, 6)
HOLLOW = (2, 6), (2.08, 5.6), (2.29, 5.29), (2.6, 5.08), (3, 5)
HUB = joined(revolved((0, 2), (0, 8), (2, 8), *HOLLOW, (6, 5), (6, 2)), 4, 7)


def set_upright(surface: TriMesh, axis: np.ndarray) -> Upright:
    return upright(surface, measures.twins(surface.faces), axis, 1e-4, SIZES)


def levels_of(part: Upright) -> np.ndarray:
    return np.concatenate(part.levels)


def hexes_of(surface: TriMesh, **options) -> HexMesh:
    [candidate] = columns.propose("sweep", surface, **options)
    return candidate.blocks


def test_hexes_stay_where_no_face_leans():
    """As if single triangles of a plane at the tip of a fillet leaned."""
    surface = bored(24)
    straight = set_upright(surface, np.array([0.0, 0, 1]))
    mesh = hexes_of(surface, size=1.0)
    assert not straight.is_changed.any()
    assert moved_back(mesh, straight, surface) is mesh


@pytest.mark.parametrize("surface", [CHAMFERED, DRAFTED], ids=["chamfers", "drafts"])
def test_the_upper_corners_are_set_over_the_lower_ones(surface):
    part = set_upright(surface, UP)
    wanted = np.tile(SQUARE, (len(surface.vertices) // 4, 1))
    assert part.surface.vertices[:, :2] == pytest.approx(wanted)
    assert np.array_equal(part.surface.vertices[:, 2], surface.vertices[:, 2])
    assert part.is_changed.sum() == 8
    assert np.array_equal(part.is_cap, np.isin(surface.region, [1, 2]))


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.floats(0.2, 1), min_size=4, max_size=9),
    st.floats(0.05, 0.3),
    st.floats(0.1, 1),
    st.booleans(),
)
@pytest.mark.slow
def test_a_convex_part_becomes_the_prism_over_its_widest_polygon(gaps, width, high, is_low):
    angle = 2 * np.pi * np.cumsum(gaps) / np.sum(gaps)
    polygon = 10 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    narrow = (inset(polygon, width), high), (polygon, 5.0)
    rings = [(0, polygon), (5, polygon), (5 + high, inset(polygon, width))]
    if is_low:
        rings = [(0, narrow[0][0]), (high, polygon), (5 + high, polygon)]
    part = set_upright(lofted(*rings), UP).surface
    x, y = polygon.T
    area = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2
    assert measures.volume(part) == pytest.approx((5 + high) * area)


def in_two(surface: TriMesh) -> TriMesh:
    """Its faces divided by a plane through the axis."""
    is_left = surface.vertices[surface.faces].mean(axis=1)[:, 0] < 0
    return replace(surface, region=2 * surface.region - is_left)


@pytest.mark.parametrize("surface", [COUNTERSUNK, in_two(COUNTERSUNK)], ids=["one", "two"])
def test_round_faces_keep_their_angles(surface):
    part = set_upright(surface, UP).surface
    before, after = (np.arctan2(*v[:, :2].T) for v in (surface.vertices, part.vertices))
    assert after == pytest.approx(before, abs=1e-6)
    assert np.unique(np.linalg.norm(part.vertices[:, :2], axis=1).round(6)).tolist() == [2, 6]


def test_a_groove_of_two_cones_is_filled():
    part = set_upright(GROOVED, UP)
    radius = np.linalg.norm(part.surface.vertices[:, :2], axis=1)
    assert np.unique(radius.round(6)).tolist() == [2, 6]
    assert part.is_over.sum() == part.is_changed.sum() == 4 * 48


@pytest.mark.parametrize(
    ("surface", "heights"),
    [(SCREW_HOLE, [0, 6]), (SHOULDER, [0, 2, 6]), (DRILLED, [0, 3, 6])],
    ids=["a wide cone", "between walls", "a tip"],
)
def test_faces_that_cannot_be_walls_become_planes(surface, heights):
    part = set_upright(surface, UP).surface
    assert np.unique(part.vertices[:, 2].round(6)).tolist() == heights
    assert np.array_equal(part.vertices[:, :2], surface.vertices[:, :2])


@pytest.mark.parametrize(
    ("surface", "least", "error"),
    first_quick(
        2,
        [
            (COUNTERSUNK, 0.4, 1e-3),
            (SCREW_HOLE, 0.3, 1e-3),
            (SHOULDER, 0.3, 1e-3),
            (ROOF, 0.5, 1e-3),
            (GROOVED, 0.5, 1e-3),
            (FILLETED, 0.5, 5e-3),  # two chords of its four
        ],
    ),
    ids=["countersunk", "a wide cone", "a shoulder", "a roof", "a groove", "a fillet"],
)
def test_hexes_fill_the_part_and_have_all_its_curves(surface, least, error):
    placed = replace(surface, vertices=3 * surface.vertices @ TURN.T + 7)
    mesh = hexes_of(placed, size="8%", around_hole=48, curvature=None)
    check_fills(mesh, placed, error, least)
    found = inspect(mesh, placed).features
    assert max(feature.distance for feature in found) < error


def test_a_convex_rounding_is_made_square_at_half_its_turn():
    """Its lower half is the wall, its upper half is in the plane of the end."""
    part = set_upright(FILLETED, UP)
    turned = part.is_changed
    wall, end = turned & ~part.is_cap, turned & part.is_cap
    radius = np.linalg.norm(part.surface.vertices[:, :2], axis=1)[part.surface.faces]
    height = part.surface.vertices[:, 2][part.surface.faces]
    assert radius[wall] == pytest.approx(6, rel=1e-3) and height[end] == pytest.approx(3)
    assert np.ptp(height[wall]) == pytest.approx(1) and np.ptp(radius[end]) == pytest.approx(
        1, rel=2e-3
    )
    assert wall.sum() == pytest.approx(end.sum())
    square = revolved((0, 2), (0, 6), (3, 6), (3, 2))
    assert measures.volume(part.surface) == pytest.approx(measures.volume(square), rel=1e-3)


@pytest.mark.parametrize("chord", [0.02, 0.05])
def test_the_chords_beside_the_edge_of_a_square_rounding_are_short_enough(chord):
    """Two of three rows become one; each is half as wide as both, or as the chord permits."""
    turn = np.linspace(0, np.pi / 2, 33)
    round_ = zip(2 + np.sin(turn), 5 + np.cos(turn), strict=True)
    surface = joined(revolved((0, 2), (0, 6), *round_, (3, 2)), 3, 34)
    sizes = replace(SIZES, chord=chord)
    part = upright(surface, measures.twins(surface.faces), UP, 1e-4, sizes)
    radius = np.linalg.norm(surface.vertices[:, :2], axis=1)
    is_own = np.isin(np.arange(len(radius)), surface.faces[part.is_changed])
    angle = np.arctan2(surface.vertices[:, 2] - 2, radius - 5)[is_own]
    height = part.places[is_own, 2]
    order = np.lexsort((height, angle))
    found = np.interp(2 + 1 / 3, height[order], angle[order])
    within = 2 * np.arccos(1 - 0.6 * chord)
    assert found == pytest.approx(np.pi / 4 - max(np.pi / 8, within), abs=0.02)
    even = 2 + np.minimum(angle / (np.pi / 4), 1)
    assert part.surface.vertices[is_own, 2] == pytest.approx(even, abs=0.01)


def test_close_levels_of_two_roundings_become_one():
    """Those of a ring with an inner and an outer rounding whose radii are 1 and 1.1."""
    turn = np.linspace(0, np.pi / 2, 33)
    outer = zip(2 + np.sin(turn), 5 + np.cos(turn), strict=True)
    inner = zip(3 - 1.1 + 1.1 * np.sin(turn), 4.1 - 1.1 * np.cos(turn), strict=True)
    profile = (0, 3), (0, 6), *outer, *reversed(list(inner))
    surface = joined(joined(revolved(*profile), 3, 34), 36, 67)
    sizes = replace(SIZES, chord=0.01)
    found, part = stack(surface, sizes, UP)
    assert len(part.levels) == 2
    for own in part.levels:
        spacing = np.diff(np.r_[own, 3]).min()
        assert abs(own[:, None] - found.levels).min(axis=1).max() < 0.35 * spacing
        assert np.diff(found.levels).min() > 0.25 * spacing


def test_a_concave_rounding_is_set_upright_as_a_whole():
    part = set_upright(HUB, UP)
    assert not part.is_cap[part.is_changed].any()


def test_levels_divide_the_profile_of_a_face_evenly():
    """A rounding that is wider at corners, or has a narrow end, has the levels of an even one.

    So has one whose places over the borders are off along these.
    """
    angle = np.linspace(0, np.pi / 2, 61)
    foot = np.zeros((61, 2))
    width = np.append(np.random.default_rng(3).uniform(0.9, 1.3, 60), 0.1)
    width[:60] /= np.quantile(width, 0.75)
    run = (1 - np.cos(angle)) * width
    for top, off in ((width, 0), (np.ones(61), 0), (np.ones(61), 0.2)):
        along = off * np.random.default_rng(4).uniform(-1, 1, 61)
        at = np.stack([run * top / width, along], axis=1)
        levels, least = between(np.sin(angle), foot, np.stack([top, top * 0], axis=1), at, SIZES)
        assert levels == pytest.approx([np.sqrt(0.5)], abs=0.02) and 1 < least < 2


@pytest.mark.parametrize("share", first_quick(2, DETAILS[::-1]))
def test_vertices_at_merged_details_move_with_their_face(share):
    part, straight = stack(COUNTERSUNK, SIZES, UP)
    flat, part, full = section_of(straight.surface, part, SIZES)
    mesh = layered(flat, part, full, np.ones(len(part.levels) - 1, int))
    places, off = mesh.vertices.copy(), share * measures.diagonal(COUNTERSUNK)
    places[places[:, 2] > 2.9, 2] += off
    moved = moved_back(replace(mesh, vertices=places), straight, COUNTERSUNK).vertices
    assert moved == pytest.approx(moved_back(mesh, straight, COUNTERSUNK).vertices, abs=1.01 * off)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pocket", "rounded_box"])
def test_blocks_with_rounded_corners_are_swept(name, tmp_path):
    """A corner of three roundings has a border, and a tip on the opposite plane."""
    surface, _ = read_surface(write(name, tmp_path))
    mesh = hexes_of(surface)
    check_fills(mesh, surface, 1e-2, 0.1)  # before the fit
    assert len(mesh.hexes) < 5000
    assert max(feature.distance for feature in inspect(mesh, surface).features) < 5e-3


def sloping(slope: float, top: float = 2.0) -> TriMesh:
    """A block 4 x 4 x 2 with a hole; its upper side slopes."""
    surface = bored(48)
    rise = slope * surface.vertices[:, 1] * (surface.vertices[:, 2] == top)
    return replace(surface, vertices=surface.vertices + np.multiply.outer(rise, UP))


@pytest.mark.parametrize("slope", first_quick(1, [0.1, 0.5]))
def test_a_sloping_plane_is_set_flat_at_its_mean_height(slope):
    part = set_upright(sloping(slope), UP).surface
    assert part.vertices == pytest.approx(bored(48).vertices)
    mesh = hexes_of(sloping(slope), size="8%")
    check_fills(mesh, sloping(slope), 5e-3, 0.4)
    assert max(each.distance for each in inspect(mesh, sloping(slope)).features) < 4e-3


def test_a_wedge_is_refused():
    """Its upper side cannot be set flat, as it meets the lower one."""
    surface = sloping(1.0)
    first, of = measures.coincident(surface.vertices, 1e-6)
    faces = of[surface.faces]
    kept = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    wedge = TriMesh(surface.vertices[first], faces[kept], surface.region[kept])
    with pytest.raises(NoBackgroundError, match="a plane is not perpendicular"):
        set_upright(wedge, UP)


@pytest.mark.slow
def test_the_cone_of_a_hexagonal_head_is_set_flat(tmp_path):
    surface, _ = read_surface(write("screw_head", tmp_path))
    mesh = hexes_of(surface)
    check_conforming(mesh)
    assert genus(mesh) == measures.genus(surface) == 0
    assert volume(mesh) == pytest.approx(measures.volume(surface), rel=1e-2)
    assert max(feature.distance for feature in inspect(mesh, surface).features) < 5e-3


def test_a_part_without_leaning_faces_is_not_changed():
    assert stack(bored(), SIZES)[1] is None


@pytest.mark.parametrize("surface", [CHAMFERED, DRAFTED], ids=["chamfers", "drafts"])
def test_a_part_of_planes_is_left_to_polycubes(surface):
    with pytest.raises(NoBackgroundError, match=r"parallel|oblique"):
        stack(surface, SIZES)


def test_a_face_without_borders_at_constant_heights_is_refused():
    ring = torus()
    with pytest.raises(NoBackgroundError, match="a face leans, and has no two borders"):
        set_upright(replace(ring, region=np.ones(len(ring.faces), np.int64)), UP)


def test_a_slightly_conic_hole_that_is_not_level_is_no_hole_across_the_axis():
    surface = revolved((0, 1), (0, 4), (4, 4), (4, 1.12))
    tilted = Rotation.from_rotvec([0, 0.02, 0]).apply([1.0, 0, 0])
    with pytest.raises(NoBackgroundError):
        set_upright(surface, tilted)


@pytest.mark.parametrize("number", [16, 40])
@pytest.mark.parametrize("turn", [0.0, 0.03, 0.4])
def test_a_hole_across_the_axis_becomes_a_square_of_its_area(number, turn):
    """Also if no vertex is at a corner of the square."""
    surface = bored(number)
    radius = np.linalg.norm(surface.vertices[:, :2], axis=1)
    inner = radius < 1.1
    spun = surface.vertices @ Rotation.from_rotvec([0, 0, -turn]).as_matrix()
    surface = replace(surface, vertices=np.where(inner[:, None], spun, surface.vertices))
    part = set_upright(surface, np.array([1.0, 0, 0]))
    square = part.surface.vertices[inner, :2]
    half = np.sqrt(np.pi) / 2 * abs(surface.vertices[inner, :2]).max(axis=0)
    assert measures.volume(part.surface) == pytest.approx(2 * (16 - 4 * half.prod()))
    assert abs(square / half).max(axis=1) == pytest.approx(np.ones(inner.sum()))
    assert len(np.unique(part.surface.region)) == len(np.unique(surface.region)) + 3
    assert levels_of(part) == pytest.approx(half[1] / 3 * np.array([-1, 1]))
    assert part.is_cap[part.is_changed].sum() == pytest.approx(part.is_changed.sum() / 2, abs=8)


@pytest.mark.parametrize("shift", [0.5, 2.0])
@pytest.mark.parametrize("chord", [0.1, 0.02])
def test_chords_at_the_ends_of_a_slot_across_the_axis_are_short_enough(shift, chord):
    """The ends are half circles of radius 1, faces of their own."""
    surface = bored(98)  # no vertex at x = 0
    x, y, z = surface.vertices.T
    inner = np.hypot(x, y) < 1.1
    moved = np.column_stack([x + shift * np.sign(x.round(9)), y, z])
    beyond = moved[surface.faces].mean(axis=1)
    beyond[np.linalg.norm(beyond[:, :2], axis=1) > shift + 1] = 0
    region = surface.region + 100 * (beyond[:, 0] > shift) + 200 * (beyond[:, 0] < -shift)
    surface = TriMesh(moved, surface.faces, region)
    sizes = replace(SIZES, chord=chord, around_hole=4)
    across = np.array([1.0, 0, 0])
    part = upright(surface, measures.twins(surface.faces), across, 1e-4, sizes)
    square = part.surface.vertices[inner]
    side = np.isclose(square[:, 1], square[:, 1].max()) & (z[inner] > 0)
    height, places = square[side, 0], moved[inner][side, :2]
    order = height.argsort()
    marks = np.unique([*levels_of(part), height.min(), height.max(), *height[places[:, 1] > 0.999]])
    corner = [np.interp(marks, height[order], places[order, d]) for d in (0, 1)]
    length = np.hypot(*np.diff(corner, axis=1))
    is_arc = abs(np.diff(corner[1])) > 1e-6
    assert (1 - np.sqrt(1 - (length[is_arc] / 2) ** 2)).max(initial=0) < 1.1 * chord


def test_a_countersink_across_the_axis_is_set_into_the_plane_of_its_border():
    part = set_upright(COUNTERSUNK, np.array([1.0, 0, 0]))
    radius = np.linalg.norm(COUNTERSUNK.vertices[:, :2], axis=1)
    half = np.sqrt(np.pi) / 2 * radius
    for own in (radius < 2.1, abs(radius - 2.5) < 0.1):  # both borders of the cone
        places = part.surface.vertices[own]
        assert abs(places[:, :2]).max(axis=1) == pytest.approx(half[own], rel=1e-6)
        assert places[:, 2] == pytest.approx(np.where(COUNTERSUNK.vertices[own, 2] > 0, 3, 0))


def test_a_conical_bottom_across_the_axis_is_set_into_the_plane_of_its_border():
    part = set_upright(DRILLED, np.array([1.0, 0, 0]))
    radius, height = np.linalg.norm(DRILLED.vertices[:, :2], axis=1), DRILLED.vertices[:, 2]
    is_bottom = (radius < 2.1) & (height > 0) & (height < 4)
    assert part.surface.vertices[is_bottom, 2] == pytest.approx(3)
    [point] = np.flatnonzero(height == 2)
    assert part.surface.vertices[point] == pytest.approx([0, 0, 3])
    assert np.isclose(levels_of(part), 0).any()  # a vertex of the hexes is there


def test_a_block_with_a_drilled_hole_across_the_axis_is_left_to_polycubes():
    """A block of 12 x 12 x 6 around it."""
    places, region = DRILLED.vertices.copy(), DRILLED.region.copy()
    outer = np.linalg.norm(places[:, :2], axis=1) > 5.9
    places[outer, :2] *= 6 / abs(places[outer, :2]).max(axis=1, keepdims=True)
    middle = places[DRILLED.faces].mean(axis=1)
    wall = outer[DRILLED.faces].all(axis=1)
    turn = np.arctan2(middle[wall, 1], middle[wall, 0])
    region[wall] = region.max() + 1 + np.floor(turn / (np.pi / 2) + 0.5) % 4
    block = replace(DRILLED, vertices=places, region=region)
    with pytest.raises(NoBackgroundError, match="polycubes of a block with drilled holes"):
        set_upright(block, np.array([1.0, 0, 0]))
    assert not set_upright(block, UP).is_cap.all()


def test_a_fillet_round_a_hole_across_the_axis_has_as_many_hexes_as_its_chords():
    turn = np.linspace(0, np.pi / 2, 9)
    fillet = zip(2 + np.cos(turn), 3 - np.sin(turn), strict=True)
    surface = joined(revolved((0, 2), (0, 6), (3, 6), *fillet), 4, 11)
    half = np.sqrt(np.pi) / 2 * np.array([2, 3])  # of the squares of the hole and of the border
    for chord, rows in ((0.3, 1), (0.1, 2), (0.04, 3)):
        sizes = replace(SIZES, chord=chord)
        across = np.array([1.0, 0, 0])
        part = upright(surface, measures.twins(surface.faces), across, 1e-4, sizes)
        for number in (2, 3):
            levels, length = np.linspace(*half, number + 1)[1:-1], np.ptp(half) / number
            near = abs(np.abs(levels_of(part))[:, None] - levels).min(axis=0) < 1e-6
            assert near.all() if number == rows else not near.any()
            assert np.isclose(part.fine[:, 2], length).any() == (number == rows)


def test_a_boss_across_the_axis_becomes_a_smaller_square():
    part = set_upright(rod(48), np.array([1.0, 0, 0]))
    half = np.pi / 4 * np.array([1, 1])
    round_ = np.linalg.norm(rod(48).vertices[:, :2], axis=1) > 0.99
    square = part.surface.vertices[round_, :2]
    assert abs(square / half).max(axis=1) == pytest.approx(np.ones(round_.sum()))
    assert measures.volume(part.surface) == pytest.approx(2 * np.pi**2 / 4)
    assert levels_of(part) == pytest.approx(half[1] / 3 * np.array([-1, 1]))


@pytest.mark.parametrize("is_top", [False, True])
@pytest.mark.parametrize("turn", [0.0, 1.0])
def test_a_round_end_becomes_square(turn, is_top):
    """The half disc of radius 1 at x = 1 has the area of the rectangle, which has four corners."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 25)
    end = np.stack([1 + np.cos(angle), np.sin(angle)], axis=1)
    outline = [(-1.0, -1.0), *end.tolist(), (-1.0, 1.0)]
    surface = prism((outline, [range(len(outline))]), 0.0, 2.0)
    middle = surface.vertices[surface.faces].mean(axis=1)
    region = np.where((middle[:, 0] > 1) & (abs(middle[:, 2] - 1) < 0.99), 50, surface.region)
    spin = Rotation.from_rotvec([0, turn, 0]).as_matrix() @ [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    surface = TriMesh(surface.vertices @ np.array(spin).T, surface.faces, region)
    part = set_upright(surface, spin @ np.array([1.0, 0, 0] if is_top else [0, 1.0, 0]))
    flat = part.surface.vertices @ spin
    assert flat[:, 0].max() == pytest.approx(1 + np.pi / 4)
    assert measures.volume(part.surface) == pytest.approx(2 * (4 + np.pi / 2))
    assert levels_of(part) == pytest.approx([1 + np.pi / 8] if is_top else [-1 / 3, 1 / 3])
    assert part.is_cap[region == 50].any()
    assert not part.is_cap[region == 50].all()


@pytest.mark.parametrize("turn", [0.0, np.pi])
def test_a_concave_rounding_from_a_wall_to_the_edge_of_another_becomes_square(turn):
    """It is half a wall, and half a plane at the height of the edge."""
    angle = np.linspace(np.pi / 2, 0, 13)
    hollow = np.stack([6 - 4 * np.sin(angle), 6 - 4 * np.cos(angle)], axis=1)[::-1]
    outline = [(0.0, 0.0), (6.0, 0.0), *hollow.tolist(), (2.0, 8.0), (0.0, 8.0)]
    surface = prism((outline, [range(len(outline))]), 0.0, 3.0)
    surface = joined(surface, 5, 16)
    spin = Rotation.from_rotvec([0, 0, turn]).as_matrix() @ [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    part = set_upright(replace(surface, vertices=surface.vertices @ spin.T), UP)
    assert measures.volume(part.surface) == pytest.approx(3 * (6 * 2 + 2 * 6))
    assert part.is_cap[surface.region == 5].sum() == 12


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "handles", "error", "most"),
    [("countersunk", 4, 0.01, 4000), ("lug", 3, 0.02, 2200), ("tee", 2, 0.09, 4500)],
)
def test_parts_with_bosses_in_other_directions_are_swept(name, handles, error, most, tmp_path):
    """Before the fit, the walls of two equal pipes are too thick where these meet."""
    surface, _ = read_surface(write(name, tmp_path))
    mesh = hexes_of(surface, around_hole=12)
    check_conforming(mesh)
    assert genus(mesh) == measures.genus(surface) == handles
    assert volume(mesh) == pytest.approx(measures.volume(surface), rel=error)
    assert (scaled_jacobian(mesh.vertices, mesh.hexes) < 0.1).mean() < 0.03  # left to the fit
    assert len(mesh.hexes) < most


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bracket", "angle"])
def test_holes_in_both_legs_of_an_angle_are_meshed(name, tmp_path):
    surface, _ = read_surface(write(name, tmp_path))
    mesh = hexes_of(surface, around_hole=12)
    check_fills(mesh, surface, 5e-3, 0.3)
    found = inspect(mesh, surface).features
    assert max(feature.distance for feature in found) < 5e-3
    assert len(mesh.hexes) < 3000


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "most"), [("drilled", 5000), ("bored_wide", 6000), ("tube", 4000)]
)
def test_holes_across_a_round_wall_are_meshed(name, most, tmp_path):
    """Their rims stay on the wall; the hole of a drilled shaft meets its bore in two windows."""
    surface, _ = read_surface(write(name, tmp_path))
    mesh = hexes_of(surface, around_hole=12)
    check_conforming(mesh)
    assert genus(mesh) == measures.genus(surface) == 3
    assert volume(mesh) == pytest.approx(measures.volume(surface), rel=1.5e-2)
    assert (scaled_jacobian(mesh.vertices, mesh.hexes) < 0.1).sum() < 10  # left to the fit
    assert (
        max(feature.distance for feature in inspect(mesh, surface).features) < 6e-3
    )  # before the fit
    assert len(mesh.hexes) < most


@pytest.mark.slow
def test_holes_that_cut_into_an_upright_rounding_become_square(tmp_path):
    """The second one is wider than high, because the rounding begins near its side."""
    surface, _ = read_surface(write("drilled_corner", tmp_path))
    part = set_upright(surface, UP)
    wanted = 44 * (30 * 12 - (1 - np.pi / 4) * 6**2)
    high = np.sqrt(np.pi) / 2 * 4
    for middle, wide in ((22, high), (20.3, 4 * (1 + 3.7 / 4) / 2)):
        x = np.linspace(middle - wide, middle + wide, 10001)
        front = 6 - np.sqrt(36 - np.maximum(x - 24, 0) ** 2)
        wanted -= 2 * high * 2 * wide * (12 - front.mean())
    assert measures.volume(part.surface) == pytest.approx(wanted, rel=5e-4)


@pytest.mark.slow
def test_a_block_with_such_holes_is_swept(tmp_path):
    surface, _ = read_surface(write("drilled_corner", tmp_path))
    moved = polycube.mesh(surface, order=["meshing"]).hexes
    check_fills(moved, surface, 2e-3, 0.4)
    assert genus(moved) == 2 and len(moved.hexes) < 5000
    assert max(feature.distance for feature in inspect(moved, surface).features) < 5e-3


@pytest.mark.slow
def test_the_numbers_of_hexes_at_faces_are_reached(tmp_path):
    surface, _ = read_surface(write("angle", tmp_path))
    requests = [{"at": "hole_1", "around": 16}, {"at": "hole_2", "around": 14}]
    mesh = hexes_of(surface, at=requests)
    assert max(missing(mesh, surface, requests_of(requests))) <= 0


@pytest.mark.parametrize("turn", [0.0, np.pi])
def test_the_back_of_a_rib_becomes_square(turn):
    """Half of it becomes a wall over its lower end, half a plane at the height of its upper end."""
    back = [(12 - 3 * k, 1 + 2 * k) for k in range(4)]
    profile = [(0, 0), (12, 0), *back, (0, 7)]
    surface = prism((profile, [range(7)]))
    vertices, faces, parent = refined(surface.vertices, surface.faces, 2.5)
    surface = TriMesh(vertices[:, [2, 0, 1]], faces, surface.region[parent])
    spun = surface.vertices @ Rotation.from_rotvec([0, turn, 0]).as_matrix()  # or hanging down
    part = set_upright(replace(surface, vertices=spun), UP)
    assert measures.volume(part.surface) == pytest.approx(12 * 7 * 2)
    assert len(part.split) == 1
    assert np.diff(np.sort(levels_of(part))) == pytest.approx(np.full(10, 0.5))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "handles", "off", "least", "fitted", "most"),
    [("ribbed", 1, 5e-3, 0.1, 0.5, 2500), ("eared", 0, 0.03, 0.0, 0.3, 6000)],
)
def test_posts_with_ribs_and_ears_are_swept(name, handles, off, least, fitted, most, tmp_path):
    surface, _ = read_surface(write(name, tmp_path))
    mesh = hexes_of(surface)
    check_fills(mesh, surface, 5e-3, least)  # before the fit
    assert genus(mesh) == handles
    moved = polycube.mesh(surface, order=["meshing"]).hexes
    assert np.array_equal(moved.hexes, mesh.hexes)
    assert scaled_jacobian(moved.vertices, moved.hexes).min() > fitted
    for each, most_off in ((mesh, off), (moved, 5e-3)):
        assert max(feature.distance for feature in inspect(each, surface).features) < most_off
    assert len(mesh.hexes) < most


BLENDS = {
    "blended": 17280,
    "mitred": 17280 - (4 - np.pi) * 3**2 / 4 * 8,
    "cut_edge": 12000 - np.pi * 3**2 * 8,
    "cut_fillet": 8000 + np.pi * 8**2 * 10 - 2 * np.pi * 2**2 * 5,
}


@pytest.mark.parametrize("name", BLENDS)
def test_roundings_that_meet_others_become_square(name, tmp_path):
    """All that is left are blocks, one upright rounding and one hole."""
    surface, _ = read_surface(write(name, tmp_path))
    part = set_upright(surface, UP)
    assert measures.volume(part.surface) == pytest.approx(BLENDS[name], rel=5e-4)
    assert np.ptp(part.surface.vertices, axis=0) == pytest.approx(np.ptp(surface.vertices, axis=0))


@pytest.mark.slow
@pytest.mark.parametrize("name", BLENDS)
def test_parts_with_roundings_that_meet_are_swept(name, tmp_path):
    surface, _ = read_surface(write(name, tmp_path))
    mesh = hexes_of(surface)
    assert (scaled_jacobian(mesh.vertices, mesh.hexes) < 0).sum() < 5  # left to the fit
    moved = polycube.mesh(surface, order=["meshing"]).hexes
    check_fills(moved, surface, 2e-3, 0.4)
    assert len(moved.hexes) < 3000
    assert max(feature.distance for feature in inspect(moved, surface).features) < 5e-3
