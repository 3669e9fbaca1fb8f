import numpy as np
import pytest

from polycube.hexmesh.connectivity import hex_mesh
from polycube.spline.bezier import min_detj
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.sharp_features import (
    creases,
    edges_between,
    folds,
    kinks,
    single_hex_edges,
    union,
    without_dead_ends,
)
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder

RIGHT = np.radians(89)


def test_creases_of_a_box_are_its_twelve_edges():
    mesh = hex_box((2, 3, 4))
    found = creases(mesh, RIGHT)
    assert len(found) == 4 * (2 + 3 + 4)
    on_faces = (mesh.vertices[found] % 1 == 0).all(axis=1).sum(axis=1)
    assert (on_faces == 2).all()
    assert len(creases(mesh, np.radians(91))) == 0


def test_concave_creases_are_found():
    mesh = hex_box((2, 2, 1))
    corner = hex_mesh(mesh.vertices, mesh.hexes[:3])  # an L
    used, hexes = np.unique(corner.hexes, return_inverse=True)
    corner = hex_mesh(mesh.vertices[used], hexes.reshape(-1, 8))
    assert len(creases(corner, RIGHT)) == 2 * 8 + 6


def test_creases_of_a_cylinder_are_its_rims():
    mesh = hex_cylinder(2, 2, 2)  # eight sides, turning by 45 degrees
    assert len(creases(mesh, np.radians(46))) == 2 * 8
    assert len(creases(mesh, np.radians(44))) == 2 * 8 + 2 * 8


def test_single_hex_edges():
    assert len(single_hex_edges(hex_box((2, 3, 4)))) == 4 * (2 + 3 + 4)
    assert len(single_hex_edges(hex_cylinder(2, 2, 2))) == 16
    assert len(single_hex_edges(hex_ball(2))) == 0


def test_edges_between_includes_chords():
    mesh = hex_box((1, 1, 2))
    ends = np.flatnonzero(mesh.vertices[:, 2] == 0)
    assert len(edges_between(mesh, ends)) == 4
    assert len(edges_between(mesh, np.arange(12))) == 20


def test_dead_ends_are_dropped_completely():
    loop, tail = [[0, 1], [1, 2], [0, 2]], [[2, 3], [3, 4]]
    remaining = without_dead_ends(np.array([*tail, *loop]))
    assert sorted(remaining.tolist()) == [[0, 1], [0, 2], [1, 2]]
    assert len(without_dead_ends(np.array(tail))) == 0


def test_kinks_of_a_curve():
    mesh = hex_box((2, 2, 1))
    rim = creases(mesh, RIGHT)
    bottom = rim[(mesh.vertices[rim][..., 2] == 0).all(axis=1)]
    corners = kinks(mesh, bottom, np.radians(45))
    assert sorted(mesh.vertices[corners].sum(axis=1).tolist()) == [0, 1, 1, 2]
    assert len(kinks(mesh, bottom, np.radians(91))) == 0


def test_folds_are_turns_within_one_face():
    mesh = hex_box((2, 2, 1))
    rim = creases(mesh, RIGHT)
    bottom = rim[(mesh.vertices[rim][..., 2] == 0).all(axis=1)]
    corners = np.flatnonzero((mesh.vertices % 1 == 0).all(axis=1) & (mesh.vertices[:, 2] == 0))
    assert sorted(folds(mesh, bottom).tolist()) == corners.tolist()


def test_det_j_vanishes_at_smooth_edges_of_one_hex_and_at_folds():
    mesh = hex_box((2, 2, 2))
    rim = single_hex_edges(mesh)
    part = rim[(mesh.vertices[rim][..., 2] != 0.5).all(axis=1)]  # two squares, uprights smooth
    uprights = rim[(mesh.vertices[rim][..., 2] == 0.5).any(axis=1)]
    tips = folds(mesh, part)
    assert len(tips) == 8
    assert min_detj(volumetric_spline(mesh, part)).min_detj == pytest.approx(0, abs=1e-12)
    assert min_detj(volumetric_spline(mesh, part, tips)).min_detj == pytest.approx(0, abs=1e-12)
    assert min_detj(volumetric_spline(mesh, union(part, uprights))).min_scaled_detj > 0.99
