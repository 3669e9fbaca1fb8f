"""Splines on meshes of CAD parts: creases of the CAD model, sides and edges on their faces."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.cad_faces import unique_cad_faces, with_sets
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.named_sets import cad_faces, quads_of_spline
from polycube.io.hex_meshes import boundary, patches
from polycube.registry import build
from polycube.spline.boundary import corner_nodes, deviation
from polycube.surface.measures import face_normals
from tests.fixtures.hexmeshes import hex_box
from tests.fixtures.hierarchies import sharpened

COUNTS = (6, 4, 4)
HIGH = (1.5, 1.0, 1.0)


def h2s(**options):
    return build("spline", {"plugin": "h2s", **options})


def by_side(surface, split):
    """CAD faces 1 to 6 of a box by the axis that they face along; what is above and beyond `split`
    is 7.
    """
    normals = face_normals(surface)
    axis = np.abs(normals).argmax(axis=1)
    region = 1 + 2 * axis + (normals[np.arange(len(axis)), axis] > 0)
    middle = surface.vertices[surface.faces].mean(axis=1)
    region[(region == 6) & (middle[:, 0] > split)] = 7
    return replace(surface, region=region)


def with_patches(vertices, mesh):
    made = hex_mesh(vertices, mesh.hexes)
    return hex_mesh(made.vertices, made.hexes, made.quads, patches(made))


def roof(rise):
    """Mesh and surface of a box whose top rises to a ridge at half its length."""
    mesh = hex_box(COUNTS, HIGH)
    x, _, z = mesh.vertices.T
    high = z * (1 + rise * (1 - abs(x / HIGH[0] - 0.5) * 2))
    mesh = with_patches(np.column_stack([mesh.vertices[:, :2], high]), mesh)
    surface = by_side(boundary(mesh), HIGH[0] / 2)
    return with_sets(mesh, surface), surface


def on_ridge(mesh, edges):
    return (abs(mesh.vertices[edges][:, :, 0] - HIGH[0] / 2) < 1e-9).all(axis=1) & (
        mesh.vertices[edges][:, :, 2] > 0.9
    ).all(axis=1)


@pytest.mark.parametrize(("rise", "creased"), [(0.2, True), (0.02, False)])
def test_a_curve_between_cad_faces_is_a_crease_above_ten_degrees(rise, creased):
    mesh, surface = roof(rise)  # turns by 2 atan(rise / .75): 30 and 3 degrees
    assert on_ridge(mesh, sharpened(h2s(), mesh, surface).edges).sum() == creased * COUNTS[1]
    assert not on_ridge(mesh, sharpened(h2s(), mesh).edges).any()
    flat = h2s(cad_angle=45)
    assert not on_ridge(mesh, sharpened(flat, mesh, surface).edges).any()


def test_a_planar_part_is_exact():
    mesh, surface = roof(0.2)
    apart = deviation(h2s()(surface, mesh), surface)
    assert max(apart.to_surface.largest, apart.to_spline.largest) < 1e-9
    unnamed = replace(surface, region=np.zeros(0, np.int64))
    plain = deviation(h2s()(unnamed, replace(mesh, sets={}, cad_face=np.zeros(0))), unnamed)
    assert plain.to_spline.largest > 1e-3


def test_an_edge_between_coplanar_faces_is_fitted_to_their_curve():
    """The mesh has the border of two faces at x = .75, the surface at .72: nothing but the curve
    tells where it is.
    """
    mesh, _ = roof(0)
    split = 0.72
    fine = boundary(hex_box((50, 4, 4), HIGH))
    surface = by_side(fine, split)
    spline = h2s()(surface, mesh)
    face = cad_faces(mesh)[quads_of_spline(spline, mesh)]
    corners = (spline.extraction @ spline.control)[corner_nodes(spline)]
    borders = corners[face == 6][:, :, 0].max(), corners[face == 7][:, :, 0].min()
    assert borders == pytest.approx((split, split), abs=2e-3)


def test_a_quad_on_two_faces_is_fitted_to_any_face():
    mesh, surface = roof(0)
    assert (unique_cad_faces(mesh, surface) == cad_faces(mesh)).all()
    mixed = by_side(boundary(hex_box((50, 4, 4), HIGH)), 0.65)
    face = unique_cad_faces(with_sets(mesh, mixed), mixed)
    middle = mesh.vertices[mesh.quads].mean(axis=1)
    between = (abs(middle[:, 0] - 0.625) < 1e-9) & (middle[:, 2] > 0.9)
    assert (face == 0).tolist() == between.tolist()
