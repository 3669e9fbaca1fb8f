"""Descriptions of material, supports and loads."""

from dataclasses import replace

import numpy as np
import pytest

from polycube.hexmesh.face_groups import measure
from polycube.hexmesh.named_sets import boundary_sets
from polycube.registry import build
from polycube.report.numbers.problem import numbers, problem_of, stress
from polycube.report.page.sections import problem as section
from polycube.report.pictures.colours import HELD, LOADED, rgb
from polycube.report.pictures.loads import spread, supports_and_loads
from tests.fixtures.hexmeshes import hex_box


@pytest.fixture(scope="module")
def mesh():
    """A block of 4 x 2 x 1 with the sets of its ends."""
    found = hex_box((4, 2, 1), (4, 2, 1))
    return replace(found, sets=boundary_sets(found))


def described(mesh, **analysis):
    return numbers(problem_of({"analysis": analysis}), mesh)


def test_supports_are_described_with_their_area(mesh):
    held = ["x_min", {"at": "z_min", "components": ["z"]}, {"box": [3.9, 0, 0, 4, 2, 1]}]
    found = described(mesh, plugin="static", fixed=held)
    assert found["supports"] == [
        {"words": "Face 'x_min' is clamped", "quads": 2, "area": pytest.approx(2)},
        {
            "words": "Face 'z_min' is held in z, free in x and y",
            "quads": 8,
            "area": pytest.approx(8),
        },
        {
            "words": "The faces in the box from (3.9, 0, 0) to (4, 2, 1) are clamped",
            "quads": 2,
            "area": pytest.approx(2),
        },
    ]
    assert found["units"] == "mm"
    assert found["material"] == (
        "Steel: Young's modulus 210 GPa, Poisson's ratio 0.3, density 7850 kg/m³"
    )
    weight = "Gravity of 9.81 m/s², in direction -z"
    assert found["loads"] == [{"words": weight, "quads": None, "area": None}]


def test_a_sector_is_described(mesh):
    about = {"sectors": 6, "point": [0, 0, 1]}
    [found] = described(mesh, plugin="modal", cyclic=about)["supports"]
    words = "The part is one of 6 equal sectors about (0, 0, 1), in direction +z"
    assert found == {"words": words, "quads": None, "area": None}


def test_a_preload_is_described(mesh):
    bolt = {"point": [2, 1, 0.5], "axis": [1, 0, 0], "force": 1e4}
    [found] = described(mesh, plugin="static", fixed=["x_min", "x_max"], preloads=[bolt])["loads"]
    words = "Preload of 10000 N at (2, 1, 0.5), in direction +x"
    assert found == {"words": words, "quads": None, "area": None}


def test_a_supported_edge_has_no_area(mesh):
    edge = {"at": {"edge": ["x_min", "z_min"]}, "components": ["z"]}
    [found] = described(mesh, plugin="modal", fixed=[edge])["supports"]
    words = "The edge between 'x_min' and 'z_min' is held in z, free in x and y"
    assert found == {"words": words, "quads": None, "area": None}
    problem = problem_of({"analysis": {"plugin": "modal", "fixed": [edge]}})
    assert len(supports_and_loads(mesh, problem)) > 1


def test_a_prescribed_displacement_and_a_plane(mesh):
    moved = {"at": {"plane": [1, 0, 0, 4]}, "components": ["x", "y"], "value": [0.1, 0]}
    found = described(mesh, plugin="static", fixed=["x_min", moved], units="cm", material="abs")
    assert found["supports"][1]["words"] == (
        "The faces on the plane 1 x + 0 y + 0 z = 4 are moved by 0.1 cm in x, held in y, free in z"
    )
    assert found["loads"] == [] and found["material"].startswith("Abs: Young's modulus 2.3 GPa")


def test_loads_are_described_with_size_and_direction(mesh):
    loads = [
        {"at": "z_max", "pressure": 2e6, "force": [0, 0, -100]},
        {"at": "x_max", "traction": [3e3, 4e3, 0]},
        {"at": "y_max", "pressure": -5},
    ]
    found = [row["words"] for row in described(mesh, plugin="static", loads=loads)["loads"]]
    assert found == [
        "Pressure of 2 MPa on face 'z_max'",
        "Force of 100 N on face 'z_max', in direction -z, distributed evenly",
        "Traction of 5 kPa on face 'x_max', in direction (0.6, 0.8, 0)",
        "Suction of 5 Pa on face 'y_max'",
    ]
    assert [stress(x) for x in (99e3, 1e5, 1.0)] == ["99 kPa", "0.1 MPa", "1 Pa"]


def test_heat_and_free_vibration(mesh):
    flux = [{"at": "x_max", "value": 1000}]
    found = described(mesh, plugin="poisson", flux=flux, source=3.0)
    assert found["material"] == "Conductivity 50 W/(m K)"
    assert found["supports"][0]["words"] == "Face 'z_min' is kept at 0 K"
    assert [row["words"] for row in found["loads"]] == [
        "Flux of 1000 W/m² into face 'x_max'",
        "Heat source of 3 W/m³ in the whole part",
    ]
    free = described(mesh, plugin="modal")
    assert free["supports"] == [] == free["loads"]
    assert "The part is free" in section({"problem": free}, {})
    assert problem_of({}) is None and section({}, {}) == ""


def test_the_picture_has_symbols_at_held_and_loaded_faces(mesh):
    loads = [{"at": "z_max", "pressure": 1.0}, {"at": "x_max", "force": [2.0, 0, 0]}]
    posed = build("analysis", {"plugin": "static", "fixed": ["x_min"], "loads": loads}).problem
    part, cones, arrows = supports_and_loads(mesh, posed)[:3]
    assert (part.colours[mesh.sets["x_min"]] == rgb((HELD,))).all()
    assert (part.colours[mesh.sets["z_max"]] == rgb((LOADED,))).all()
    assert cones.points[:, 0].max() == pytest.approx(0) and cones.points[:, 0].min() < -0.1
    assert arrows.points[:, 2].max() > 1.3  # the pressure comes from above
    assert arrows.points[:, 0].max() > 4.3  # the force pulls
    bare = supports_and_loads(mesh, build("analysis", {"plugin": "modal"}).problem)
    assert len(bare) == 2 and len(supports_and_loads(mesh, posed)) == 6


def test_partial_supports_and_gravity_have_symbols_along_their_axis(mesh):
    held = [{"at": "z_min", "components": ["z"]}]
    posed = build("analysis", {"plugin": "static", "fixed": held}).problem
    _, cones, arrow = supports_and_loads(mesh, posed)[:3]
    assert cones.points[:, 2].max() == pytest.approx(0)
    assert arrow.points[:, 2].min() > 1 and np.ptp(arrow.points[:, 2]) > np.ptp(arrow.points[:, 0])


def test_symbols_are_spread_over_a_face():
    fine = hex_box((10, 10, 1))
    faces = measure(fine.vertices[fine.quads])
    top = np.flatnonzero(faces.middle[:, 2] == 1)
    chosen = faces.middle[spread(faces, top, 0.0, 5)]
    assert len(chosen) == 5 and np.isin(spread(faces, top, 0.0, 5), top).all()
    apart = np.linalg.norm(chosen[:, None] - chosen, axis=2) + 9 * np.eye(5)
    assert apart.min() > 0.5
    assert len(spread(faces, top[:3], 0.0)) == 3
    wide = faces.middle[spread(faces, top, 0.7)]
    assert (np.linalg.norm(wide[:, None] - wide, axis=2) + np.eye(len(wide)) >= 0.7).all()
    assert 2 <= len(wide) <= 4
