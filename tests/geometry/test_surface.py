"""Measures of a unit cube and of a square ring, whose values are known."""

import numpy as np
import pytest

from polycube.geometry import surface
from polycube.types import TriMesh


def box(low=(0.0, 0.0, 0.0), high=(1.0, 1.0, 1.0)) -> TriMesh:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))]
    return TriMesh(np.where(corners, high, low), faces)


def torus(n: int = 24, m: int = 12) -> TriMesh:
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    r = 2 + 0.5 * np.cos(v)
    points = np.stack([r * np.cos(u), r * np.sin(u), 0.5 * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    at = lambda a, b: (a % n) * m + b % m  # noqa: E731
    a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
    return TriMesh(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def test_unit_cube():
    cube = box()
    assert surface.volume(cube) == pytest.approx(1, abs=1e-15)
    assert surface.diagonal(cube) == pytest.approx(np.sqrt(3))
    assert surface.face_areas(cube).sum() == pytest.approx(6)
    assert surface.genus(cube) == 0
    middles = cube.vertices[cube.faces].mean(axis=1) - 0.5
    assert (np.einsum("fi,fi->f", surface.face_normals(cube), middles) == 0.5).all()


def test_torus_has_one_handle():
    assert surface.genus(torus()) == 1
    assert surface.volume(torus(400, 200)) == pytest.approx(2 * np.pi**2 * 2 * 0.25, rel=1e-3)
