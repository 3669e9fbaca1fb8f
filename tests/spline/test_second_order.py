"""Hexes of 20 and 27 nodes: exact geometry, numbering, certificate and straight fallback."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import eye

from polycube.hexmesh.connectivity import FACES, PLACES
from polycube.spline.second_order import (
    EDGE_ENDS,
    PARAMETERS,
    SERENDIPITY,
    STRAIGHT,
    hex_elements,
    positive,
)
from polycube.spline.spaces.subdivision import CASTELJAU
from polycube.types import Spline
from tests.conftest import first_quick
from tests.fixtures.hexmeshes import barrel, hex_box, hex_cylinder
from tests.fixtures.splines import meshed_box, spline_of

NODES = [20, 27]


@pytest.mark.parametrize("nodes", NODES)
def test_nodes_lie_on_the_spline_and_neighbours_share_them(nodes) -> None:
    """Interpolated at the middle of an edge, the spline itself is met."""
    mesh = hex_cylinder()
    spline = spline_of(mesh, "h2s", fit={"rounds": 0})
    found = hex_elements(mesh, spline, nodes)
    assert found.straightened == found.inverted == 0
    n_vertices = len(mesh.vertices)
    edges = {tuple(sorted(e)) for h in mesh.hexes.tolist() for e in np.array(h)[EDGE_ENDS].tolist()}
    faces = {tuple(sorted(f)) for h in mesh.hexes.tolist() for f in np.array(h)[FACES].tolist()}
    more = len(faces) + len(mesh.hexes) if nodes == 27 else 0
    assert len(found.points) == n_vertices + len(edges) + more
    points = (spline.extraction @ spline.control)[spline.nodes]  # (E, 64, 3)
    t = PARAMETERS[:nodes]
    rows = [np.stack([(1 - x) ** 3, 3 * x * (1 - x) ** 2, 3 * x**2 * (1 - x), x**3]) for x in t.T]
    on = np.einsum("ip,jp,kp,ekjid->epd", *rows, points.reshape(-1, 4, 4, 4, 3))
    np.testing.assert_allclose(found.points[found.hexes], on, atol=1e-13)


@pytest.mark.parametrize("nodes", NODES)
def test_nodes_of_quads_are_those_of_their_hexes(nodes) -> None:
    mesh = hex_cylinder()
    found = hex_elements(mesh, None, nodes)
    np.testing.assert_array_equal(found.hexes[:, :8], mesh.hexes)
    np.testing.assert_array_equal(found.quads[:, :4], mesh.quads)
    corners = found.points[found.quads[:, :4]]
    middles = (corners + np.roll(corners, -1, axis=1)) / 2
    np.testing.assert_allclose(found.points[found.quads[:, 4:8]], middles, atol=1e-15)
    if nodes == 27:
        at = found.points[found.quads[:, 8]]
        np.testing.assert_allclose(at, corners.mean(axis=1), atol=1e-15)
    np.testing.assert_array_equal(found.points[: len(mesh.vertices)], mesh.vertices)


def halved(spline: Spline) -> Spline:
    """Every element in eight by de Casteljau's rule, a control point per Bezier node."""
    points = (spline.extraction @ spline.control)[spline.nodes]
    children = (CASTELJAU @ points[:, None]).reshape(-1, 3)
    _, first, nodes = np.unique(children.round(9), axis=0, return_index=True, return_inverse=True)
    return replace(
        spline,
        control=children[first],
        extraction=eye(len(first), format="csr"),
        nodes=nodes.reshape(-1, 64),
        element_hex=np.repeat(spline.element_hex, 8),
        level=np.repeat(spline.level + 1, 8),
    )


@pytest.mark.parametrize("nodes", first_quick(1, NODES))
def test_a_refined_spline_has_the_same_nodes(nodes) -> None:
    mesh = hex_cylinder()
    spline = spline_of(mesh, "h2s", fit={"rounds": 0})
    coarse = hex_elements(mesh, spline, nodes)
    for fine in (halved(spline), halved(halved(spline))):
        found = hex_elements(mesh, fine, nodes)
        assert found.straightened == 0
        np.testing.assert_allclose(found.points, coarse.points, atol=1e-8)


@pytest.mark.parametrize(("listed", "straightened"), [([3], 1), (range(8), 0), ([3, *range(3)], 1)])
def test_hexes_with_elements_of_several_levels_are_straight(listed, straightened, tmp_path) -> None:
    """Of the first hex some children are refined again; or all, in their order or in another."""
    mesh, _ = meshed_box((3, 2, 2), (3.0, 2.0, 2.0))
    rest = [n for n in range(8) if n not in listed] if len(listed) == 4 else []
    lines = ["0 0", *(f"1 {child}" for child in (*listed, *rest))]
    (tmp_path / "elements").write_text("\n".join(lines))
    spline = spline_of(mesh, refine={"elements": str(tmp_path / "elements")})
    assert spline.level.max() == 2
    found = hex_elements(mesh, spline, 27)
    assert (found.straightened, found.inverted) == (straightened, 0)
    np.testing.assert_allclose(found.points, hex_elements(mesh, None, 27).points, atol=1e-9)


def test_serendipity_functions_reproduce_their_polynomials() -> None:
    """1, x, ..., and x^2 y, x y z^2: what 20 nodes have, at the nodes that they have not."""
    for powers in [(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 2), (2, 1, 1), (0, 2, 1)]:
        values = np.prod(PARAMETERS ** np.array(powers), axis=1)
        np.testing.assert_allclose(SERENDIPITY @ values[:20], values, atol=1e-15)
    bubble = np.prod(PARAMETERS * (1 - PARAMETERS), axis=1)
    assert abs(SERENDIPITY @ bubble[:20] - bubble).max() == pytest.approx(1 / 64)


@pytest.mark.parametrize("nodes", NODES)
def test_the_certificate_changes_when_an_edge_node_passes_a_quarter(nodes) -> None:
    """x = xi + 2 t xi (1 - xi) 2 along all four edges: positive while the node is within 1/4."""
    for shift, expected in [(0.2499, True), (-0.2499, True), (0.2501, False), (-0.2501, False)]:
        points = PARAMETERS.copy()
        points[:, 0] += shift * 4 * PARAMETERS[:, 0] * (1 - PARAMETERS[:, 0])
        assert positive(points, np.arange(nodes)[None]).tolist() == [expected]


@pytest.mark.parametrize("nodes", NODES)
def test_the_certificate_agrees_with_dense_sampling(nodes) -> None:
    """No hex is certified that has a sample with det J <= 0; nearly all others are."""
    rng = np.random.default_rng(1)
    points = PARAMETERS[None, :nodes] + rng.uniform(-0.13, 0.13, (200, nodes, 3))
    whole = SERENDIPITY @ points if nodes == 20 else points
    t = np.linspace(0, 1, 9)
    f = np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)], 1)
    d = np.stack([4 * t - 3, 4 - 8 * t, 4 * t - 1], 1)
    i, j, k = np.rint(2 * PARAMETERS).astype(int).T
    slopes = [
        np.einsum("an,bn,cn->abcn", x[:, i], y[:, j], z[:, k]).reshape(-1, 27)
        for x, y, z in [(d, f, f), (f, d, f), (f, f, d)]
    ]
    least = np.linalg.det(np.einsum("aqn,hni->hqia", slopes, whole)).min(axis=1)
    flat = points.reshape(-1, 3)
    found = positive(flat, np.arange(len(flat)).reshape(-1, nodes))
    assert 0.2 < found.mean() < 0.95
    assert not (found & (least <= 0)).any()
    assert (found | (least < 0.02)).all()


@pytest.mark.parametrize("nodes", NODES)
def test_a_folded_hex_gets_straight_edges_and_the_mesh_is_conforming(nodes) -> None:
    """The edge between two hexes' corners is pulled far out: the hexes round it fall back."""
    mesh = barrel((3, 3, 3), 0.2)
    spline = spline_of(mesh, "c0", fit={"rounds": 0})
    curved = hex_elements(mesh, spline, nodes)
    assert curved.straightened == 0
    edge = spline.nodes[13, 1:3]  # between two corners of the hex in the middle
    extraction = spline.extraction.tolil()
    control = np.vstack([spline.control, [[5.0, 5.0, 5.0]]])
    extraction.resize((extraction.shape[0], len(control)))
    extraction[edge] = 0
    extraction[edge, -1] = 1
    folded = replace(spline, control=control, extraction=extraction.tocsr())
    found = hex_elements(mesh, folded, nodes)
    assert found.straightened == 4 and found.inverted == 0
    assert positive(found.points, found.hexes).all()
    at = found.points[found.hexes]
    is_flat = np.abs(at - STRAIGHT[:nodes] @ at[:, :8]).max(axis=(1, 2)) < 1e-14
    round_edge = np.isin(mesh.hexes, mesh.hexes[13, :2]).sum(axis=1) == 2
    np.testing.assert_array_equal(is_flat, round_edge)
    kept = np.setdiff1d(found.hexes, found.hexes[round_edge])
    np.testing.assert_array_equal(found.points[kept], curved.points[kept])


def test_8_nodes_are_those_of_the_mesh() -> None:
    mesh = hex_box((1, 1, 1))
    assert hex_elements(mesh, None, 8).hexes is mesh.hexes


def test_parameters_are_those_of_vtk() -> None:
    cell = pytest.importorskip("vtkmodules.vtkCommonDataModel").vtkTriQuadraticHexahedron()
    at = np.reshape([cell.GetParametricCoords()[i] for i in range(81)], (27, 3))
    np.testing.assert_allclose(PARAMETERS, at)
    np.testing.assert_array_equal(PARAMETERS[:8], PLACES)
