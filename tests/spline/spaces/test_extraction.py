from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.hexmesh.connectivity import (
    edge_valence,
    extraordinary_edges,
    hex_mesh,
    quad_edges,
    unique_rows,
)
from polycube.spline.bezier import bezier_points
from polycube.spline.spaces.extraction import TENSOR, volumetric_spline
from polycube.spline.spaces.sharp_features import creases, single_hex_edges, union
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder

NONE = np.zeros((0, 2), np.int64)
MESHES = {"box": hex_box((3, 2, 4)), "cylinder": hex_cylinder(), "ball": hex_ball()}


@pytest.fixture(params=MESHES)
def mesh(request):
    return MESHES[request.param]


def sharp_of(mesh):
    return union(creases(mesh, np.radians(45)), single_hex_edges(mesh))


@pytest.mark.parametrize("is_sharp", [True, False])
def test_rows_are_convex_weights(mesh, is_sharp):
    rows = volumetric_spline(mesh, sharp_of(mesh) if is_sharp else NONE).extraction
    assert abs(rows.sum(axis=1) - 1).max() < 1e-15 * 4
    assert rows.min() >= 0


@pytest.mark.parametrize("is_sharp", [True, False])
def test_functions_are_linearly_independent(mesh, is_sharp):
    rows = volumetric_spline(mesh, sharp_of(mesh) if is_sharp else NONE).extraction
    assert np.linalg.matrix_rank(rows.toarray()) == len(mesh.vertices)


def test_neighbours_share_their_bezier_nodes(mesh):
    faces = 3 * len(mesh.hexes) + len(mesh.quads) // 2
    edges = len(edge_valence(mesh.hexes)[0])
    count = len(mesh.vertices) + 2 * edges + 4 * faces + 8 * len(mesh.hexes)
    nodes = volumetric_spline(mesh, NONE).nodes
    assert np.array_equal(np.unique(nodes), np.arange(count))


def test_regular_interior_is_the_uniform_cubic_b_spline():
    mesh = hex_box((5, 5, 5))
    spline = volumetric_spline(mesh, NONE)
    line = np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6
    middle = 62  # hex (2, 2, 2), whose functions are the vertices 1..4 in each direction
    k, j, i = np.meshgrid(*[np.arange(1, 5)] * 3, indexing="ij")
    functions = ((i * 6 + j) * 6 + k).ravel()
    rows = spline.extraction[spline.nodes[middle]].toarray()
    expected = np.zeros_like(rows)
    expected[:, functions] = np.kron(line, np.kron(line, line))
    assert rows == pytest.approx(expected, abs=1e-15)


def test_box_with_sharp_edges_is_the_tensor_product_of_natural_splines():
    mesh = hex_box((4, 4, 4))
    spline = volumetric_spline(mesh, sharp_of(mesh))
    line = np.array([[6, 0, 0, 0, 0], [4, 2, 0, 0, 0], [2, 4, 0, 0, 0], [1, 4, 1, 0, 0]]) / 6
    rows = spline.extraction[spline.nodes[0]].toarray().reshape(4, 4, 4, 5, 5, 5)
    expected = np.einsum("kc,jb,ia->kjiabc", line, line, line)  # z, y, x; vertices x slowest
    assert rows == pytest.approx(expected, abs=1e-15)


def test_affine_boxes_are_reproduced():
    mesh = hex_box((3, 2, 2))
    matrix = np.array([[2.0, 0.3, 0.1], [0.0, 1.0, 0.4], [0.2, 0.0, 3.0]])
    spline = volumetric_spline(mesh, sharp_of(mesh))
    points = bezier_points(spline) @ matrix.T
    thirds = np.stack(np.meshgrid(*[np.arange(4) / 3] * 3, indexing="ij"), -1)
    thirds = thirds.reshape(-1, 3)[:, ::-1]  # x fastest
    low = mesh.vertices[mesh.hexes[:, 0]]
    expected = (low[:, None] + thirds / [3, 2, 2]) @ matrix.T
    assert points == pytest.approx(expected, abs=1e-14)


def reference_extraction(mesh, sharp, corners=()):
    """The extraction computed node by node, from its definition."""
    sharp = {tuple(sorted(edge)) for edge in sharp.tolist()}
    degree = {v: sum(v in edge for edge in sharp) for v in range(len(mesh.vertices))}
    tips = {v for v, n in degree.items() if n not in (0, 2)} | set(corners)
    grids = [mesh.hexes[h, TENSOR].reshape(2, 2, 2).T for h in range(len(mesh.hexes))]
    quads = {frozenset(q) for q in mesh.quads.tolist()}
    cells = {3: [], 2: [], 1: [], 0: []}
    for grid in grids:
        cells[3].append(grid)
        for axis, side in product(range(3), range(2)):
            face = np.take(grid, side, axis)
            if frozenset(face.ravel().tolist()) in quads:
                cells[2].append(face)
    cells[1] = [np.array(edge) for edge in sharp]
    cells[0] = [np.array(v) for v in tips]

    def row(entity, corner):
        d = next(d for d in range(4) if any(entity <= set(c.ravel().tolist()) for c in cells[d]))
        round_it = [c for c in cells[d] if entity <= set(c.ravel().tolist())]
        out = np.zeros(len(mesh.vertices))
        for cell in round_it:
            here = np.argwhere(cell == corner)[0] if d else np.zeros(0, int)
            for place in np.ndindex(*cell.shape):
                m = int((np.array(place) != here).sum())
                out[cell[place]] += (2 / 3) ** (d - m) * (1 / 3) ** m / len(round_it)
        return out

    rows = np.zeros((len(grids), 64, len(mesh.vertices)))
    for h, grid in enumerate(grids):
        for k, j, i in np.ndindex(4, 4, 4):
            span = [[0] if n == 0 else [1] if n == 3 else [0, 1] for n in (i, j, k)]
            entity = {int(grid[place]) for place in product(*span)}
            rows[h, i + 4 * j + 16 * k] = row(entity, grid[i // 2, j // 2, k // 2])
    return rows


@pytest.mark.parametrize("name", ["cylinder", "box"])
def test_agrees_with_the_definition(name):
    mesh = {"cylinder": hex_cylinder(1, 2, 2), "box": hex_box((2, 1, 2))}[name]
    sharp = sharp_of(mesh)[::2]  # curves, ends and corners of all kinds
    spline = volumetric_spline(mesh, sharp, [0])
    rows = spline.extraction[spline.nodes.ravel()].toarray()
    assert rows.reshape(-1, 64, rows.shape[1]) == pytest.approx(
        reference_extraction(mesh, sharp, [0]), abs=1e-15
    )


def interior_faces(spline):
    """Node layers 0, 1, 2 (16,) of both elements at each interior face, in matching order."""
    found = {}
    for element in spline.nodes.reshape(-1, 4, 4, 4):
        for axis, side in product(range(3), range(2)):
            layers = np.moveaxis(element, axis, 0)[:: -1 if side else 1].reshape(4, 16)
            layers = layers[:, layers[0].argsort()]
            found.setdefault(tuple(layers[0].tolist()), []).append(layers)
    return {face: pair for face, pair in found.items() if len(pair) == 2}


def jumps(spline, pair):
    """Largest jump of the first and second derivative over all functions."""
    a, b = (spline.extraction[layers[:3].ravel()].toarray().reshape(3, 16, -1) for layers in pair)
    first = abs((a[1] - a[0]) + (b[1] - b[0])).max()
    second = abs((a[2] - 2 * a[1] + a[0]) - (b[2] - 2 * b[1] + b[0])).max()
    return first, second


@pytest.mark.parametrize("solid", [hex_cylinder(2, 3, 3), hex_ball(3)], ids=["cylinder", "ball"])
def test_smooth_except_at_faces_of_extraordinary_edges(solid):
    spline = volumetric_spline(solid, NONE)
    inside, outside = extraordinary_edges(solid)
    rough = {tuple(edge) for edge in np.concatenate([inside, outside]).tolist()}
    assert spline.extraordinary_edges == len(inside) > 0
    corner_nodes = len(solid.vertices)  # the first nodes are the vertices
    n_rough = 0
    for face, pair in interior_faces(spline).items():
        corners = [node for node in face if node < corner_nodes]
        first, second = jumps(spline, pair)
        if any((a, b) in rough for a in corners for b in corners):
            n_rough += first > 1e-3
        else:
            assert max(first, second) < 1e-14
    assert n_rough > 0


def test_regular_box_is_c2_everywhere():
    mesh = hex_box((3, 3, 3))
    spline = volumetric_spline(mesh, sharp_of(mesh))
    faces = interior_faces(spline)
    assert len(faces) == 54
    assert max(max(jumps(spline, pair)) for pair in faces.values()) < 1e-15 * 2


def test_renumbered_mesh_gives_the_same_solid(mesh):
    order = np.random.default_rng(1).permutation(len(mesh.vertices))
    vertices = np.zeros_like(mesh.vertices)
    vertices[order] = mesh.vertices
    again = hex_mesh(vertices, order[mesh.hexes])
    same = bezier_points(volumetric_spline(again, order[sharp_of(mesh)]))
    assert same == pytest.approx(bezier_points(volumetric_spline(mesh, sharp_of(mesh))), abs=1e-14)


def test_refuses_sharp_edges_off_the_boundary():
    mesh = hex_box((2, 2, 2))
    with pytest.raises(ValueError, match=r"sharp edge \[4, 13\] is not on the boundary"):
        volumetric_spline(mesh, np.array([[13, 4]]))
    with pytest.raises(ValueError, match="1 sharp edges are given twice"):
        volumetric_spline(mesh, np.array([[0, 1], [1, 0]]))
    with pytest.raises(ValueError, match="corner vertex 13 is not on the boundary"):
        volumetric_spline(mesh, NONE, [0, 13])


def test_refuses_vertices_without_a_hex():
    mesh = hex_box((2, 2, 2))
    with pytest.raises(ValueError, match="hex mesh has 1 vertices that no hex uses"):
        volumetric_spline(hex_mesh(np.pad(mesh.vertices, ((0, 1), (0, 0))), mesh.hexes), NONE)


@settings(max_examples=15, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1))
def test_any_choice_of_sharp_edges_gives_independent_convex_weights(seed):
    rng = np.random.default_rng(seed)
    mesh = MESHES["cylinder"]
    edges, _ = quad_edges(mesh.quads)
    sharp = edges[rng.random(len(edges)) < rng.random()]
    tips = rng.choice(np.unique(mesh.quads), 3)
    rows = volumetric_spline(mesh, sharp, tips).extraction
    assert rows.min() >= 0
    assert abs(rows.sum(axis=1) - 1).max() < 1e-15 * 4
    assert np.linalg.matrix_rank(rows.toarray()) == len(mesh.vertices)


def test_control_points_are_the_vertices_and_faces_distinct(mesh):
    spline = volumetric_spline(mesh, NONE)
    assert np.array_equal(spline.control, mesh.vertices)
    _, _, count = unique_rows(np.sort(spline.nodes, axis=1))
    assert (count == 1).all()


LINEAR = np.array([[3, 0], [2, 1], [1, 2], [0, 3]]) / 3
TRILINEAR = np.kron(LINEAR, np.kron(LINEAR, LINEAR))  # (64, 8)


def test_straight_hexes_are_trilinear_and_the_others_unchanged(mesh):
    rng = np.random.default_rng(0)
    mesh = hex_mesh(rng.random(mesh.vertices.shape), mesh.hexes)
    straight = rng.choice(len(mesh.hexes), 3, replace=False)
    plain, found = (volumetric_spline(mesh, sharp_of(mesh), (), s) for s in ([], straight))
    expected = TRILINEAR @ mesh.vertices[mesh.hexes[:, TENSOR]]
    assert bezier_points(found)[straight] == pytest.approx(expected[straight], abs=1e-15)
    shared = np.isin(found.nodes, found.nodes[straight])
    assert np.array_equal(bezier_points(found)[~shared], bezier_points(plain)[~shared])
    assert found.extraction.min() >= 0
    assert abs(found.extraction.sum(axis=1) - 1).max() < 1e-15 * 4
    assert np.linalg.matrix_rank(found.extraction.toarray()) == len(mesh.vertices)


def test_with_all_hexes_straight_the_spline_is_the_mesh(mesh):
    found = volumetric_spline(mesh, NONE, (), np.arange(len(mesh.hexes)))
    expected = TRILINEAR @ mesh.vertices[mesh.hexes[:, TENSOR]]
    assert bezier_points(found) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("elements", [slice(None), slice(3, 7)])
def test_functions_of_an_element_are_those_of_its_nodes(elements):
    spline = volumetric_spline(hex_cylinder(2, 2, 2), NONE)
    found = spline.element_functions(elements)
    for number, nodes in enumerate(spline.nodes[elements]):
        rows = slice(*found.offsets[number : number + 2])
        dense = spline.extraction[nodes].toarray()
        functions = np.flatnonzero(dense.any(axis=0))
        assert found.functions[rows].tolist() == functions.tolist()
        assert (found.coefficients[rows].toarray() == dense[:, functions].T).all()
    assert found.coefficients.has_canonical_format
    assert len(found.offsets) == number + 2
