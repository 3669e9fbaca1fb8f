"""The largest stress: value and position in an L-bracket, singular places, distorted hexes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import eye

from polycube.analysis.boundary_sets import faces_of
from polycube.analysis.constraints import Support
from polycube.analysis.peaks import boundary_name, poor_elements, singular_places
from polycube.analysis.problem import Material
from polycube.analysis.recovery import EVEN, TO_BEZIER
from polycube.analysis.static import Load, deform
from polycube.hexmesh.cad_faces import with_sets
from polycube.io.hex_meshes import boundary
from polycube.registry import build
from polycube.spline.boundary import boundary_nodes
from tests.conftest import first_quick
from tests.fixtures.hexmeshes import surface_of
from tests.fixtures.industrial import FILLET, LEG, THICK, WIDE, bracket, filleted_bracket
from tests.fixtures.splines import box, spline_of

SOLID = Material(3.0, 0.3, 2.0)

# Largest von Mises stress, in Pa, and its place in x and z, of the bracket held at x = 0 under
# 100 N across its other end: tetrahedra of second order made by Gmsh on half of the part, with
# edges of 0.5 mm at the fillet and 4 mm elsewhere, 114,325 unknowns (0.8 mm: 23.57e6).
LARGEST, PLACE = 23.62e6, (11.0, 6.1)


@pytest.mark.slow
@pytest.mark.parametrize("space", ["h2s", "optimal"])
def test_largest_stress_of_a_bracket_is_in_its_fillet(space):
    mesh, surface = filleted_bracket(6, 3, 3), boundary(filleted_bracket(24, 3, 3))
    spline = build("spline", {"plugin": space})(surface, mesh)
    loads = [{"at": "x_max", "force": [0.0, 0.0, -100.0]}]
    steel = {"young": 210e9, "poisson": 0.3, "density": 7850}
    options = {"fixed": ["x_min"], "loads": loads, "material": steel}
    found = build("analysis", {"plugin": "static", **options})(spline)
    assert found.peak.value == pytest.approx(LARGEST, rel=0.05)
    assert abs(found.peak.value - LARGEST) < found.peak.error
    x, y, z = found.peak.at
    assert [x, z] == pytest.approx(PLACE, abs=0.1 * FILLET) and 0 < y < WIDE
    assert np.hypot(x - THICK - FILLET, z - THICK - FILLET) == pytest.approx(FILLET, abs=0.02)
    assert found.singular is None and 0.01 < found.stress_error < 0.05


@pytest.mark.slow
def test_a_sharp_corner_is_named_and_excluded():
    """With a sharp corner, the result away from it hardly depends on the size of the hexes."""
    away, near, distances = [], [], []
    for n in (8, 16):
        spline = spline_of(bracket(0.0, n), "optimal")
        found = build(
            "analysis",
            {
                "plugin": "static",
                "fixed": ["x_min"],
                "loads": [{"at": "x_max", "force": [0.0, 0.0, -100.0]}],
                "away": 0.1,
            },
        )(spline)
        assert found.singular.what == "sharp inner edge"
        apart = np.hypot(found.singular.at[0] - THICK, found.singular.at[2] - THICK)
        assert apart == pytest.approx(found.singular.distance, rel=0.05)
        distance = np.hypot(found.peak.at[0] - THICK, found.peak.at[2] - THICK)
        assert distance > 0.1 * np.linalg.norm([LEG, WIDE, LEG])
        assert found.peak.error < 0.1 * found.peak.value
        away.append(found.peak.value)
        near.append(found.singular.value)
        distances.append(found.singular.distance / np.linalg.norm([LEG, WIDE, LEG]))
    assert away[1] == pytest.approx(away[0], rel=0.05) and near[1] == pytest.approx(
        near[0], rel=0.1
    )
    assert all(0.1 <= distance <= 0.2 for distance in distances)


def test_singular_stress_is_not_in_the_estimate_beside_it():
    spline = box((6, 2, 2), (3.0, 1.0, 1.0), "h2s")
    held = [Support("x_min", faces_of(spline, "x_min"), (0, 1, 2))]
    found = deform(spline, SOLID, held, [Load("x_max", force=[1.0, 0.0, 0.0])], length_unit="m")
    assert found.singular.what == "border of x_min" and found.peak.at[0] == pytest.approx(0.5)
    assert 0.005 < found.peak.error / found.peak.value < 0.03


def places(spline, supports=(), loaded=(), radius=0.1):
    return [place.what for place in singular_places(spline, supports, loaded, radius)]


@pytest.mark.slow
def test_singular_places_follow_from_the_angles():
    spline = box((2, 2, 2))
    assert places(spline) == []
    support = Support("wall", faces_of(spline, "x_min"))
    assert places(spline, [support]) == ["border of wall"]
    assert places(spline, [replace(support, components=(0,))]) == []  # a plane of symmetry
    assert places(spline, [replace(support, components=(1,))]) == ["border of wall"]
    every = Support("all", np.arange(len(spline.sides)))
    assert places(spline, [every]) == []
    assert places(spline_of(bracket())) == ["sharp inner edge"]
    top = faces_of(spline, "z_max")  # of area 1 / 4 each
    assert places(spline, (), [top[:1]], 0.25) == []
    assert places(spline, (), [top[:1]], 0.3) == ["load on a small area"]


@pytest.mark.slow
def test_inner_edges_of_the_cad_model_are_singular_where_the_spline_is_round():
    plain = bracket()
    corners = plain.vertices[plain.quads]
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    axis = abs(normal).argmax(axis=1)
    across = np.take_along_axis(normal, axis[:, None], axis=1)[:, 0] > 0
    region = np.unique(np.stack([plain.patch, axis, across]), axis=1, return_inverse=True)[1] + 1
    surface = surface_of(plain, region.ravel())
    mesh = with_sets(plain, surface)
    spline = build("spline", {"plugin": "h2s", "sharp": "none"})(surface, mesh)
    assert places(spline) == ["sharp inner edge"]
    [edge] = singular_places(spline, [], [], 0.1)
    assert abs(edge.points[:, ::2] - THICK).max() < 0.1 * LEG
    assert np.ptp(edge.points[:, 1]) == pytest.approx(WIDE, rel=0.1)
    assert places(replace(spline, inner_edges=np.zeros((0, 2)))) == []


def test_points_of_singular_places_lie_on_them():
    spline = box((2, 2, 2))
    [border] = singular_places(spline, [Support("a", faces_of(spline, "x_min"))], [], 0.1)
    y, z = border.points[:, 1:].T
    assert abs(border.points[:, 0]).max() < 1e-12
    assert (np.minimum(y * (1 - y), z * (1 - z)) < 1e-12).all()
    assert len(border.nodes) == 8 * 3  # of eight edges of cubic elements


def distorted(by):
    """A block of 4^3 cubes, the inner corner at (1, 1, 1) moved `by` of the way to (2, 2, 2)."""
    spline = box((4, 4, 4), (4.0, 4.0, 4.0), "c0")
    points = spline.extraction @ spline.control
    corner = np.array([1.0, 1.0, 1.0])
    hat = np.prod(np.clip(1 - abs(points - corner), 0, None), axis=1)
    moved = points + by * hat[:, None]
    return replace(spline, control=moved, extraction=eye(len(points), format="csr"))


@pytest.mark.parametrize(("by", "poor"), first_quick(1, [(0.2, 0), (0.325, 1)]))
def test_distorted_elements_are_counted_and_their_stress_is_excluded(by, poor):
    spline = distorted(by)
    assert poor_elements(spline).sum() == poor
    support = Support("foot", faces_of(spline, {"plane": [0, 0, 1, 0]}))
    top = Load(faces_of(spline, {"plane": [0, 0, 1, 4]}), traction=(0.5, 0.0, 1.0))
    found = deform(spline, SOLID, [support], [top], length_unit="m")
    assert found.poor == poor
    reference = deform(distorted(0.0), SOLID, [support], [top], length_unit="m")
    assert found.peak.value == pytest.approx(reference.peak.value, rel=0.02)
    x, y, z = reference.peak.at  # or at its mirror image across y = 2: equal up to rounding
    assert found.peak.at in (pytest.approx((x, y, z)), pytest.approx((x, 4 - y, z)))


def test_even_points_and_bezier_points_are_equivalent():
    assert TO_BEZIER @ EVEN == pytest.approx(np.eye(64), abs=1e-12)


def test_boundary_faces_have_names_of_the_model_if_possible():
    spline = box((2, 1, 1), (2.0, 1.0, 1.0))
    points = (spline.extraction @ spline.control)[boundary_nodes(spline)]
    at_end, inside = (
        (abs(points - np.array([x, 1 / 3, 2 / 3])) < 1e-9).all(axis=2).any(axis=1)
        for x in (2.0, 0.7)
    )
    assert boundary_name(spline, at_end) == "x_max"
    assert boundary_name(spline, inside) == ""
    right = faces_of(spline, "x_max")
    for names in (["patch_1", "x_max"], ["x_max", "cad_face_2"], ["cad_face_2", "cad_TIP"]):
        named = replace(spline, sets=dict.fromkeys(names, right))
        assert boundary_name(named, at_end) == names[1]
