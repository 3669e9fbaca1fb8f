"""CAD faces on a hex mesh: exact if quads follow the faces, else by the larger share."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.cad_faces import quad_regions, with_sets
from polycube.hexmesh.connectivity import hex_mesh
from polycube.io.hex_meshes import boundary, patches
from polycube.surface.measures import face_normals
from polycube.types import TriMesh
from tests.fixtures.hexmeshes import hex_box, rings
from tests.fixtures.surfaces import box


def tagged(surface, region, names=()):
    return replace(surface, region=np.asarray(region) + 1, region_names=tuple(names))


def by_normal(surface):
    """Sides of a box by the axis that they face along, -x +x -y ... as 0 to 5."""
    normals = face_normals(surface)
    axis = np.abs(normals).argmax(axis=1)
    return 2 * axis + (normals[np.arange(len(axis)), axis] > 0)


def test_sides_of_a_box():
    mesh, surface = hex_box((3, 2, 4)), box()
    surface = tagged(surface, by_normal(surface), ["", "top #1", "", "", "left", "left"])
    region, share = quad_regions(mesh, surface)
    flat = boundary(mesh)
    assert region.tolist() == (by_normal(flat).reshape(4, -1)[0] + 1).tolist()
    assert (share == 1).all()
    mesh = hex_mesh(mesh.vertices, mesh.hexes, mesh.quads, patches(mesh))
    sets = with_sets(mesh, surface).sets
    ends = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"]
    faces = [f"cad_face_{k}" for k in range(1, 7)]
    assert list(sets) == [*ends, "cad_top_1", "cad_left", *faces, *(f"patch_{k}" for k in range(6))]
    for end, face in zip(ends, faces, strict=True):
        assert sets[end].tolist() == sets[face].tolist()
    assert sorted(sets["cad_left"]) == sorted([*sets["z_min"], *sets["z_max"]])


@pytest.mark.parametrize(("cut", "shares"), [(0.4, [2 / 3, 1]), (0.2, [2 / 3, 1])])
def test_a_quad_on_two_faces_goes_to_the_larger_share(cut, shares):
    """The lower side of a box of 2 x 1 x 1 hexes is two faces that meet at x = cut."""
    fine = boundary(hex_box((10, 1, 1)))
    middle = fine.vertices[fine.faces].mean(axis=1)
    region = by_normal(fine)
    region[(region == 4) & (middle[:, 0] < cut)] = 6
    mesh = hex_box((2, 1, 1))
    found, share = quad_regions(mesh, tagged(fine, region))
    below = np.flatnonzero(mesh.vertices[mesh.quads][:, :, 2].max(axis=1) == 0)
    assert found[below].tolist() == [7 if cut > 0.25 else 5, 5]
    assert share[below] == pytest.approx(shares)


def test_a_border_between_mesh_edges_is_straight():
    """Two faces meet in a row of quads, a quarter of a quad left and right of its middle."""
    n = 12
    fine = boundary(hex_box((4 * n, n, 1)))
    x, y, _ = n * fine.vertices[fine.faces].mean(axis=1).T
    region = by_normal(fine)
    region[(region == 5) & (x > np.where(y.astype(int) % 3 == 1, 6.25, 6.75))] = 6
    mesh = hex_box((n, n, 1))
    found, share = quad_regions(mesh, tagged(fine, region))
    corners = n * mesh.vertices[mesh.quads]
    lid, column = corners[:, :, 2].min(axis=1) == n, corners[:, :, 0].min(axis=1).round()
    assert sorted(share[lid & (column == 6)]) == pytest.approx([1 / 3] * 4 + [2 / 3] * 8)
    assert set(found[lid & (column <= 6)]) == {6} and set(found[lid & (column > 6)]) == {7}


def test_quads_along_a_curve_belong_to_the_face_on_their_side():
    """Thin quads outside an octagon lie within the circle where the two upper faces meet."""
    fine = boundary(rings([0.6, 0.8, 1, 1.06, 1.5], 128))
    middle = fine.vertices[fine.faces].mean(axis=1)
    region = np.where(face_normals(fine)[:, 2] > 0.5, 1, 0)
    region[(region == 1) & (np.hypot(*middle[:, :2].T) > 1)] = 2
    mesh = rings([0.6, 1, 1.06, 1.5], 8)
    found, share = quad_regions(mesh, tagged(fine, region))
    corners = mesh.vertices[mesh.quads]
    upper = corners[:, :, 2].min(axis=1) > 0
    radius = np.linalg.norm(corners[:, :, :2], axis=2).min(axis=1)
    assert set(found[upper & (radius < 0.99)]) == {2}
    assert set(found[upper & (radius > 0.99)]) == {3}
    assert share[upper & (abs(radius - 1) < 0.01)].max() < 0.5


def test_faces_too_small_for_a_quad_have_no_set(caplog):
    fine = boundary(hex_box((20, 1, 1)))
    region = by_normal(fine)
    middle = fine.vertices[fine.faces].mean(axis=1)
    region[(region == 4) & (middle[:, 0] < 0.05)] = 6
    with caplog.at_level("INFO", logger="polycube"):
        sets = with_sets(hex_box((2, 1, 1)), tagged(fine, region)).sets
    assert "cad_face_7" not in sets and len(sets["cad_face_5"]) == 2
    assert "CAD faces: 6 of 7 on the mesh, 0 of 10 quads are on several; without a quad: 7" in (
        caplog.text
    )


def test_sides_of_a_thin_wall_are_distinguished_by_normals():
    """Quads nearer to the other side of a sheet than to their own, by their normals."""
    surface = box((0.0, 0.0, 0.0), (1.0, 1.0, 0.01))
    mesh = hex_box((2, 2, 1), (1.0, 1.0, 0.01))
    moved = mesh.vertices + np.array([0, 0, 0.007])
    region, _ = quad_regions(replace(mesh, vertices=moved), tagged(surface, by_normal(surface)))
    below = mesh.vertices[mesh.quads][:, :, 2].max(axis=1) == 0
    assert set(region[below]) == {5}


def test_surfaces_without_regions_have_no_such_sets():
    mesh = hex_box()
    assert not any("cad" in name for name in with_sets(mesh, box()).sets)
    with pytest.raises(ValueError, match=r"TriMesh.region must have shape \(F\)"):
        TriMesh(box().vertices, box().faces, [1, 2])
