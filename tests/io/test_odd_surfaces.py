"""Parts that are read but are odd: corners apart, vertices far away, faces without area."""

import numpy as np
import pytest
import trimesh

from polycube.errors import InputError
from polycube.surface.measures import genus, volume
from polycube.surface.repair.clean import clean
from tests.fixtures.surfaces import box, torus

CUBE = box((1000.5, -2.25, 0.125), (1001.5, -1.25, 2.125))  # exact in single precision


def written(folder, kind, mesh=CUBE):
    path = folder / f"part.{kind}"
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(path)
    return path


def test_corners_are_welded_by_the_size_of_the_part():
    rng = np.random.default_rng(0)
    for size in (1e-12, 1.0, 1e30):
        soup = torus().vertices[torus().faces].reshape(-1, 3)
        noisy = (soup + rng.uniform(-1e-7, 1e-7, soup.shape)) * size
        surface, warnings = clean(noisy, np.arange(len(soup)).reshape(-1, 3))
        assert len(surface.vertices) == len(torus().vertices) and genus(surface) == 1
        assert len(warnings) == 1 and warnings[0].startswith("welded corners")


def test_vertex_thrown_far_away_is_named():
    soup = torus().vertices[torus().faces].reshape(-1, 3)
    soup[7] = 1e12
    with pytest.raises(InputError, match=r"at \(1e\+12, 1e\+12, 1e\+12\) belong"):
        clean(soup, np.arange(len(soup)).reshape(-1, 3))


def test_touching_vertices_of_a_closed_mesh_stay_apart():
    pinched = torus()
    vertices = pinched.vertices.copy()
    vertices[0] = vertices[30]
    surface, _ = clean(vertices, pinched.faces)
    assert len(surface.vertices) == len(pinched.vertices)


def test_face_without_area_gets_some_of_its_neighbour():
    cube = box()
    middle = (cube.vertices[0] + cube.vertices[1]) / 2
    face = int(np.flatnonzero((cube.faces == 0).any(1) & (cube.faces == 1).any(1))[0])
    a, b, c = np.roll(cube.faces[face], -int(np.argmin(np.isin(cube.faces[face], [0, 1]))) - 1)
    others = np.delete(cube.faces, face, axis=0).tolist()
    faces = [*others, [a, 8, c], [8, b, c], [a, b, 8]]
    surface, warnings = clean(np.vstack([cube.vertices, middle]), np.array(faces))
    assert warnings == ["flipped the longest edges of faces without area: 1"]
    assert len(surface.faces) == 14 and volume(surface) == pytest.approx(1)


def test_part_too_small_for_float64_is_refused():
    with pytest.raises(InputError, match="out of range"):
        clean(box().vertices * 1e-70, box().faces)
