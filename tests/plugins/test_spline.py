import logging

import numpy as np
import pytest

from polycube.hexmesh.connectivity import hex_mesh
from polycube.io.hex_meshes import boundary
from polycube.registry import build
from polycube.spline.bezier import min_detj
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.sharp_features import creases, kinks
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder


def h2s(**options):
    return build("spline", {"plugin": "h2s", **options})


def solid(mesh, **options):
    return h2s(fit={"iterations": 0}, **options)(boundary(mesh), mesh)


@pytest.mark.parametrize("mesh", [hex_box((3, 3, 3)), hex_cylinder(), hex_ball()])
def test_spline_is_a_valid_solid(mesh):
    spline = solid(mesh)
    assert min_detj(spline).lower_bound > 0
    assert len(spline.nodes) == len(mesh.hexes)


def test_sharp_edges_reproduce_a_box():
    mesh = hex_box((3, 3, 3))
    assert min_detj(solid(mesh)).volume == pytest.approx(1, rel=1e-12)
    round_box = solid(mesh, sharp="none", single_hex_edges=False)
    assert min_detj(round_box).volume < 0.97
    assert min_detj(round_box).min_detj == pytest.approx(0, abs=1e-12)
    assert min_detj(solid(mesh, sharp="none")).volume == pytest.approx(1, rel=1e-12)


def test_angle_is_in_degrees():
    mesh = hex_cylinder(2, 2, 2)  # eight sides; rims at 90, sides at 45 degrees
    rims, sides = (min_detj(solid(mesh, angle=angle)).volume for angle in (50, 40))
    assert sides == pytest.approx(8 * np.sin(np.pi / 4) / 2, rel=1e-12)
    assert rims < 0.99 * sides


def test_isolated_creases_stay_smooth():
    mesh = hex_ball(4)
    peak = np.argmax(mesh.vertices[:, 2])
    vertices = mesh.vertices.copy()
    vertices[peak] *= 1.3  # the edges round it turn by more, and end in the smooth surface
    peaked = hex_mesh(vertices, mesh.hexes)
    assert len(creases(peaked, np.radians(30))) > 0
    stray = solid(peaked, angle=30).extraction
    assert (stray != solid(peaked, sharp="none").extraction).nnz == 0


def bent_bar(height):
    """Bar with a V-shaped bend: a convex crease and a concave one."""
    mesh = hex_box((4, 2, 2), (2.0, height, 1.0))
    lift = 0.5 * abs(mesh.vertices[:, 0] - 1)
    return hex_mesh(mesh.vertices + lift[:, None] * [0, 1, 0], mesh.hexes)


@pytest.mark.parametrize("height", [0.2, 0.5])
def test_creases_that_make_det_j_negative_stay_smooth(height):
    mesh = bent_bar(height)
    edges = creases(mesh, np.radians(45))
    corners = kinks(mesh, edges, np.radians(45))
    assert min_detj(volumetric_spline(mesh, edges, corners)).min_scaled_detj < 1e-9
    found = min_detj(solid(mesh))
    assert found.min_scaled_detj > 0.8
    round_bar = min_detj(solid(mesh, sharp="none")).volume
    assert found.volume > 2 * height > round_bar - 1e-9  # convex kept: only the concave is filled


@pytest.mark.slow
def test_creases_that_the_fit_repairs_are_sharp(caplog):
    mesh = bent_bar(0.5)
    with caplog.at_level(logging.INFO):
        found = min_detj(h2s()(boundary(mesh), mesh))
    assert "creases: all; 36 sharp" in caplog.text
    assert "16 elements, 36 sharp edges, 0 straight hexes" in caplog.text
    assert found.lower_bound > 0
    assert found.volume == pytest.approx(1, rel=2e-3)


def test_creases_that_the_fit_cannot_repair_have_straight_hexes(caplog):
    mesh = bent_bar(0.5)
    with caplog.at_level(logging.INFO):
        found = min_detj(h2s(fit={"iterations": 1, "rounds": 0})(boundary(mesh), mesh))
    assert "(not valid); 34 sharp edges for" in caplog.text
    assert "16 elements, 36 sharp edges, 8 straight hexes" in caplog.text
    assert found.lower_bound > 0
    assert found.volume == pytest.approx(1, rel=1e-9)


def test_harmless_creases_are_sharp():
    assert min_detj(solid(bent_bar(1.0))).volume == pytest.approx(2, rel=1e-12)


def test_logs_the_deciding_quantities(caplog):
    mesh = hex_box((2, 2, 2))
    with caplog.at_level(logging.INFO):
        solid(mesh)
    assert "27 functions, 8 elements, 24 sharp edges, 0 straight hexes" in caplog.text
    assert "0 extraordinary edges, volume 1" in caplog.text
    assert "not valid" not in caplog.text
    solid(hex_mesh(mesh.vertices * [-1, 1, 1], mesh.hexes))
    assert "not valid: det J is not positive everywhere" in caplog.text


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"sharp": "manual"},
            "sharp must be auto, none, a list of edges or a file of edges; got 'manual'",
        ),
        ({"angle": 0}, "angle must be a number, above 0 and below 180; got 0"),
        ({"angle": 180}, "got 180"),
    ],
)
def test_invalid_options_are_refused_with_a_reason(options, message):
    with pytest.raises(ValueError, match=message):
        h2s(**options)
