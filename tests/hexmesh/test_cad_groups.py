"""Ends and holes of CAD models: whole CAD faces, with exact areas."""

import numpy as np
import pytest

from polycube.hexmesh.cad_faces import with_sets
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.face_groups import ENDS, cad_ends_and_holes, measure
from polycube.io.surfaces import read_surface
from polycube.surface.measures import face_areas
from polycube.types import TriMesh
from tests.conftest import first_quick
from tests.fixtures import cad_parts
from tests.fixtures.hexmeshes import hex_box, surface_of

KEYWAY = 20 * 8 + np.pi * 4**2  # its floor
WIDTH = np.sqrt(20**2 - 4**2)  # height of the shaft's side where the keyway is
AREAS = {  # of all names, those of walls that a cylinder cuts from a cylinder as None
    "i_beam": {
        **dict.fromkeys(["x_min", "x_max"], 2 * 320 * 10),
        **dict.fromkeys(["y_min", "y_max"], 320 * 100),
        **dict.fromkeys(["z_min", "z_max"], 2 * 100 * 10 + 100 * 8),
        "hole_1": 2 * np.pi * 30 * 8,
    },
    "shaft": {**dict.fromkeys(["x_min", "x_max"], np.pi * 15**2), "hole_1": None},
    "flange": {
        "z_min": np.pi * (60**2 - 20**2 - 6 * 5**2),
        "z_max": np.pi * (30**2 - 20**2),
        **{f"hole_{k}": 2 * np.pi * (20 * 40 if k == 4 else 5 * 12) for k in range(1, 8)},
    },
    "plate": {
        **dict.fromkeys(["x_min", "x_max"], 100 * 10),
        **dict.fromkeys(["y_min", "y_max"], 200 * 10),
        **dict.fromkeys(["z_min", "z_max"], 200 * 100 - 4 * np.pi * 4**2),
        **{f"hole_{k}": 2 * np.pi * 4 * 10 for k in range(1, 5)},
    },
    "bracket": {
        "x_min": 60 * 40,
        "x_max": 6 * 40,
        **dict.fromkeys(["y_min", "y_max"], 114 * 6 + (1 - np.pi / 4) * 6**2),
        "z_min": 60 * 40 - 2 * np.pi * 4.5**2,
        "z_max": 6 * 40,
        **{f"hole_{k}": 2 * np.pi * 4.5 * 6 for k in (1, 2)},
    },
    "bored_block": {
        **dict.fromkeys(["x_min", "x_max"], 40 * 20),
        **dict.fromkeys(["y_min", "y_max"], 60 * 20),
        **dict.fromkeys(["z_min", "z_max"], 60 * 40 - np.pi * 10**2),
        "hole_1": 2 * np.pi * 10 * 20,
    },
}


@pytest.mark.parametrize("name", first_quick(1, AREAS))
def test_named_sets_of_a_part_are_complete_faces(tmp_path, name):
    surface, _ = read_surface(cad_parts.write(name, tmp_path))
    area = np.bincount(surface.region, face_areas(surface))
    found = {set_: area[own].sum() for set_, own in cad_ends_and_holes(surface).items()}
    assert list(found) == list(AREAS[name])
    exact = {set_: size for set_, size in AREAS[name].items() if size is not None}
    assert {set_: found[set_] for set_ in exact} == pytest.approx(exact, rel=5e-3)


@pytest.mark.slow
def test_a_keyway_is_a_hole_with_its_floor(tmp_path):
    """Its floor does not lie at z_max, although nothing else faces up at that end."""
    surface, _ = read_surface(cad_parts.write("shaft", tmp_path))
    [walls] = [own for name, own in cad_ends_and_holes(surface).items() if name == "hole_1"]
    areas = np.bincount(surface.region, face_areas(surface))[walls]
    assert len(walls) == 5  # floor, two flat walls, two round ones
    assert areas.max() == pytest.approx(KEYWAY, rel=5e-3)
    assert sorted(areas)[2] == pytest.approx(20 * (WIDTH - 16), rel=5e-3)


def prism(corners, side):
    """Surface of a convex prism of height 1; the sides (N,) have the CAD faces `side`."""
    n = len(corners)
    points = np.concatenate([np.insert(corners, 2, z, axis=1) for z in (0.0, 1.0)])
    points = np.concatenate([points, [[*np.mean(corners, axis=0), z] for z in (0.0, 1.0)]])
    a, b = np.arange(n), np.roll(np.arange(n), -1)
    walls = [np.stack([a, b, b + n], axis=1), np.stack([a, b + n, a + n], axis=1)]
    caps = [np.stack([b, a, 0 * a + 2 * n], axis=1), np.stack([a + n, b + n, 0 * a + 2 * n + 1], 1)]
    region = np.concatenate([side, side, 0 * a + 1, 0 * a + 2])
    return TriMesh(points, np.concatenate([*walls, *caps]), region)


def arc(middle, first, last, n=24):
    angle = np.linspace(first, last, n + 1)
    return middle + np.stack([np.cos(angle), np.sin(angle)], axis=1)


def test_a_round_end_is_a_complete_face():
    """A bar with half cylinders of radius 1 at its ends; 3 and 5 are flat, 4 and 6 are round."""
    ends = [arc([5, 0], -np.pi / 2, np.pi / 2), arc([0, 0], np.pi / 2, 3 * np.pi / 2)]
    side = [*[4] * 24, 5, *[6] * 24, 3]
    found = cad_ends_and_holes(prism(np.concatenate(ends), side))
    assert {name: own.tolist() for name, own in found.items()} == dict(
        zip(ENDS, [[6], [4], [3], [5], [1], [2]], strict=True)
    )


def test_a_fillet_beside_a_flat_end_is_not_part_of_it():
    corners = np.concatenate([[[0, 0], [5, 0]], arc([4, 3], 0, np.pi / 2), [[0, 4]]])
    found = cad_ends_and_holes(prism(corners, [3, 4, *[5] * 24, 6, 7]))
    assert {name: own.tolist() for name, own in found.items()} == dict(
        zip(ENDS, [[7], [4], [3], [6], [1], [2]], strict=True)
    )


def test_a_cylinder_has_no_ends_at_its_side():
    assert list(cad_ends_and_holes(prism(arc([0, 0], 0, 2 * np.pi)[:-1], [3] * 24))) == [
        "z_min",
        "z_max",
    ]


def test_the_mesh_has_the_sets_of_the_model():
    """The quads of a torn mesh look anywhere, but those of an end are those of its CAD face."""
    mesh = hex_box((4, 4, 4))
    middle = mesh.vertices[mesh.quads].mean(axis=1)
    region = np.argmin(np.hstack([middle, 1 - middle])[:, [0, 3, 1, 4, 2, 5]], axis=1) + 1
    rng = np.random.default_rng(1)
    moved = mesh.vertices + 0.04 * rng.normal(size=mesh.vertices.shape)
    torn = hex_mesh(moved, mesh.hexes, mesh.quads, rng.integers(0, 9, len(mesh.quads)))
    sets = with_sets(torn, surface_of(mesh, region)).sets
    normal = measure(moved[mesh.quads]).normal
    assert np.abs(normal).max(axis=1).min() < 0.95
    for number, end in enumerate(ENDS, start=1):
        assert sets[end].tolist() == np.flatnonzero(region == number).tolist()
