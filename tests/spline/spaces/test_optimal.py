"""Splines of the optimal space: rows, continuity, cuts."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline
from scipy.sparse import eye

from polycube.hexmesh.connectivity import neighbours, quad_edges
from polycube.registry import build
from polycube.spline.bernstein import bernstein, tensor
from polycube.spline.spaces.cuts import SIDES, children, cut_faces
from polycube.spline.spaces.extraction import TENSOR, volumetric_spline
from polycube.spline.spaces.optimal import OptimalSpace
from polycube.spline.spaces.sharp_features import single_hex_edges, union
from tests.conftest import first_quick
from tests.fixtures.hexmeshes import CORNERS, hex_ball, hex_box, hex_cylinder, pillowed_cube
from tests.fixtures.hierarchies import space_on

SOLIDS = {
    "box": hex_box((3, 1, 4)),
    "cylinder": hex_cylinder(2, 2, 3),
    "ball": hex_ball(2),
    "lines": pillowed_cube(2),
    "points": pillowed_cube(3),
}


def space_of(mesh, kind="optimal", **options):
    plugin = build("spline", {"plugin": kind, **options})
    return space_on(plugin, mesh)


SPACES = {name: space_of(mesh) for name, mesh in SOLIDS.items()}


@pytest.fixture(params=SPACES)
def space(request):
    return SPACES[request.param]


def values(space, element, point):
    """(C,) all functions at parameters (3,) of an element."""
    basis = tensor(*[bernstein([t]) for t in point])[0]
    return basis @ space.extraction[space.nodes[element]].toarray()


@pytest.mark.parametrize("counts", [(1, 1, 1), (4, 1, 2), (3, 5, 2)])
def test_box_has_the_clamped_b_splines(counts):
    mesh = hex_box(counts, counts)
    space = space_of(mesh)
    rng = np.random.default_rng(0)
    elements, points = rng.integers(len(mesh.hexes), size=300), rng.random((300, 3))
    found = np.array([values(space, e, p) for e, p in zip(elements, points, strict=True)])
    x = points + mesh.vertices[mesh.hexes[elements, 0]]
    lines = []
    for axis, n in enumerate(counts):
        knots = np.concatenate([[0] * 3, np.arange(n + 1), [n] * 3]).astype(float)
        lines.append(BSpline.design_matrix(x[:, axis], knots, 3).toarray())
    expected = np.einsum("pa,pb,pc->pabc", *lines).reshape(300, -1)
    assert found.shape == expected.shape == (300, np.prod(np.add(counts, 3)))
    match = np.argmax(found.T @ expected / np.linalg.norm(expected, axis=0), axis=1)
    assert np.array_equal(np.sort(match), np.arange(len(match)))
    assert found == pytest.approx(expected[:, match], abs=1e-14)


def test_rows_are_convex_weights(space):
    assert abs(space.extraction.sum(axis=1) - 1).max() < 1e-15 * 4
    assert space.extraction.min() >= 0


def test_functions_are_independent(space):
    """A left inverse of the extraction proves it."""
    size = space.extraction.shape[1]
    assert abs(space.inverse @ space.extraction - eye(size)).max() < 1e-14


def test_functions_are_all_tricubics_on_every_hex(space):
    for nodes in space.nodes:
        rows = space.extraction[nodes]
        assert np.linalg.matrix_rank(rows[:, np.unique(rows.indices)].toarray()) == 64


def test_solid_of_h2s_is_in_the_space(space):
    assert space.extraction @ space.control == pytest.approx(space.points, abs=1e-13)


def jumps(space):
    """Side numbers (P,) of interior faces, and the largest jump of two derivatives across each."""
    first, second = neighbours(space.mesh.hexes)
    grid = np.arange(64).reshape(4, 4, 4)
    layers = [
        np.moveaxis(grid, 2 - axis, 0)[:: -1 if side else 1].reshape(4, 16)
        for axis, side in product(range(3), range(2))
    ]
    found = []
    for pair in zip(first, second, strict=True):
        nodes = [space.nodes[face // 6][layers[face % 6]] for face in pair]
        nodes = [rows[:3, rows[0].argsort()] for rows in nodes]
        a, b = (space.extraction[n.ravel()].toarray().reshape(3, 16, -1) for n in nodes)
        slope = abs((a[1] - a[0]) + (b[1] - b[0])).max()
        bend = abs((a[2] - 2 * a[1] + a[0]) - (b[2] - 2 * b[1] + b[0])).max()
        found.append(max(slope, bend))
    return first, np.array(found)


@pytest.mark.parametrize("name", ["box", "cylinder", "lines"])
def test_only_smooth_faces_are_c2(name):
    space = SPACES[name]
    faces, jump = jumps(space)
    smooth = space.smooth.ravel()[faces]
    assert 0 < smooth.sum() and (smooth.all() == (name == "box"))
    assert jump[smooth].max() < 1e-14
    assert (jump[~smooth] > 1e-3).all()


def test_only_faces_at_extraordinary_edges_are_cut():
    mesh = SOLIDS["lines"]
    cut = cut_faces(mesh, single_hex_edges(mesh)).ravel()
    faces, others = neighbours(mesh.hexes)
    assert np.array_equal(cut[faces], cut[others])
    corners = mesh.hexes[:, TENSOR][(faces // 6)[:, None], SIDES[faces % 6]]
    both = np.isin(corners, extraordinary_vertices(mesh)).sum(axis=1) >= 2
    across = np.ptp(mesh.vertices[corners][..., 2], axis=1) == 0  # the lines run along z
    assert np.array_equal(cut[faces], both & ~across)


def extraordinary_vertices(mesh):
    inner = np.setdiff1d(np.arange(len(mesh.vertices)), mesh.quads)
    count = np.bincount(mesh.hexes.ravel())
    odd = inner[count[inner] != 8]
    ground = np.unique(np.round(mesh.vertices[odd, :2], 9), axis=0)
    at = np.round(mesh.vertices[:, :2], 9)
    return np.flatnonzero((at[:, None] == ground).all(axis=-1).any(axis=1))


@pytest.mark.parametrize("name", first_quick(1, ["cylinder", "ball", "points"]))
def test_halved_space_contains_the_space(name):
    coarse = SPACES[name]
    rng = np.random.default_rng(0)
    for _ in range(2):
        fine, two_scale = coarse.finer(np.arange(len(coarse.nodes)))
        assert abs(two_scale.sum(axis=1) - 1).max() < 1e-14
        assert two_scale @ coarse.control == pytest.approx(fine.control, abs=1e-13)
        for element in rng.integers(len(coarse.nodes), size=10):
            point, child = rng.random(3), rng.integers(8)
            here = values(fine, 8 * element + child, point) @ two_scale
            assert here == pytest.approx(
                values(coarse, element, (CORNERS[child] + point) / 2), abs=1e-13
            )
        if len(fine.nodes) > 600:
            break
        coarse = fine


def test_part_of_a_space_is_halved_like_the_full_space():
    coarse = SPACES["points"]
    near = coarse.mesh.vertices[coarse.mesh.hexes].mean(axis=1)[:, 0] < 0.6
    fine, two_scale = coarse.finer(np.flatnonzero(near))
    halves = coarse.halved(np.flatnonzero(near))[1]
    gap = abs(fine.extraction @ two_scale - halves @ coarse.extraction).max(axis=1)
    gap = gap.toarray().ravel()
    rim = np.isin(coarse.nodes[near], coarse.nodes[~near]).any(axis=1)
    assert gap[fine.nodes[np.repeat(~rim, 8)]].max() < 1e-14


def test_halved_hexes_are_smooth_inside():
    coarse = SPACES["lines"]
    fine, _ = coarse.finer(np.arange(len(coarse.nodes)))
    inner = ~children(np.ones_like(coarse.cut))
    assert inner.sum() == 24 * len(coarse.nodes)
    assert not fine.cut[inner].any()


def test_smallest_space_continues_cuts():
    mesh = pillowed_cube(2, 8)
    space = space_of(mesh)
    short = OptimalSpace(mesh, space.points, cut_faces(mesh, single_hex_edges(mesh)))
    assert space.extraction.shape[1] == 3267 < 0.65 * short.extraction.shape[1]
    faces, _ = neighbours(mesh.hexes)
    assert np.array_equal(space.cut.ravel()[faces], ~space.smooth.ravel()[faces])  # all end well
    for one in (space, short):
        test_functions_are_independent(one)
        test_solid_of_h2s_is_in_the_space(one)


@settings(max_examples=8, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1))
def test_properties_hold_for_any_sharp_edges_and_straight_hexes(seed):
    rng = np.random.default_rng(seed)
    mesh = SOLIDS["cylinder"]
    edges, _ = quad_edges(mesh.quads)
    sharp = edges[rng.random(len(edges)) < rng.random()]
    tips = rng.choice(np.unique(mesh.quads), 3)
    straight = rng.choice(len(mesh.hexes), rng.integers(3), replace=False)
    plain = volumetric_spline(mesh, sharp, tips, straight)
    points = plain.extraction @ plain.control
    tips = union(tips, mesh.hexes[straight].ravel())
    space = OptimalSpace(mesh, points, cut_faces(mesh, sharp, tips, rng.choice([0, 1, None])))
    test_rows_are_convex_weights(space)
    test_functions_are_independent(space)
    test_solid_of_h2s_is_in_the_space(space)
    fine, two_scale = space.finer(np.arange(len(mesh.hexes)))
    assert abs(fine.extraction @ two_scale @ space.control - fine.points).max() < 1e-13


def test_cuts_at_a_crease_are_the_faces_behind_it():
    mesh = hex_box((3, 3, 3))
    x = mesh.vertices
    edges, _ = quad_edges(mesh.quads)
    crease = edges[((abs(x[edges][..., :1] - 1 / 3) < 1e-9) & (x[edges][..., 2:] == 1)).all((1, 2))]
    assert len(crease) == 3
    cut = cut_faces(mesh, union(single_hex_edges(mesh), crease))
    plain = cut_faces(mesh, single_hex_edges(mesh))
    assert (cut != plain).sum() == 2 * 3 and plain.sum() == len(mesh.quads)
