"""Sweeps: exact hexes of known stacks of slabs, parts that are not swept, and single steps."""

import logging
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from polycube.config import compose
from polycube.errors import InputError
from polycube.hexmesh.background.arrangement import arrangement, simplified
from polycube.hexmesh.background.background import Background, NoBackgroundError
from polycube.hexmesh.background.borders import balanced, equally_round
from polycube.hexmesh.background.cells import loop_area, loops_of
from polycube.hexmesh.background.columns import feet, layers
from polycube.hexmesh.background.curves import Curve, Sizes, divided
from polycube.hexmesh.background.section import section_of
from polycube.hexmesh.background.smoothing import sines, smoothed
from polycube.hexmesh.connectivity import check_conforming, genus
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.quality import volume
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.io.surfaces import read_surface
from polycube.pipeline.proposals import Proposals
from polycube.pipeline.settings import Settings
from polycube.plugins.ranking.registration import Registration
from polycube.plugins.structure.background.stack import _with_further, stack
from polycube.registry import build
from polycube.stages import Clock
from polycube.surface import measures
from polycube.types import Candidate, HexMesh, Tier, TriMesh
from tests.conftest import first_quick
from tests.fixtures import columns
from tests.fixtures.cad_parts import write
from tests.fixtures.columns import check_fills
from tests.fixtures.machined import ELL, GROOVE, SLOT, bored, numbered, pocketed, prism, rod
from tests.fixtures.polycubes import PRIMITIVES
from tests.fixtures.surfaces import box, torus

SIZES = Sizes(size=1.0, chord=0.1, across_wall=2, around_hole=12)
SLOWER = ("diffusion", "labels", "overlay")
TURN = Rotation.random(random_state=3).as_matrix()


def propose(surface: TriMesh, **options) -> list[Candidate]:
    return columns.propose("sweep", surface, **options)


def hexes_of(surface: TriMesh, **options) -> HexMesh:
    [candidate] = propose(surface, **options)
    return candidate.blocks


def placed(surface: TriMesh, scale: float = 1.0) -> TriMesh:
    return replace(surface, vertices=scale * surface.vertices @ TURN.T + 5)


def round_hole(mesh: HexMesh, radius: float) -> int:
    """Number of edges around the hole along z, at the bottom."""
    places = mesh.vertices[np.unique(mesh.quads)]
    on = np.isclose(np.linalg.norm(places[:, :2], axis=1), radius, atol=0.1 * radius)
    return int((on & np.isclose(places[:, 2], places[:, 2].min())).sum())


@pytest.mark.parametrize("scale", first_quick(1, [1.0, 1e-3, 1e3]))
def test_a_box_has_a_regular_mesh(scale):
    surface = placed(numbered(box((0, 0, 0), (4, 2, 1))), scale)
    mesh = hexes_of(surface, size=0.5 * scale, curvature=None)
    assert len(mesh.hexes) == 8 * 4 * 2
    check_fills(mesh, surface, 1e-6, 0.2)
    assert scaled_jacobian(mesh.vertices, mesh.hexes) == pytest.approx(np.ones(64))
    edge = np.linalg.norm(mesh.vertices[mesh.hexes[:, 1]] - mesh.vertices[mesh.hexes[:, 0]], axis=1)
    assert edge == pytest.approx(np.full(64, 0.5 * scale))


@pytest.mark.slow
def test_a_field_of_holes_is_one_section():
    angle = 2 * np.pi * np.arange(48) / 48  # with more lines than a section may have
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    square = 2 * circle / np.abs(circle).max(axis=1, keepdims=True)
    one = np.concatenate([circle, square])
    flat = np.concatenate([one + np.array([4 * i, 4 * j]) for i in range(9) for j in range(8)])
    flat, point = np.unique(flat.round(9), axis=0, return_inverse=True)
    ring = np.array([(k + 48, (k + 1) % 48 + 48, (k + 1) % 48, k) for k in range(48)])
    cells = point.ravel()[(ring + 96 * np.arange(72)[:, None, None]).reshape(-1, 4)]
    surface = prism((flat.tolist(), cells.tolist()))
    off = (surface.vertices[surface.faces][:, :, :2] + 2) % 4 - 2  # from the axis of the hole
    is_round = np.linalg.norm(off, axis=2).max(axis=1) < 1.1
    surface = replace(surface, region=np.where(is_round, 0, surface.region) + 1)
    mesh = hexes_of(surface, size=3.0, around_hole=8, curvature=None)
    check_conforming(mesh)
    assert genus(mesh) == 72 == measures.genus(surface)
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.4
    assert len(mesh.hexes) < 72 * 60


@pytest.mark.slow
def test_the_quads_of_a_narrow_cell_do_not_overlap(tmp_path):
    """Between the circles of a keyed shaft and of its shoulder, rings of both do not fit."""
    surface, _ = read_surface(write("keyed", tmp_path))
    mesh = hexes_of(surface)
    check_conforming(mesh)
    assert genus(mesh) == 0
    assert volume(mesh) == pytest.approx(measures.volume(surface), rel=0.01)


@pytest.mark.parametrize("number", first_quick(1, [8, 12, 16]))
def test_a_hole_has_the_requested_number_of_edges(number):
    mesh = hexes_of(bored(48), size=1.0, around_hole=number, curvature=None)
    check_conforming(mesh)
    assert round_hole(mesh, 1.0) == number
    hole = number / 2 * np.sin(2 * np.pi / number)  # area of the polygon
    assert volume(mesh) == pytest.approx(2 * (16 - hole), rel=2e-3)
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.5


@pytest.mark.slow
def test_edges_on_all_points_of_a_polygon_give_the_exact_volume():
    surface = bored(16)
    mesh = hexes_of(surface, size=1.0, around_hole=16, curvature=None)
    check_fills(mesh, surface, 1e-6, 0.2)


@pytest.mark.parametrize(
    ("surface", "levels"),
    first_quick(
        2,
        [
            (prism(ELL), 2),
            (prism(SLOT), 2),
            (prism(GROOVE), 2),
            (pocketed(), 3),
            (TriMesh(pocketed().vertices, pocketed().faces), 3),
        ],
    ),
    ids=["ell", "slot", "groove", "pocket", "pocket of triangles"],
)
def test_stacks_of_slabs_preserve_volume_corners_edges_and_faces(surface, levels):
    turned = placed(surface)
    assert len(stack(turned, SIZES)[0].levels) == levels
    mesh = hexes_of(turned, size=0.5)
    check_fills(mesh, turned, 1e-6, 0.2)
    for corner in turned.vertices:
        assert np.linalg.norm(mesh.vertices - corner, axis=1).min() < 1e-6
    assert max((each.distance for each in inspect(mesh, turned).features), default=0) < 1e-6


def test_the_rims_of_a_rod_are_mesh_edges():
    mesh = hexes_of(rod(), size=0.4, around_hole=24, curvature=None)
    places = mesh.vertices[np.unique(mesh.quads)]
    assert np.isclose(np.linalg.norm(places[:, :2], axis=1), 1, atol=3e-3).sum() >= 2 * 24
    check_conforming(mesh)
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.5


@pytest.mark.parametrize(
    ("surface", "options", "reason"),
    [
        (torus(), {}, "neither parallel nor perpendicular to an axis"),
        (box(), {"max_hexes": 10}, "more than max_hexes 10"),
    ],
)
def test_other_parts_are_refused_with_a_reason(surface, options, reason, caplog):
    caplog.set_level(logging.INFO)
    assert propose(surface, **options) == []
    assert "sweep: nothing is proposed, because" in caplog.text and reason in caplog.text


def test_an_oblique_curve_on_a_wall_is_refused():
    triangles = box().faces
    with pytest.raises(NoBackgroundError, match="a curve is oblique on the walls"):
        stack(TriMesh(box().vertices, triangles, np.arange(len(triangles)) + 1), SIZES)


@pytest.mark.slow
def test_size_and_level_make_hexes_smaller():
    surface = numbered(box())
    number = {
        name: len(hexes_of(surface, curvature=None, **options).hexes)
        for name, options in {
            "size": {"size": 0.25},
            "level": {"size": 0.5, "level": 1},
            "wall": {"size": 0.5, "across_wall": 4},
        }.items()
    }
    assert number["size"] == number["level"] == 64
    assert number["wall"] >= 16


@pytest.mark.parametrize(
    ("full", "expected"),
    [([[1, 1, 1]], [2, 1, 4]), ([[1, 0, 0], [0, 1, 1]], [3, 1, 4]), ([[0, 1, 0]], [2, 3, 4])],
)
def test_layers_have_the_wanted_thickness_and_least_number_between_caps(full, expected):
    levels = np.array([0.0, 2.0, 2.5, 6.5])
    found = layers(levels, np.array(full, bool), size=1.0, across_wall=3)
    assert found.tolist() == expected


RECTANGLES = st.lists(
    st.tuples(*[st.integers(0, 8)] * 2, *[st.integers(1, 6)] * 2), min_size=1, max_size=5
)


@pytest.mark.slow
def test_each_column_has_one_foot():
    """A pocket of depth 1 in a block of height 2: its columns are lower."""
    mesh = hexes_of(pocketed(), size=0.3)
    quads, number = feet(mesh)
    assert number.sum() == len(mesh.hexes) and len(np.unique(number)) == 2
    assert np.ptp(mesh.vertices[quads][..., 2]) == pytest.approx(0)
    a, b, c, d = np.moveaxis(mesh.vertices[quads], 1, 0)
    area = np.linalg.norm(np.cross(c - a, d - b), axis=1) / 2
    assert area.sum() == pytest.approx(12)
    assert area @ number / number.max() == pytest.approx(volume(mesh) / 2)


@settings(deadline=None, max_examples=50)
@given(RECTANGLES)
def test_lines_of_rectangles_are_one_planar_graph(rectangles):
    """Exact total length of the sides without overlaps, and number of cells by Euler's formula."""
    corners = [[(x, y), (x + w, y), (x + w, y + h), (x, y + h)] for x, y, w, h in rectangles]
    number = np.arange(4 * len(corners)).reshape(-1, 4)
    lines = np.stack([number, np.roll(number, -1, axis=1)], axis=2).reshape(-1, 2)
    points, edges = arrangement(np.reshape(corners, (-1, 2)).astype(float), lines, 1e-6)
    sides = {(a, y, "x") for x, y, w, h in rectangles for y in (y, y + h) for a in range(x, x + w)}
    sides |= {(x, b, "y") for x, y, w, h in rectangles for x in (x, x + w) for b in range(y, y + h)}
    length = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
    assert length.sum() == pytest.approx(len(sides))
    parts = len(np.unique(measures.connected(edges[:, 0], edges[:, 1], len(points))))
    areas = [loop_area(points, edges, loop) for loop in loops_of(points, edges)]
    assert sum(area > 0 for area in areas) == len(edges) - len(points) + parts


@pytest.mark.parametrize("shift", [0.0, 0.005, 0.1, 0.5])
def test_two_polylines_of_one_circle_are_one_loop(shift):
    angle = 2 * np.pi * np.add.outer([0.0, shift], np.arange(48)) / 48
    points = np.stack([np.cos(angle), np.sin(angle)], axis=2).reshape(-1, 2)
    number = np.arange(96).reshape(2, 48)
    lines = np.stack([number, np.roll(number, -1, axis=1)], axis=2).reshape(-1, 2)
    found, edges = arrangement(points, lines, 1e-5)
    assert (np.bincount(edges.ravel()) == 2).all()
    assert np.linalg.norm(found, axis=1) == pytest.approx(np.ones(len(found)), abs=3e-3)
    assert len(loops_of(found, edges)) == 2


def test_ends_that_are_closer_than_the_distance_from_the_curve_are_merged():
    """Between two polylines of one circle with different chords."""
    for near in (1e-5, 1e-4):
        angles = [2 * np.pi * (np.arange(n) + 0.01 * (n == 48)) / n for n in (48, 104)]
        points = np.concatenate([np.stack([np.cos(a), np.sin(a)], axis=1) for a in angles])
        loops = [np.arange(48), 48 + np.arange(104)]
        lines = np.concatenate([np.stack([a, np.roll(a, -1)], axis=1) for a in loops])
        found, edges = arrangement(points, lines, near)
        assert len(loops_of(found, edges)) == 2


@pytest.mark.parametrize(
    ("high", "fine", "along"),
    [*((high, 131, 61) for high in np.linspace(0.18, 0.5, 9).tolist()), (0.5, 100, 93)],
)
def test_lines_cross_two_polylines_of_one_circle_at_the_same_points(high, fine, along):
    """Also if a point of the line is on the longer chord, where the circle is not."""
    x = np.linspace(-1.5, 1.5, along)
    sides = [np.stack([s * x, np.full(along, -s * high)], axis=1) for s in (1, -1)]
    parts = [circle(1.0, 24), circle(1.0, fine), np.concatenate(sides)]
    start = np.cumsum([0, *map(len, parts)])
    loop = [np.arange(a, b) for a, b in pairwise(start)]
    lines = np.concatenate([np.stack([own, np.roll(own, -1)], axis=1) for own in loop])
    points, edges = arrangement(np.concatenate(parts), lines, 1e-5)
    areas = [loop_area(points, edges, own) for own in loops_of(points, edges)]
    assert sum(area > 0 for area in areas) == 5
    assert (np.bincount(edges.ravel()) > 2).sum() == 4


@pytest.mark.parametrize("near", [0.03, 0.06, 0.1])
def test_edges_are_close_to_the_curves_where_a_fillet_runs_out_on_a_rim(near):
    """A spoke with fillets: no edge is farther from them than details, or than a chord was."""
    rim, radius, half, chords = 34.0, 1.74, 3.27, 48
    angle = np.arcsin((half + radius) / (rim - radius))  # at the centre of a fillet
    middle = (rim - radius) * np.array([np.sin(angle), np.cos(angle)])
    turn = np.linspace(np.pi, np.pi / 2 - angle, 15)
    fillet = middle + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    behind = np.array([0.96 * angle, np.arcsin(half / rim), 0.0])
    side = np.concatenate([fillet, rim * np.stack([np.sin(behind), np.cos(behind)], axis=1)])
    spoke = np.concatenate([side, side[-2::-1] * [-1, 1], [[-half, 5], [half, 5]]])
    round_ = 2 * np.pi * np.arange(chords) / chords
    ring = rim * np.stack([np.sin(round_), np.cos(round_)], axis=1)
    numbers = np.arange(chords), chords + np.arange(len(spoke))
    lines = np.concatenate([np.stack([own, np.roll(own, -1)], axis=1) for own in numbers])
    points, edges = arrangement(np.concatenate([ring, spoke]), lines, near)
    x, y = points[edges].mean(axis=1).T
    off_rim = abs(np.hypot(x, y) - rim)
    off_fillet = abs(np.hypot(abs(x) - middle[0], y - middle[1]) - radius)
    on_line = np.isclose(abs(x), half) | np.isclose(y, 5)
    off = np.minimum(off_rim, off_fillet)[~on_line]
    assert off.max() < 1.01 * max(near, rim * (1 - np.cos(np.pi / chords)))


def circle(radius: float, number: int, middle: float = 0.0) -> np.ndarray:
    angle = 2 * np.pi * (np.arange(number) + 0.3) / number
    return np.stack([middle + radius * np.cos(angle), radius * np.sin(angle)], axis=1)


@pytest.mark.parametrize(("narrow", "loops"), [(0.05, 4), (0.11, 3), (0.15, 3)])
def test_two_circles_that_are_closer_than_details_are_one(narrow, loops):
    """Not as a whole, and a circle beside them and a small one keep their places and shapes."""
    parts = [circle(10.1, 225), circle(10.0, 160), circle(5.0, 60), circle(0.5, 40, 7.5)]
    start = np.cumsum([0, *map(len, parts)])
    loop = [np.arange(a, b) for a, b in pairwise(start)]
    lines = np.concatenate([np.stack([own, np.roll(own, -1)], axis=1) for own in loop])
    points = np.concatenate(parts)
    found, edges = arrangement(*simplified(points, lines, 0.05, narrow), 0.05)
    assert (np.bincount(edges.ravel()) == 2).all()
    assert len(loops_of(found, edges)) == 2 * loops
    radius = np.linalg.norm(found, axis=1)
    outer = radius > 9
    assert radius[outer] == pytest.approx(np.full(outer.sum(), 10.05), abs=0.051)
    small = np.linalg.norm(found - [7.5, 0], axis=1)
    assert small[small < 1] == pytest.approx(np.full((small < 1).sum(), 0.5))
    assert (small < 1).sum() >= 12


def test_further_levels_are_taken_from_the_middle_outwards():
    """The one close to an end is kept once its neighbour is there."""
    found = _with_further(np.array([0.0, 7]), [np.array([0.54, 2.07, 4.35, 4.4, 8])])
    assert found.tolist() == [0, 0.54, 2.07, 4.35, 7]


def test_a_further_level_that_is_close_to_one_of_another_face_is_left_out():
    """Its distance from others of its own face decides: 0.5 of 2.4 is close, 0.9 of 2.1 is not."""
    groups = [np.array([2.0, 4.0]), np.array([2.5, 4.9])]
    assert _with_further(np.array([0.0, 7]), groups).tolist() == [0, 2, 4, 4.9, 7]


def test_a_step_has_longer_edges_than_a_wall_of_its_width():
    """Two rings; only the outer one is full in the upper slab, or only the inner one."""
    angle = 2 * np.pi * np.arange(97) / 96
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    circle[-1] = circle[0]
    chains = [Curve(np.zeros(0), r * circle) for r in (4, 5, 5.5)]
    loops = [[[2], [-1]], [[3], [-2]]]
    sizes = Sizes(size=2.0, chord=1.0, across_wall=2, around_hole=4)
    wall, step = (
        divided(chains, loops, np.array(full, bool), sizes)[2][1].min()
        for full in ([[1, 0], [1, 1]], [[1, 1], [1, 0]])
    )
    assert wall == pytest.approx(0.5, rel=0.01) and step == pytest.approx(1.0, rel=0.01)


def test_equal_circles_have_the_largest_of_their_numbers_of_edges():
    angle = 2 * np.pi * np.arange(25) / 24
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    circle[-1] = circle[0]
    chains = [Curve(np.zeros(0), r * circle + [x, 0]) for r, x in ((1, 0), (2, 9), (1, 5), (1, 8))]
    chains.append(Curve(np.zeros(0), circle[:13] / circle[:13, :1].max() * 2))  # half of a circle
    number = balanced(np.array([8, 16, 12, 8, 4]), equally_round(chains))
    assert number.tolist() == [12, 16, 12, 12, 4]


@given(st.integers(1, 4), st.integers(1, 4), st.randoms())
def test_strips_of_cells_have_the_largest_number_of_edges_of_their_curves(rows, columns, random):
    """In a grid, the curves across a row or a column of cells are equal, and no others."""
    upright = np.arange(rows * (columns + 1)).reshape(rows, columns + 1, 1)
    flat = upright.size + np.arange((rows + 1) * columns).reshape(rows + 1, columns, 1)
    pairs = [(upright[r, c], upright[r, c + 1]) for r in range(rows) for c in range(columns)]
    pairs += [(flat[r, c], flat[r + 1, c]) for r in range(rows) for c in range(columns)]
    number = np.array([2 * random.randint(1, 4) for _ in range(upright.size + flat.size)])
    found = balanced(number, pairs)
    assert (found[upright] == number[upright].max(axis=1, keepdims=True)).all()
    assert (found[flat] == number[flat].max(axis=0)).all()


def test_cells_round_an_axis_stay_coarse_if_their_sides_cannot_be_equal():
    """One of three radial lines has a short further curve, which only one of its cells sees."""
    radial = np.array([0, 3]), np.array([1]), np.array([2]), np.array([0])
    rings = np.arange(4, 10).reshape(2, 3, 1)
    number = np.array([2, 2, 2, 2, 8, 8, 8, 4, 4, 6])
    found = balanced(number, [*pairwise(radial), *zip(*rings, strict=True)])
    assert found.tolist() == [2, 2, 2, 2, 8, 8, 8, 8, 8, 8]


def test_a_side_stays_coarse_if_it_would_need_many_more_edges():
    found = balanced(np.array([2, 40]), [(np.array([0]), np.array([1]))])
    assert found.tolist() == [2, 40]


def test_smoothing_unfolds_quads_and_does_not_move_others():
    grid = np.stack(np.meshgrid(np.arange(6.0), np.arange(5.0), indexing="ij"), axis=-1)
    number = np.arange(30).reshape(6, 5)
    quads = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1)
    quads, places = quads.reshape(-1, 4), grid.reshape(-1, 2)
    is_free = ((places > 0) & (places < [5, 4])).all(axis=1)
    thrown = places + is_free[:, None] * np.random.default_rng(0).uniform(-2, 2, places.shape)
    assert sines(thrown, quads).min() < 0
    assert smoothed(thrown, quads, is_free) == pytest.approx(places, abs=0.02)


@pytest.mark.slow
def test_details_are_merged_if_there_are_no_quads_with_them():
    """A chord and two chords of a flat arc, 0.07 % of the diagonal apart, have an edge each."""
    rise = 0.004
    at = [(0, 0), (4, 0), (4, 1), (4, 3), (0, 3), (0, 1), (1, 1), (1.3, 1), (1.15, 1 + rise)]
    ring = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 0)]
    lines = np.array([*ring, (5, 6), (6, 7), (7, 2), (6, 8), (8, 7)])
    levels = np.array([0, 1, 1 + rise, 2])
    part = Background(np.array(at), lines, np.zeros((0, 2)), levels, lambda places: places)
    flat, merged, full = section_of(box((0, 0, 0), (4, 3, 2)), part, SIZES)
    assert merged.levels == pytest.approx([0, 1 + rise / 2, 2])
    assert full.tolist() == [[True, True], [True, True]]
    sine = sines(flat.vertices, flat.quads)
    assert sine.min() > 0.5
    assert not np.isclose(flat.vertices[:, 1], 1 + rise).any()


def test_lines_at_a_tiny_distance_are_merged_although_the_quads_between_them_are_square():
    """0.01 % of the diagonal apart."""
    x = [0, 2, 2.0005, 4, 4, 2.0005, 2, 0]
    ring = [(k, (k + 1) % 8) for k in range(8)]
    lines = np.array([*ring, (1, 6), (2, 5)])
    at = np.column_stack([x, [0] * 4 + [3] * 4])
    part = Background(at, lines, np.zeros((0, 2)), np.array([0.0, 2]), lambda places: places)
    flat, _, full = section_of(box((0, 0, 0), (4, 3, 2)), part, SIZES)
    side = np.linalg.norm(np.diff(flat.vertices[flat.quads], axis=1), axis=2)
    assert side.min() > 0.5 and len(full) == 2


@pytest.mark.slow
def test_merged_details_are_not_taken_if_they_cost_more_quads_than_they_are_worth():
    """A shaft with two flats, whose arcs and chords meet at 32 degrees."""
    radius, flat, chords = 1.995, 1.7, 48
    end = np.arccos(flat / radius)
    straight = np.stack([np.full(63, flat), np.linspace(-1, 1, 63) * radius * np.sin(end)], axis=1)
    turn = np.append(np.arange(-end, end, 0.1), end)
    arc = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    curves = [circle(radius, chords), straight, arc, -straight, -arc]
    ends = np.cumsum([0, *map(len, curves)])
    lines = [
        np.stack([np.arange(a, b - 1), np.arange(a + 1, b)], axis=1) for a, b in pairwise(ends)
    ]
    lines = np.array([*np.concatenate(lines), (chords - 1, 0)])
    marks, levels = np.concatenate([straight[[0, -1]], -straight[[0, -1]]]), np.array([0.0, 6, 33])
    part = Background(np.concatenate(curves), lines, marks, levels, lambda places: places)
    surface = replace(rod(), vertices=rod().vertices * [radius, radius, 16.5])
    section, _, _ = section_of(surface, part, replace(SIZES, size=1.7, chord=0.07))
    assert len(section.quads) < 60


def test_sweeps_are_ranked_by_their_genus_and_have_separate_variants():
    surface = bored(24)
    [candidate] = propose(surface, size=1.0)
    [ranked] = Registration()(surface, [candidate])
    assert ranked.candidate is candidate and genus(ranked.hexes) == 1
    assert (candidate.tier, candidate.variants) == (Tier.EXACT, "sweep")


def test_a_swept_mesh_is_not_divided_again():
    surface = bored(24)
    [candidate] = propose(surface, size=1.0)
    subdivide = build("meshing/subdivide", {"plugin": "template", "level": 0, "size": 0.1})
    mesh = subdivide(surface, candidate.polycube, candidate.rough_map, candidate.blocks)
    assert len(mesh.hexes) == len(candidate.blocks.hexes)


@pytest.mark.slow
def test_without_gmsh_it_is_refused_if_requested_else_omitted(without_gmsh, caplog):
    caplog.set_level(logging.INFO)

    def proposed(*overrides: str) -> list[Candidate]:
        settings = Settings.of(compose("infer", ["mesh=example:rod", *overrides]))
        proposals = Proposals(settings, PRIMITIVES, Registration(), Clock())
        return [each.candidate for tier in proposals.tiers for each in proposals(box(), tier)]

    with pytest.raises(InputError, match=r"structure=sweep .* gmsh, which does not load; pip"):
        proposed("structure=sweep")
    assert proposed(*(f"~structure.proposals.{name}" for name in SLOWER))
    assert "structure=sweep proposes nothing: quads are made by gmsh" in caplog.text
