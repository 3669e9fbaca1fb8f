"""Midpoint subdivision: blocks of known polyhedra, and of any convex one."""

import itertools
import logging
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from polycube.errors import MeshingError
from polycube.hexmesh.connectivity import check_conforming, genus, hex_mesh
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.quality import volume
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.plugins.ranking.registration import Registration
from polycube.plugins.structure.midpoint import division
from polycube.plugins.structure.midpoint.cells import convex_cells, joined
from polycube.plugins.structure.midpoint.division import divided
from polycube.plugins.structure.midpoint.polyhedron import polyhedron
from polycube.registry import build
from polycube.surface import measures
from polycube.types import HexMesh, Tier, TriMesh
from tests.fixtures.machined import bored
from tests.fixtures.polycubes import PRIMITIVES
from tests.fixtures.surfaces import box, torus
from tests.fixtures.surfaces import joined as beside

GOLD = (1 + 5**0.5) / 2
TURN = Rotation.random(random_state=3).as_matrix()
SIGNS = np.array([*itertools.product((-1, 1), repeat=3)], float)


def cyclic(x: float, y: float, z: float) -> np.ndarray:
    """Points with all signs, in the three cyclic orders of the axes."""
    points = SIGNS * [x, y, z]
    return np.unique(np.concatenate([np.roll(points, k, axis=1) for k in range(3)]), axis=0)


def polygon(n: int, height: float) -> np.ndarray:
    angle = 2 * np.pi * np.arange(n) / n
    return np.stack([np.cos(angle), np.sin(angle), np.full(n, height)], axis=1)


SOLIDS = {  # points, blocks, least scaled Jacobian
    "cube": (SIGNS, 8, 1.0),
    "tetrahedron": (SIGNS[[0, 3, 5, 6]], 4, 0.5**0.5),
    "octahedron": (cyclic(1, 0, 0), 16, 0.5),
    "dodecahedron": (np.concatenate([SIGNS, cyclic(0, GOLD, 1 / GOLD)]), 20, 0.761),
    "icosahedron": (cyclic(0, 1, GOLD), 80, 0.688),
    "prism": (np.concatenate([polygon(3, 0), polygon(3, 1)]), 6, 0.75**0.5),
    "pyramid": (np.concatenate([polygon(4, 0), [[0, 0, 1]]]), 8, 0.5),
}


def hull(points: np.ndarray) -> TriMesh:
    found = ConvexHull(points)
    corners = points[found.simplices]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    is_in = np.einsum("fd,fd->f", normals, found.equations[:, :3]) < 0
    faces = np.where(is_in[:, None], found.simplices[:, ::-1], found.simplices)
    used, number = np.unique(faces, return_inverse=True)
    return TriMesh(points[used], number.reshape(-1, 3))


def box_minus_pyramid(n: int, depth: float = 0.4) -> TriMesh:
    """A block of 4 x 4 x 1.5 with a pyramid of n sides cut out of its top."""
    rim, block = polygon(n, 1.5) @ Rotation.from_euler("z", 0.3).as_matrix(), box().vertices
    block = (block - [0.5, 0.5, 0]) * [4, 4, 1.5]
    # the top, between the rim and the four corners in turn
    top = block[block[:, 2] > 1]
    top = top[np.argsort(np.arctan2(top[:, 1], top[:, 0]))]
    inner = np.argsort(np.arctan2(rim[:, 1], rim[:, 0]))
    rim = rim[inner]
    points = np.concatenate([top, top * [1, 1, 0], rim, [[0, 0, 1.5 - depth]]])
    faces = [(4, 6, 5), (4, 7, 6)]
    for k in range(4):
        after = (k + 1) % 4
        faces += [(k, 4 + k, 4 + after), (k, 4 + after, after)]
    for k in range(n):
        faces.append((8 + k, 8 + (k + 1) % n, 8 + n))
    i = j = 0
    turn = [np.unwrap(np.arctan2(p[:, 1], p[:, 0])) for p in (top, rim)]
    turn = [np.append(angle, angle[0] + 2 * np.pi) for angle in turn]
    while i < 4 or j < n:
        if j == n or (i < 4 and turn[0][i + 1] < turn[1][j + 1]):
            faces.append((i % 4, (i + 1) % 4, 8 + j % n))
            i += 1
        else:
            faces.append((i % 4, 8 + (j + 1) % n, 8 + j % n))
            j += 1
    return TriMesh(points, np.array(faces))


def propose(surface: TriMesh, **options):
    config = {"plugin": "midpoint", **options}
    return build("structure", config, grid=(1, 1, 1), primitives=PRIMITIVES)(surface, ())


def blocks_of(surface: TriMesh, **options) -> HexMesh:
    [candidate] = propose(surface, **options)
    return candidate.blocks


def least(mesh: HexMesh) -> float:
    return scaled_jacobian(mesh.vertices, mesh.hexes).min()


def check_fills(blocks: HexMesh, surface: TriMesh) -> None:
    check_conforming(blocks)
    assert genus(blocks) == 0
    assert volume(blocks) == pytest.approx(measures.volume(surface))
    near = 1e-9 * measures.diagonal(surface)
    for corner in surface.vertices:
        assert np.linalg.norm(blocks.vertices - corner, axis=1).min() < near


@pytest.mark.parametrize(("points", "number", "expected"), SOLIDS.values(), ids=SOLIDS)
def test_known_polyhedra_have_known_blocks(points, number, expected):
    surface = hull(20 * points @ TURN + 5)
    blocks = blocks_of(surface)
    check_fills(blocks, surface)
    assert len(blocks.hexes) == number
    assert least(blocks) == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "corners", "edges", "faces"),
    [("octahedron", 6, 12, 8), ("icosahedron", 12, 30, 20), ("pyramid", 5, 8, 5)],
)
def test_corners_edges_and_faces_are_exact_after_subdivision(name, corners, edges, faces):
    surface = hull(SOLIDS[name][0] @ TURN)
    solid = polyhedron(surface, 60)
    surface = replace(surface, region=solid.face + 1)
    [candidate] = propose(surface)
    subdivide = build("meshing/subdivide", {"plugin": "template", "level": 1})
    mesh = subdivide(surface, candidate.polycube, candidate.rough_map, candidate.blocks)
    assert len(mesh.hexes) == 8 * len(candidate.blocks.hexes)
    found = inspect(mesh, surface).features
    assert len(found) == corners + edges + faces
    assert max(each.distance for each in found) < 1e-9
    assert set(mesh.patch.tolist()) == set(solid.face.tolist())


@settings(deadline=None, max_examples=25)
@given(seed=st.integers(0, 10**6), number=st.integers(4, 12))
def test_any_convex_polyhedron_has_valid_blocks(seed, number):
    directions = np.random.default_rng(seed).normal(size=(number, 3))
    surface = hull(directions / np.linalg.norm(directions, axis=1, keepdims=True) + 3)
    normals, (first, second) = measures.face_normals(surface), measures.twins(surface.faces)
    across = np.cross(normals[first // 3], normals[second // 3])
    assume(np.linalg.norm(across, axis=1).min() > 1e-3)
    blocks = hex_mesh(*divided(convex_cells(polyhedron(surface, 60), 6)))
    check_fills(blocks, surface)
    assert least(blocks) > 0


@pytest.mark.parametrize(("sides", "cells", "number"), [(4, 4, 32), (5, 5, 48)])
def test_a_block_minus_a_pyramid_is_divided_at_its_reflex_edges(sides, cells, number):
    surface = box_minus_pyramid(sides)
    assert measures.is_closed(surface.faces) and measures.genus(surface) == 0
    cut = joined(convex_cells(polyhedron(surface, 60), 6))
    assert len(cut.cells) == cells
    blocks = blocks_of(surface)
    check_fills(blocks, surface)
    assert least(blocks) > 0.2


OCTAHEDRON = hull(SOLIDS["octahedron"][0])
ROUND = np.random.default_rng(0).normal(size=(90, 3))
ROUND /= np.linalg.norm(ROUND, axis=1, keepdims=True)


def as_cad(surface: TriMesh, region: np.ndarray) -> TriMesh:
    return replace(surface, region=region)


@pytest.mark.parametrize(
    ("surface", "options", "reason"),
    [
        (torus(), {}, "holes or voids"),
        (bored(), {}, "holes or voids"),
        (beside(box(), box((2, 0, 0), (3, 1, 1))), {}, "holes or voids"),
        (hull(SIGNS), {"corners": 7}, "there are 8 corners, more than 7"),
        (
            box_minus_pyramid(5),
            {"planes": 4},
            "would be cut by 5 planes, more than 4",
        ),
        (hull(ROUND), {}, "there are 90 corners, more than 60"),
        (as_cad(OCTAHEDRON, np.ones(8)), {}, "face 1 is not planar"),
        (as_cad(hull(SIGNS), np.arange(12) + 1), {}, "is in one plane with an adjacent face"),
    ],
)
def test_other_parts_are_refused_with_a_reason(surface, options, reason, caplog):
    caplog.set_level(logging.INFO)
    assert propose(surface, **options) == []
    assert reason in caplog.text


def test_nonconforming_blocks_are_refused_with_a_reason(caplog, monkeypatch):
    caplog.set_level(logging.INFO)

    def doubled(cells):
        vertices, hexes = divided(cells)
        return vertices, hexes[[0, 1, 1]]

    monkeypatch.setattr(division, "divided", doubled)
    assert propose(hull(SIGNS)) == []
    assert "because its cells do not fit" in caplog.text


def test_blocks_use_size_and_max_hexes_and_warn_about_regions():
    surface = OCTAHEDRON
    [candidate] = propose(surface)

    def hexes(**options) -> HexMesh:
        plugin = build("meshing/subdivide", {"plugin": "template", **options})
        return plugin(surface, candidate.polycube, candidate.rough_map, candidate.blocks)

    numbers = [len(hexes(size=size).hexes) for size in (10.0, 0.2, 0.1)]
    assert numbers[0] == 16 < numbers[1] < numbers[2]
    assert len(hexes(size=0.2, finer=2.0).hexes) == numbers[2]
    assert len(hexes(size=10.0, across_wall=5).hexes) == 16 * 3**3
    regions = [{"box": [0, 0, 0, 1, 1, 1], "size": 0.1}]
    assert "regions has no effect" in " ".join(hexes(regions=regions).warnings)
    with pytest.raises(MeshingError, match=r"more than max_hexes 100; size .* is possible"):
        hexes(size=0.1, max_hexes=100)


def test_blocks_are_ranked_first_if_corners_have_four_edges():
    surface = hull(SOLIDS["octahedron"][0] @ TURN)
    [candidate] = propose(surface)
    again = replace(candidate.rough_map, x=candidate.rough_map.x)
    box_alone = replace(candidate, blocks=None, proposal="given", rough_map=again)
    ranked = Registration()(surface, [box_alone, candidate])
    assert [entry.candidate for entry in ranked] == [candidate, box_alone]
    outer = np.unique(ranked[0].hexes.quads)
    off = abs(2 * ranked[0].positions[outer] - 1).max(axis=1)
    assert off == pytest.approx(np.ones(len(outer)))


def test_blocks_have_separate_variants():
    [candidate] = propose(box())
    assert (candidate.tier, candidate.variants) == (Tier.COARSE, "blocks")
