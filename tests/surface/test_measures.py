"""Measures of a unit cube and of a square ring, whose values are known."""

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.surface import checks
from polycube.surface import measures as surface
from polycube.types import TriMesh
from tests.fixtures.surfaces import box, joined, torus


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


def welded(mesh: TriMesh) -> TriMesh:
    vertices, index = np.unique(mesh.vertices, axis=0, return_inverse=True)
    return TriMesh(vertices, index.ravel()[mesh.faces])


def without_area() -> TriMesh:
    return TriMesh(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3], [1, 0, 3], [2, 1, 3]]
    )


def test_measures_do_not_lose_digits_far_away():
    far = box((1e7, 1e7, 1e7), (1e7 + 1, 1e7 + 1, 1e7 + 1))
    assert surface.volume(far) == pytest.approx(1, rel=1e-12)


@pytest.mark.parametrize("size", [1e-30, 1e-12, 1.0, 1e30])
def test_good_surfaces_pass_at_any_size(size):
    for mesh in (box(), torus()):
        checks.check_surface(TriMesh(mesh.vertices * size, mesh.faces))


CUBE = box()
TURNED = np.where(np.arange(12)[:, None] == 3, CUBE.faces[:, ::-1], CUBE.faces)
BAD = {
    "not closed: 3 edges .* from": TriMesh(CUBE.vertices, CUBE.faces[1:]),
    "not manifold: 1 edge ": welded(joined(box(), box((1, 1, 0), (2, 2, 1)))),
    "not manifold: 1 vertex .* at ": welded(joined(box(), box((1, 1, 1), (2, 2, 2)))),
    "not oriented: 3 edges": TriMesh(CUBE.vertices, TURNED),
    "encloses no volume: its volume is -1": TriMesh(CUBE.vertices, CUBE.faces[:, ::-1]),
    "encloses no volume: its volume is 0": without_area(),
    "2 separate pieces, the smallest of 12": joined(torus(), box((9, 0, 0), (10, 1, 1))),
    "inner void: its piece of 12": joined(box(), box((0.2, 0.2, 0.2), (0.5, 0.5, 0.5))),
}


@pytest.mark.parametrize("sentence", BAD)
def test_each_defect_is_named(sentence):
    with pytest.raises(InputError, match=sentence):
        checks.check_surface(BAD[sentence])
