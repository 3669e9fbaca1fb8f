"""Hexes divided into eight: counts, order and positions are known exactly."""

import numpy as np
import pytest

from polycube.hexmesh import connectivity as hexes
from polycube.hexmesh.connectivity import split
from polycube.hexmesh.generation import template
from polycube.hexmesh.quality import volume
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.structure.rough_map import identity_map
from tests.fixtures.polycubes import bar, cut, ring


def test_a_cube_is_divided_into_cubes_of_half_its_size():
    unit = template.mesh(bar(), identity_map(bar()), ([2], [1], [1]))
    fine = split(unit)
    assert len(fine.vertices) == 5 * 3 * 3 and len(fine.hexes) == 16
    assert np.array_equal(fine.vertices[: len(unit.vertices)], unit.vertices)
    corner = fine.vertices[fine.hexes]
    assert np.allclose(corner.max(axis=1) - corner.min(axis=1), 0.5)
    assert scaled_jacobian(fine.vertices, fine.hexes) == pytest.approx(np.ones(16))
    hexes.check_conforming(fine)


def test_twice_on_a_ring():
    coarse = cut(ring(), 1 / 6)
    fine = split(split(coarse))
    assert len(fine.hexes) == 64 * len(coarse.hexes)
    assert hexes.genus(fine) == 1
    assert volume(fine) == pytest.approx(volume(coarse))
    assert np.array_equal(fine.patch, np.repeat(coarse.patch, 16))
    assert np.array_equal(fine.cell, np.repeat(coarse.cell, 64))


def test_children_fill_their_parents():
    rng = np.random.default_rng(0)
    coarse = cut(ring(), 1 / 4)
    bent = hexes.hex_mesh(
        coarse.vertices + rng.normal(0, 0.02, coarse.vertices.shape),
        coarse.hexes,
        coarse.quads,
        coarse.patch,
    )
    fine = split(bent)
    middle = fine.vertices[fine.hexes].mean(axis=1).reshape(-1, 8, 3).mean(axis=1)
    assert np.allclose(middle, bent.vertices[bent.hexes].mean(axis=1))
    middle = fine.vertices[fine.quads].mean(axis=1).reshape(-1, 4, 3).mean(axis=1)
    assert np.allclose(middle, bent.vertices[bent.quads].mean(axis=1))
    a, b, c, d = np.moveaxis(fine.vertices[fine.quads], 1, 0)
    e, f, g, h = np.moveaxis(bent.vertices[bent.quads], 1, 0)
    turn = np.einsum(
        "qd,qd->q", np.cross(c - a, d - b), np.repeat(np.cross(g - e, h - f), 4, axis=0)
    )
    assert (turn > 0).all()
    assert scaled_jacobian(fine.vertices, fine.hexes).min() > 0
