"""Polycubes from labels: each step compared with exact results, then full parts."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycube.plugins.structure.labels.charts import charts, field, stiffness
from polycube.plugins.structure.labels.energy import energy, problem
from polycube.plugins.structure.labels.lattices import CONTROLS, controls
from polycube.plugins.structure.labels.order import first_hit, pairs, spaced
from polycube.plugins.structure.labels.pieces import arcs, pieces
from polycube.registry import build
from polycube.structure.lattice import OUTWARD, boundary, corners, genus, is_manifold
from polycube.structure.rough_map import evaluate
from polycube.surface import measures
from polycube.surface.edge_splits import cut, refined
from polycube.types import Candidate, TriMesh
from tests.fixtures.machined import (
    BLOCK,
    ELL,
    GROOVE,
    NOTCH,
    PASSAGE,
    RAMP,
    SLOT,
    TRIANGLE,
    bored,
    prism,
)
from tests.fixtures.polycubes import PRIMITIVES
from tests.fixtures.surfaces import torus

TURNED = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix()


def proposed(surface: TriMesh, **options: object) -> list[Candidate]:
    config = {"plugin": "labels", **options}
    return build("structure", config, grid=(2, 1, 1), primitives=PRIMITIVES)(surface, ())


def corner_gap(candidate: Candidate, surface: TriMesh) -> float:
    """Largest distance of a corner of the polycube from a vertex of the part, in diagonals."""
    outside = boundary(candidate.polycube)
    placed = evaluate(candidate.rough_map, outside.vertices[corners(outside)])
    gap = np.linalg.norm(placed[:, None] - surface.vertices, axis=2)
    return float(gap.min(axis=1).max() / measures.diagonal(surface))


def nearest(normals: np.ndarray) -> np.ndarray:
    return (normals @ OUTWARD.T).argmax(axis=1)


def test_refining_preserves_a_closed_surface_and_its_shape():
    block = prism(BLOCK)
    vertices, faces, origin = refined(block.vertices, block.faces, 0.5)
    fine = TriMesh(vertices, faces)
    assert measures.is_closed(faces) and len(measures.misoriented_edges(faces)) == 0
    ends = vertices[measures.edges(faces)[0]]
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).max() <= 0.5
    areas = np.bincount(origin, measures.face_areas(fine))
    np.testing.assert_allclose(areas, measures.face_areas(block), rtol=1e-12)


def test_a_cut_divides_the_chosen_faces_only():
    block = prism(BLOCK)
    top = measures.face_normals(block)[:, 2] > 0.5
    vertices, faces, origin = cut(block.vertices, block.faces, top, block.vertices[:, 0] - 1)
    assert measures.is_closed(faces)
    middle = vertices[faces].mean(axis=1)
    areas = measures.face_areas(TriMesh(vertices, faces))
    left = top[origin] & (middle[:, 0] < 1)
    assert areas[left].sum() == pytest.approx(3.0)  # of 12
    assert (vertices[faces[left], 0] <= 1 + 1e-12).all()


def test_a_slanted_plane_has_four_pieces_and_an_axis_parallel_one_has_one():
    found = pieces(prism(RAMP), 0.5)
    counts = np.bincount(np.bincount(found.face))
    assert list(np.flatnonzero(counts)) == [1, 4] and counts[4] == 1
    assert len(np.unique(pieces(prism(BLOCK), 0.5).face)) == 6


@pytest.mark.parametrize(("outline", "faults"), [(BLOCK, 0), (ELL, 0), (SLOT, 0), (PASSAGE, 0)])
def test_the_normals_of_a_polycube_are_labels_without_faults(outline, faults):
    own = pieces(prism(outline), 0.5)
    task = problem(own, arcs(own), 0.0)
    sign = np.full(2 * (own.face.max() + 1), -1)
    blamed = np.zeros(len(own.face), bool)
    cost, found = energy(task, nearest(own.normals), sign, blamed)
    assert found == faults and not blamed.any()
    assert cost == pytest.approx(0, abs=1e-9)


def test_exchanged_labels_of_a_box_are_faults():
    """+x and +z swapped: each has an opposite neighbour, and the loops of others turn wrongly."""
    own = pieces(prism(BLOCK), 0.5)
    task = problem(own, arcs(own), 0.0)
    label = nearest(own.normals)
    swapped = np.where(label == 0, 4, np.where(label == 4, 0, label))
    blamed = np.zeros(6, bool)
    _, faults = energy(task, swapped, np.full(2 * (own.face.max() + 1), -1), blamed)
    assert faults > 2 and blamed.any()


def test_fields_of_a_polycube_are_its_coordinates():
    own = pieces(prism(ELL), 0.4)
    groups = charts(own, nearest(own.normals), True)
    matrix = stiffness(own.surface)
    for axis in range(3):
        place = own.surface.vertices[:, axis]
        one = field(matrix, place, groups.group[axis], groups.number[axis])
        np.testing.assert_allclose(one.values(one.constants), place, atol=1e-6)


def test_charts_that_face_each_other_are_pairs():
    """Of an L 4 x 3 x 2 with legs of 2 and 1."""
    own = pieces(prism(ELL), 0.4)
    groups = charts(own, nearest(own.normals), True)
    where = own.surface.vertices
    found = {
        (
            axis,
            *(round(float(where[groups.group[axis] == g, axis].mean()), 6) for g in (low, high)),
        ): distance
        for axis, low, high, distance, _ in pairs(own, groups)
    }
    expected = {
        (0, 0, 2): 2,
        (0, 0, 4): 4,
        (0, 2, 4): 2,
        (1, 0, 1): 1,
        (1, 0, 3): 3,
        (1, 1, 3): 2,
        (2, 0, 2): 2,
    }
    assert found.keys() == expected.keys()
    for name, distance in expected.items():
        assert found[name] == pytest.approx(distance)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_rays_hit_the_same_triangle_in_their_boxes_as_among_all(axis):
    ring = torus()
    corners = ring.vertices[ring.faces]
    bounds = np.stack([corners.min(axis=1).T, corners.max(axis=1).T])
    everything = np.broadcast_to([[[-np.inf]], [[np.inf]]], bounds.shape)
    middle = corners.mean(axis=1)
    hits = 0
    for face in range(0, len(corners), 7):
        for way in (1.0, -1.0):
            ray = middle[face], axis, way, face
            found = first_hit(corners, bounds, *ray)
            assert found == first_hit(corners, everything, *ray)
            hits += found[0] >= 0
    assert hits > 50


@pytest.mark.slow
def test_a_lattice_with_too_many_bricks_is_not_proposed():
    assert proposed(bored(), bricks=7) == []
    assert proposed(bored(), bricks=9) != []


@pytest.mark.parametrize("knots", [3, 8, 24])
def test_control_planes_are_at_all_knots_and_not_too_many(knots):
    lines = controls([np.linspace(0, 1, knots)] * 3)
    assert all(np.isin(np.arange(knots), line).all() for line in lines)
    assert np.prod([len(line) for line in lines]) <= CONTROLS


def test_values_preserve_their_distances():
    first, second = np.array([0]), np.array([1])
    moved = spaced(np.eye(2), np.zeros(2), first, second, np.array([1.0]))
    np.testing.assert_allclose(moved, [-0.5, 0.5], atol=1e-6)
    heavy = spaced(np.diag([3.0, 1.0]), np.zeros(2), first, second, np.array([1.0]))
    np.testing.assert_allclose(heavy, [-0.25, 0.75], atol=1e-6)
    both = np.array([0, 1]), np.array([1, 0])
    assert spaced(np.eye(2), np.zeros(2), *both, np.array([0.1, 0.1])) is None


@pytest.mark.parametrize(
    ("outline", "shape", "full"),
    [
        (BLOCK, (1, 1, 1), 1),
        (ELL, (1, 2, 2), 3),
        (RAMP, (1, 2, 2), 3),
        (SLOT, (1, 2, 3), 5),
        (PASSAGE, (1, 3, 3), 8),
    ],
)
def test_bricks_of_known_parts(outline, shape, full):
    surface = prism(outline)
    first, *_ = proposed(surface)
    polycube = first.polycube
    assert tuple(sorted(polycube.occupancy.shape)) == shape
    assert polycube.occupancy.sum() == full
    assert is_manifold(polycube) and genus(polycube) == measures.genus(surface)
    patches = len(np.unique(boundary(polycube).patch))
    assert patches == len(np.unique(surface.region))  # each face is one patch
    assert corner_gap(first, surface) < 0.001


@pytest.mark.parametrize("outline", [GROOVE, NOTCH, TRIANGLE])
def test_parts_with_wedges_have_a_lattice(outline):
    """Two walls of a groove, a corner cut off, three walls of a hole: faces take two labels."""
    surface = prism(outline)
    first, *_ = proposed(surface)
    assert is_manifold(first.polycube) and genus(first.polycube) == measures.genus(surface)


def test_a_rotated_part_has_the_same_bricks():
    surface = prism(RAMP)
    turned = TriMesh(surface.vertices @ TURNED.T * 30 + [5, -7, 100], surface.faces)
    first, *_ = proposed(turned)
    assert sorted(first.polycube.occupancy.shape) == [1, 2, 2]
    assert corner_gap(first, turned) < 0.001


def test_the_same_part_gives_the_same_candidates():
    one, other = (proposed(prism(GROOVE)) for _ in range(2))
    assert [c.key for c in one] == [c.key for c in other]
    np.testing.assert_array_equal(one[0].rough_map.positions, other[0].rough_map.positions)


def test_nothing_is_proposed_without_a_full_primitive():
    bare = build("structure", {"plugin": "labels"}, grid=(2, 1, 1), primitives={})
    assert bare(prism(BLOCK), ()) == []


def test_a_round_hole_has_four_charts():
    first, *_ = proposed(bored())
    assert tuple(sorted(first.polycube.occupancy.shape)) == (1, 3, 3)
    assert first.polycube.occupancy.sum() == 8
    assert len(np.unique(boundary(first.polycube).patch)) == 10


def test_a_low_step_and_a_thin_wall_have_bricks():
    """Both are nearer than `apart`: without its own knot the step's face would be lost."""
    points = [(0, 0), (2, 0), (4, 0), (4, 3), (2, 3), (2, 3.05), (0, 3.05)]
    surface = prism((points, [(0, 1, 4, 5, 6), (1, 2, 3, 4)]))
    step, *_ = proposed(surface)
    assert step.polycube.occupancy.sum() == 3
    thin = [(0, 0), (4, 0), (4, 3), (3.9, 3), (3.9, 1), (0, 1)]
    wall, *_ = proposed(prism((thin, [(0, 1, 4, 5), (1, 2, 3, 4)])))
    assert wall.polycube.occupancy.sum() == 3  # 0.1 thick, but its sides face each other


def test_nothing_is_proposed_for_mostly_curved_parts():
    assert proposed(torus()) == []
    assert len(proposed(prism(RAMP), planar=1.0)) > 0


def test_a_ring_is_eight_bricks():
    first, *_ = proposed(torus(), planar=0.0)
    assert tuple(sorted(first.polycube.occupancy.shape)) == (1, 3, 3)
    assert first.polycube.occupancy.sum() == 8


def test_irregular_borders_do_not_reverse_the_order_of_charts():
    """A torus without faces of its own: borders of charts follow its triangles."""
    own = pieces(torus(), 0.3)
    found = pairs(own, charts(own, nearest(own.normals), True))
    assert found
    assert not {pair[:3] for pair in found} & {(pair.axis, pair.high, pair.low) for pair in found}
