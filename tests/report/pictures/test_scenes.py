"""What the pictures show, in numbers."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.report.pictures import fields, scenes
from polycube.report.pictures.colours import CELLS, QUALITY_COLOURS, ramp, rgb
from polycube.report.pictures.fields import tessellate
from polycube.spline.boundary import unshared_faces
from polycube.structure.rough_map import affine_map
from polycube.types import Modes, TriMesh
from tests.fixtures.hexmeshes import CORNERS, hex_box


def area_vector(points: np.ndarray, quads: np.ndarray) -> tuple[np.ndarray, float]:
    """Sum of the area vectors, zero where closed, and the volume inside, positive if outward."""
    p = points[quads]
    vectors = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]) / 2
    return vectors.sum(0), float(np.einsum("ij,ij->", p.mean(1), vectors) / 3)


def test_ramp_meets_its_stops_and_clips() -> None:
    stops = rgb(QUALITY_COLOURS)
    np.testing.assert_array_equal(ramp(np.linspace(0, 1, len(stops)), QUALITY_COLOURS), stops)
    np.testing.assert_array_equal(ramp(np.array([-1.0, 2.0]), QUALITY_COLOURS), stops[[0, -1]])


def test_polycube_is_drawn_with_the_edges_of_its_patches(run) -> None:
    (layer,) = scenes.polycube_faces(run.polycube)
    lengths = np.linalg.norm(np.diff(layer.points[layer.lines], axis=1), axis=-1)
    # box of 2 x 1 x 1: 4 * (2 + 1 + 1); hole: four edges of 1 along z, and two rims of 4 / 3
    assert lengths.sum() == pytest.approx(16 + 4 + 8 / 3)
    assert len(layer.colours) == len(layer.polygons)


def test_label_lines_lie_between_patches_only(run) -> None:
    surface, labels = run.surface, run.labels
    (layer,) = scenes.labelled(surface, labels)
    patches_at = [set() for _ in surface.vertices]
    for face, patch in zip(surface.faces, labels.patch, strict=True):
        for vertex in face:
            patches_at[vertex].add(patch)
    assert len(layer.lines)
    assert all(len(patches_at[a] & patches_at[b]) >= 2 for a, b in layer.lines)


def test_sharp_edges_of_a_box_are_its_twelve() -> None:
    corner = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [f for a, b, c, d in quads for f in ([a, b, c], [a, c, d])]
    (layer,) = scenes.input_surface(TriMesh(corner, faces))
    assert len(layer.lines) == 12
    assert (np.abs(np.diff(corner[layer.lines], axis=1)).sum((1, 2)) == 1).all()


def test_cut_keeps_whole_hexes_behind_the_plane(run) -> None:
    mesh = run.hexes
    (layer,) = scenes.hex_cut(mesh)
    rest, volume = area_vector(layer.points, layer.polygons)
    np.testing.assert_allclose(rest, 0, atol=1e-9)  # closed: no hex is cut in two
    (outside,) = scenes.hex_outside(mesh)
    _, all_of_it = area_vector(outside.points, outside.polygons)
    assert 0.4 * all_of_it < volume < 0.8 * all_of_it
    np.testing.assert_array_equal(np.unique(outside.polygons), np.unique(mesh.quads))


def test_hexes_are_coloured_by_quality_on_a_fixed_scale() -> None:
    (layer,) = scenes.hex_outside(hex_mesh(CORNERS, np.arange(8)[None]))
    assert (layer.colours == rgb(QUALITY_COLOURS)[-1]).all()
    squeezed = CORNERS * 1.0
    squeezed[:, 0] += squeezed[:, 1]  # sheared by 45 degrees
    (layer,) = scenes.hex_outside(hex_mesh(squeezed, np.arange(8)[None]))
    assert (layer.colours == ramp(np.array([np.sqrt(0.5)]), QUALITY_COLOURS)).all()


def test_worst_hex_is_the_one_shown(run) -> None:
    mesh = run.hexes
    glass, worst = scenes.worst_hex(mesh)
    row = np.argmin(scaled_jacobian(mesh.vertices, mesh.hexes))
    np.testing.assert_array_equal(worst.points[:8], mesh.vertices[mesh.hexes[row]])
    ends = worst.points[worst.lines]
    np.testing.assert_allclose(ends.min((0, 1)), mesh.vertices.min(0))
    np.testing.assert_allclose(ends.max((0, 1)), mesh.vertices.max(0))
    assert glass.opacity < 1


def test_bezier_skin_is_closed_outward_and_of_the_right_volume(run) -> None:
    spline, mesh = run.spline, run.hexes
    (layer,) = scenes.spline_boundary(spline)
    rest, volume = area_vector(layer.points, layer.polygons)
    np.testing.assert_allclose(rest, 0, atol=1e-8)
    _, trilinear = area_vector(mesh.vertices, mesh.quads)
    assert volume == pytest.approx(trilinear, rel=1e-3)
    assert len(layer.polygons) == 16 * len(mesh.quads)


def test_sides_of_a_spline_are_the_faces_that_one_element_has(run) -> None:
    spline = run.spline
    assert sorted(map(tuple, unshared_faces(spline.nodes))) == sorted(map(tuple, spline.sides))


def test_bezier_skin_weights_are_a_partition_of_unity(run) -> None:
    weights = tessellate(run.spline).points
    np.testing.assert_allclose(np.asarray(weights.sum(1)).ravel(), 1, atol=1e-12)
    assert weights.data.min() >= 0


def test_a_translation_moves_the_drawn_body_by_the_amplitude(run) -> None:
    spline = run.spline
    still = scenes.spline_boundary(spline)[0].points
    moved = fields.mode(spline, run.solution, 0, amplitude=0.1)
    diagonal = np.linalg.norm(np.ptp(still, axis=0))
    np.testing.assert_allclose(moved.layer.points, still)
    np.testing.assert_allclose(moved.shift, np.tile([0.1 * diagonal, 0, 0], (len(still), 1)))


def test_first_elastic_mode_follows_the_rigid_ones(run) -> None:
    assert fields.first_elastic(run.solution) == 6
    shapes = np.zeros((2, 1, 3))
    assert fields.first_elastic(Modes([3.0, 5.0], shapes, 1.0, rigid=0)) == 0  # clamped


def test_polycube_is_turned_as_the_model_lies(run) -> None:
    turn = np.array([[0.0, -1, 0], [0, 0, 1], [-1, 0, 0]])
    polycube = run.polycube
    (plain,) = scenes.polycube_faces(polycube)
    rough_map = affine_map(polycube, turn @ np.diag([3.0, 1.0, 2.0]), np.array([9.0, 9.0, 9.0]))
    (turned,) = scenes.polycube_faces(polycube, rough_map)
    np.testing.assert_allclose(turned.points, plain.points @ turn.T, atol=1e-12)


def test_grid_cells_are_whole_apart_and_in_colours_of_their_own(run) -> None:
    mesh = run.hexes
    scene = scenes.decomposed(mesh, apart=0.25)
    assert len(scene) == len(np.unique(mesh.cell)) == 2
    middle, shifts, volume = mesh.vertices[mesh.hexes].mean(axis=1), [], 0.0
    for cell, layer in enumerate(scene):
        rest, inside = area_vector(layer.points, layer.polygons)
        np.testing.assert_allclose(rest, 0, atol=1e-9)
        volume += inside
        chosen = mesh.cell == cell
        own = mesh.vertices[np.unique(mesh.hexes[chosen])]
        shifts.append(0.25 * (middle[chosen].mean(0) - middle.mean(0)))
        assert layer.points.max(0) == pytest.approx(own.max(0) + shifts[-1])
    assert volume == pytest.approx(area_vector(mesh.vertices, mesh.quads)[1])
    assert len({tuple(layer.colours[0]) for layer in scene}) == 2


def test_many_grid_cells_are_one_layer_for_each_colour() -> None:
    mesh = hex_box((60, 1, 1), (60, 1, 1))
    scene = scenes.decomposed(replace(mesh, cell=np.arange(60)), apart=1.0)
    assert len(scene) == len(CELLS)
    closed = [area_vector(layer.points, layer.polygons) for layer in scene]
    assert sum(volume for _, volume in closed) == pytest.approx(60)
    assert sum(len(layer.polygons) for layer in scene) == 6 * 60
    ends = np.concatenate([layer.points[:, 0] for layer in scene])
    assert (ends.min(), ends.max()) == (-29.5, 89.5)  # each is as far off again
