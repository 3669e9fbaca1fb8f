from itertools import product

import numpy as np
import pytest

from polycube.hexmesh.connectivity import hex_mesh, quad_edges, split
from polycube.spline.bernstein import bernstein, tensor
from polycube.spline.spaces.extraction import TENSOR, bezier_nodes, extraction_matrix
from polycube.spline.spaces.sharp_features import creases, single_hex_edges, union
from polycube.spline.spaces.subdivision import CASTELJAU, ControlMesh, bezier_halves, two_scale
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder

NONE = np.zeros((0, 2), np.int64)
MESHES = {"box": hex_box((3, 2, 4)), "cylinder": hex_cylinder(), "ball": hex_ball()}


def sharp_of(mesh):
    return union(creases(mesh, np.radians(60)), single_hex_edges(mesh))


def test_children_are_the_polynomial_on_their_part_of_the_element():
    points = np.random.default_rng(0).random((64, 3))
    t = np.array([0.0, 0.3, 1.0])
    for child, place in enumerate(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])):
        own = tensor(*[bernstein(t)] * 3) @ CASTELJAU[child] @ points
        x, y, z = (bernstein((t + side) / 2) for side in place)
        assert own == pytest.approx(tensor(x, y, z) @ points, abs=1e-15)


@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
def test_children_have_the_corners_of_their_parent(mesh):
    fine = split(mesh)
    coarse_nodes, _ = bezier_nodes(mesh.hexes[:, TENSOR])
    nodes, _ = bezier_nodes(fine.hexes[:, TENSOR])
    rows = bezier_halves(coarse_nodes, nodes, np.arange(nodes.max() + 1), coarse_nodes.max() + 1)
    line = np.stack(np.meshgrid(*[np.arange(4) / 3] * 3, indexing="ij"), -1).reshape(-1, 3)
    ends = np.stack([1 - line[:, ::-1], line[:, ::-1]], axis=-1)  # (64, 3, 2), x first
    linear = np.einsum("na,nb,nc->ncba", ends[:, 0], ends[:, 1], ends[:, 2]).reshape(64, 8)
    points = np.zeros((coarse_nodes.max() + 1, 3))
    points[coarse_nodes] = linear @ mesh.vertices[mesh.hexes[:, TENSOR]]  # trilinear elements
    corners = (rows @ points)[nodes[:, [0, 3, 12, 15, 48, 51, 60, 63]]]
    assert corners == pytest.approx(fine.vertices[fine.hexes[:, TENSOR]], abs=1e-14)


def reference_two_scale(mesh, sharp, tips):
    """Positions of all new vertices, rule by rule: vertices, edges, faces, hexes, each sorted."""
    x, hexes = mesh.vertices, sorted(tuple(sorted(h)) for h in mesh.hexes.tolist())
    edges, faces = set(), set()
    for hexa in mesh.hexes[:, TENSOR].reshape(-1, 2, 2, 2):
        for axis, side in product(range(3), range(2)):
            face = np.take(hexa, side, axis)
            faces.add(tuple(sorted(face.ravel().tolist())))
            edges |= {tuple(sorted(e.tolist())) for e in (*face, *face.T)}
    edges, faces = sorted(edges), sorted(faces)
    mean = {cell: x[list(cell)].mean(axis=0) for cell in (*edges, *faces, *hexes)}
    boundary = {tuple(sorted(q)) for q in mesh.quads.tolist()}
    sharp = {tuple(sorted(e)) for e in sharp.tolist()}

    def at(cells, entity):
        return [mean[c] for c in cells if set(entity) <= set(c)]

    def average(points):
        return np.mean(points, axis=0)

    out = []
    for v in range(len(x)):
        mine = [e for e in sharp if v in e]
        quads = [q for q in boundary if v in q]
        rims = {e for e in edges if v in e and any(set(e) <= set(q) for q in quads)}
        if len(mine) not in (0, 2) or v in tips:
            out.append(x[v])
        elif mine:
            out.append(sum(mean[e] for e in mine) / 4 + x[v] / 2)
        elif quads:
            n = len(quads)
            out.append((average(at(quads, [v])) + 2 * average([mean[e] for e in rims])) / n)
            out[-1] += (n - 3) / n * x[v]
        else:
            c, a, m = (average(at(cells, [v])) for cells in (hexes, faces, edges))
            out.append((c + 3 * a + 3 * m + x[v]) / 8)
    for e in edges:
        quads = [q for q in boundary if set(e) <= set(q)]
        n = len(at(hexes, e))
        if e in sharp:
            out.append(mean[e])
        elif quads:
            out.append((mean[quads[0]] + mean[quads[1]] + 2 * mean[e]) / 4)
        else:
            c, a = average(at(hexes, e)), average(at(faces, e))
            out.append((c + 2 * a + (n - 3) * mean[e]) / n)
    for f in faces:
        out.append(mean[f] if f in boundary else (sum(at(hexes, f)) + 2 * mean[f]) / 4)
    return np.array(out + [mean[h] for h in hexes])


@pytest.mark.parametrize("name", ["box", "cylinder", "ball"])
def test_agrees_with_the_rules_one_by_one(name):
    rng = np.random.default_rng(3)
    mesh = {"box": hex_box((2, 1, 2)), "cylinder": hex_cylinder(2, 1, 2), "ball": hex_ball(1)}[name]
    mesh = hex_mesh(rng.random(mesh.vertices.shape), mesh.hexes)
    edges, _ = quad_edges(mesh.quads)
    sharp, tips = edges[rng.random(len(edges)) < 0.3], [int(mesh.quads[0, 0])]
    found = two_scale(mesh, sharp, tips) @ mesh.vertices
    assert found == pytest.approx(reference_two_scale(mesh, sharp, tips), abs=1e-14)


@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
def test_rows_sum_to_one_and_flat_boxes_stay(mesh):
    rows = two_scale(mesh, sharp_of(mesh))
    assert abs(rows.sum(axis=1) - 1).max() < 1e-15 * 8
    if len(mesh.hexes) == 24:
        assert rows @ mesh.vertices == pytest.approx(split(mesh).vertices, abs=1e-14)


def test_sharp_edges_and_corners_are_inherited():
    mesh = hex_box((2, 2, 2))
    coarse = ControlMesh(mesh, sharp_of(mesh), np.array([4]))
    fine, _ = coarse.finer(np.arange(8))
    assert len(fine.sharp_edges) == 2 * len(coarse.sharp_edges)
    assert len(creases(fine.mesh, 1.0)) == len(fine.sharp_edges)
    assert set(fine.sharp_edges.ravel()) == set(creases(fine.mesh, 1.0).ravel())
    assert fine.mesh.vertices[fine.corner_vertices] == pytest.approx(mesh.vertices[[4]])


def test_finer_functions_of_a_regular_box_contain_the_coarser_ones():
    mesh = hex_box((3, 2, 3))
    coarse = ControlMesh(mesh, sharp_of(mesh), np.zeros(0, np.int64))
    fine, rows = coarse.finer(np.arange(18))
    halves = bezier_halves(
        coarse.nodes, fine.nodes, np.arange(fine.nodes.max() + 1), coarse.nodes.max() + 1
    )
    assert abs(halves @ coarse.extraction - fine.extraction @ rows).max() < 1e-15


@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
def test_a_part_is_refined_like_the_full_mesh(mesh):
    """Functions, extraction and boundary of the children whose neighbours are all there."""
    coarse = ControlMesh(mesh, sharp_of(mesh), np.zeros(0, np.int64))
    full, rows = coarse.finer(np.arange(len(mesh.hexes)))
    touching = np.isin(mesh.hexes, mesh.hexes[0]).any(axis=1)
    order = np.concatenate([[0], np.setdiff1d(np.flatnonzero(touching), [0])])
    part, some_rows = coarse.finer(order)
    assert part.nodes[:8].shape == (8, 64)
    mine = part.extraction[part.nodes[:8].ravel()] @ some_rows
    expected = full.extraction[full.nodes[:8].ravel()] @ rows
    assert abs(mine - expected).max() < 1e-15
    patches = [
        {tuple(side) for side in space.sides[space.sides[:, 0] < 8].tolist()}
        for space in (part, full)
    ]
    assert patches[0] == patches[1]


def test_two_scale_and_extraction_of_the_finer_mesh_agree():
    mesh = hex_ball()
    fine, _ = ControlMesh(mesh, NONE, np.zeros(0, np.int64)).finer(np.arange(len(mesh.hexes)))
    rows, nodes = extraction_matrix(fine.mesh, NONE)
    assert np.array_equal(nodes, fine.nodes)
    assert abs(rows - fine.extraction).max() == 0


@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
def test_children_of_straight_hexes_are_straight(mesh):
    straight = np.array([1, len(mesh.hexes) - 1])
    coarse = ControlMesh(mesh, sharp_of(mesh), np.zeros(0, np.int64), straight)
    fine, rows = coarse.finer(np.arange(len(mesh.hexes)))
    inside = fine.nodes[np.isin(np.arange(8 * len(mesh.hexes)) // 8, straight)]
    assert np.array_equal(
        fine.straight, [*range(8, 16), *range(8 * straight[1], 8 * straight[1] + 8)]
    )
    halves = bezier_halves(
        coarse.nodes, fine.nodes, np.arange(fine.nodes.max() + 1), coarse.nodes.max() + 1
    )
    gap = abs(halves @ coarse.extraction - fine.extraction @ rows).max(axis=1).toarray().ravel()
    assert gap[inside].max() < 1e-15 * 4
    part, _ = coarse.finer(straight)
    assert np.array_equal(part.straight, np.arange(16))
