"""Surfaces of lattices in small triangles: closed, each triangle in the plane of its label."""

import numpy as np
import pytest

from polycube.diffusion.pairs.any_structure import TRIANGLES, cut, tessellate
from polycube.diffusion.pairs.lattices import random_lattice
from polycube.structure.lattice import boundary, exposed
from polycube.surface.measures import volume
from polycube.types import Polycube, TriMesh

OUTWARD = np.kron(np.eye(3), [[1], [-1]])


def test_pieces_of_a_slab_are_symmetric_and_keep_the_knots() -> None:
    knots = np.array([-1.0, 0.5, 0.75])
    for pieces in (2, 3, 4, 6, 8):
        nodes = cut(knots, pieces)
        assert np.array_equal(nodes[::pieces], knots)
        steps = np.diff(nodes).reshape(2, pieces)
        assert (steps > 0).all()
        assert steps == pytest.approx(steps[:, ::-1])
        assert steps[0] == pytest.approx(6 * steps[1])


@pytest.mark.parametrize("seed", range(8))
def test_a_closed_surface_of_the_right_volume_and_labels(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lattice = random_lattice(rng)
    x, y, z = (np.cumsum(rng.uniform(0.1, 1, n + 1)) for n in lattice.occupancy.shape)
    found = tessellate(lattice.occupancy, (x, y, z))
    assert len(found.faces) <= TRIANGLES
    edges = found.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    assert len(np.unique(edges, axis=0)) == len(edges)  # each is met once in each sense
    assert np.array_equal(np.unique(edges, axis=0), np.unique(edges[:, ::-1], axis=0))
    euler = len(found.vertices) - len(edges) // 2 + len(found.faces)
    assert euler == 2 - 2 * lattice.genus
    widths = np.diff(x)[:, None, None] * np.diff(y)[:, None] * np.diff(z)
    expected = widths[lattice.occupancy].sum()
    assert volume(TriMesh(found.vertices, found.faces)) == pytest.approx(expected)
    a, b, c = found.vertices[found.faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert normals == pytest.approx(OUTWARD[found.axis], abs=1e-9)
    for axis, knots in enumerate((x, y, z)):
        own = found.axis // 2 == axis
        assert np.array_equal(a[own, axis], knots[found.knot[own]])


def test_faces_are_those_of_the_boundary() -> None:
    occupancy = random_lattice(np.random.default_rng(3)).occupancy
    knots = [np.arange(n + 1.0) for n in occupancy.shape]
    slow = boundary(Polycube(occupancy, *knots, (1, 1, 1), ("lattice",)))
    boxes = np.argwhere(occupancy)[slow.box]
    axis, box = exposed(occupancy)
    found = np.unique(np.column_stack([axis, box]), axis=0)
    assert np.array_equal(found, np.unique(np.column_stack([slow.axis, boxes]), axis=0))
