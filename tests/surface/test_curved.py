"""The smooth surface over the triangles of curved CAD faces, against exact ones."""

import numpy as np
import pytest
import trimesh

from polycube.surface.curved import corner_normals, lifted, smooth_curve
from polycube.surface.curves.features import Crease
from polycube.surface.fit_target import target
from polycube.surface.measures import face_normals, volume
from polycube.types import TriMesh


def ball(number: int) -> TriMesh:
    """A half of the unit ball: the round face is CAD face 1, the flat one CAD face 2."""
    height = np.linspace(0, np.pi / 2, number + 1)[:-1]
    turn = 2 * np.pi * np.arange(4 * number) / (4 * number)
    rings = [
        np.stack([np.cos(h) * np.cos(turn), np.cos(h) * np.sin(turn), 0 * turn + np.sin(h)], axis=1)
        for h in height
    ]
    vertices = np.concatenate([*rings, [[0, 0, 1], [0, 0, 0]]])
    size, top = len(turn), len(vertices) - 2
    here = np.arange(size)
    after = (here + 1) % size
    faces, region = [], []
    for k in range(number - 1):
        a, b, c, d = (
            k * size + here,
            k * size + after,
            (k + 1) * size + after,
            (k + 1) * size + here,
        )
        faces += [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    last = (number - 1) * size
    faces.append(np.stack([last + here, last + after, np.full(size, top)], axis=1))
    region = [1] * sum(map(len, faces)) + [2] * size
    faces.append(np.stack([after, here, np.full(size, top + 1)], axis=1))
    return TriMesh(vertices, np.concatenate(faces), np.array(region))


def errors(number: int) -> tuple[float, float]:
    """Largest error of the normals at the corners, and of the radius at the centroids."""
    part = ball(number)
    own = part.region == 1
    corners = part.vertices[part.faces]
    normals = corner_normals(part, face_normals(part))
    points, _ = lifted(corners.mean(axis=1), corners, normals)
    return (
        np.linalg.norm(normals - corners, axis=2)[own].max(),
        abs(np.linalg.norm(points, axis=1) - 1)[own].max(),
    )


def test_normals_and_radius_of_a_ball_converge_with_fourth_order():
    """The border, where triangles are on one side only, included."""
    coarse, fine = errors(6), errors(12)
    assert fine[1] < 1e-4
    assert coarse[0] / fine[0] > 6
    assert coarse[1] / fine[1] > 12


def test_the_volume_is_that_of_the_ball():
    part = ball(12)
    exact = 2 / 3 * np.pi
    assert target(part).volume == pytest.approx(exact, rel=1e-4)
    assert volume(part) < 0.995 * exact


def test_normals_on_the_smooth_surface_are_its_own():
    part = ball(12)
    goal = target(part)
    middles = goal.surface.vertices[goal.surface.faces].mean(axis=1)
    points, normals = goal.smooth(middles, np.arange(len(middles)))
    own = part.region == 1
    radial = goal.to_model(points)[own]
    assert np.linalg.norm(normals[own] - radial, axis=1).max() < 3e-3


def test_planes_and_surfaces_without_cad_faces_do_not_change():
    part = ball(6)
    plain = TriMesh(part.vertices, part.faces)
    flat = face_normals(part)
    assert (corner_normals(plain, flat) == flat[:, None]).all()
    own = part.region == 2
    assert (corner_normals(part, flat)[own] == flat[own, None]).all()
    corners = plain.vertices[plain.faces]
    middles = corners.mean(axis=1)
    assert lifted(middles, corners, np.repeat(flat[:, None], 3, axis=1))[0] == pytest.approx(
        middles
    )


def test_a_kink_inside_a_cad_face_is_kept():
    box = trimesh.creation.box((1, 1, 1)).subdivide().subdivide()
    part = TriMesh(box.vertices, box.faces, np.ones(len(box.faces), np.int64))
    flat = face_normals(part)
    corners = part.vertices[part.faces]
    points, _ = lifted(corners.mean(axis=1), corners, corner_normals(part, flat))
    assert abs(points).max() < 0.5 + 1e-9


@pytest.mark.parametrize("is_loop", [True, False])
def test_smooth_curves_converge_to_a_circle_with_fourth_order(is_loop):
    def error(number: int) -> float:
        turn = np.linspace(0, 2 * np.pi if is_loop else 2, number + 1)
        points = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
        arc = np.arange(number + 1) * np.linalg.norm(points[1] - points[0])
        ends = (-1, -1) if is_loop else (0, 1)
        found = smooth_curve(Crease(points, arc, np.full(number, np.pi / 2), ends))
        assert found[::4] == pytest.approx(points)
        return abs(np.linalg.norm(found, axis=1) - 1).max()

    assert error(48) < 1e-5
    assert error(24) / error(48) > 12


def test_a_straight_curve_stays_straight():
    points = np.array([[0.0, 0, 0], [1, 2, 0], [2, 4, 0]])
    arc = np.linalg.norm(points - points[0], axis=1)
    found = smooth_curve(Crease(points, arc, np.full(2, np.pi / 2), (0, 1)))
    assert found[:, 1] == pytest.approx(2 * found[:, 0])
    short = smooth_curve(Crease(points[:2], arc[:2], np.full(1, np.pi / 2), (0, 1)))
    assert short == pytest.approx(np.linspace(points[0], points[1], 5))


def test_a_very_short_edge_does_not_bend_a_curve():
    turn = np.concatenate([[0, 1e-7], np.linspace(0, 1, 9)[1:]])
    points = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    points[1] += [3e-8, 0, 3e-8]
    arc = np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    found = smooth_curve(Crease(points, arc, np.full(9, np.pi / 2), (0, 1)))
    assert abs(np.linalg.norm(found, axis=1) - 1).max() < 1.2e-3  # sagitta of an edge: 2e-3
    assert abs(found[:, 2]).max() < 1e-7
