import logging

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.hexmesh.connectivity import hex_mesh
from polycube.io.hex_meshes import boundary, patches
from polycube.registry import build
from tests.fixtures.hexmeshes import hex_box

STEEL = {"young": 210e9, "poisson": 0.3, "density": 7850}


def modal(**options):
    return build("analysis", {"plugin": "modal", **options})


def static(**options):
    return build("analysis", {"plugin": "static", **options})


def poisson(**options):
    return build("analysis", {"plugin": "poisson", **options})


@pytest.fixture(scope="module")
def spline():
    """Box of 100 x 20 x 10 mm, a patch per side."""
    mesh = hex_box((4, 1, 1), (100.0, 20.0, 10.0))
    mesh = hex_mesh(mesh.vertices, mesh.hexes, mesh.quads, patches(mesh))
    return build("spline", {"plugin": "h2s"})(boundary(mesh), mesh)


def test_steel_bar(spline, caplog):
    with caplog.at_level(logging.INFO):
        modes = modal(modes=10)(spline)
    assert modes.mass == pytest.approx(0.1 * 0.02 * 0.01 * 7850, rel=1e-9)
    assert modes.shapes.shape == (10, len(spline.control), 3)
    assert "mass 0.157 kg; elastic modes at" in caplog.text


def test_named_material_and_its_numbers_are_the_same(spline):
    named, given = modal(modes=8)(spline), modal(modes=8, material=STEEL)(spline)
    assert given.eigenvalues.tolist() == named.eigenvalues.tolist()
    assert modal(modes=8, material="aluminium")(spline).mass < 0.4 * named.mass


def test_options_reach_the_solver(spline):
    plain = modal(modes=8)(spline).frequency[7]
    assert modal(modes=8, units="m")(spline).frequency[7] == pytest.approx(plain / 1000, rel=1e-9)
    assert modal(modes=8, mass="lumped")(spline).frequency[7] < plain
    coarse = modal(modes=8, gauss=2)(spline).frequency[7]
    assert coarse != plain and coarse == pytest.approx(plain, rel=0.1)


def test_number_of_rigid_motions_with_a_clamped_end_and_a_sliding_side(spline):
    assert modal(modes=8)(spline).rigid == 6
    assert modal(modes=8, fixed=["x_min"])(spline).rigid == 0
    sliding = modal(modes=8, fixed=[{"at": "z_min", "components": ["z"]}])(spline)
    assert sliding.rigid == 3
    assert abs(sliding.eigenvalues[:3]).max() < 1e-6 * sliding.eigenvalues[3]
    bottom = spline.control[:, 2] == 0
    assert abs(sliding.shapes[:, bottom, 2]).max() < 1e-12 * abs(sliding.shapes).max()


def test_places_by_name_number_box_and_plane_are_the_same(spline):
    number = int(spline.patch[(spline.sides == [0, 0]).all(axis=1)][0])
    box, plane = {"box": [0, 0, 0, 0, 20, 10]}, {"plane": [1, 0, 0, 0]}
    found = [
        modal(modes=3, fixed=[place])(spline).eigenvalues.tolist()
        for place in ("x_min", number, str(number), box, {"at": plane})
    ]
    assert all(values == found[0] for values in found)


WEIGHT = 0.1 * 0.02 * 0.01 * 7850 * 9.81  # N, of the bar


def test_the_reaction_at_the_foot_is_the_weight(spline, caplog):
    with caplog.at_level(logging.INFO):
        found = static()(spline)
    assert found.load == pytest.approx([0, 0, -WEIGHT], rel=1e-9)
    assert found.reactions == pytest.approx(-found.load[None], abs=1e-9 * WEIGHT)
    assert found.supports == ("z_min",)
    assert "load 0 0 -1.54 N" in caplog.text


def test_loads_add_up(spline):
    loads = [
        {"at": "x_max", "force": [3.0, 0.0, 0.0]},
        {"at": "x_max", "traction": [0.0, 1e4, 0.0]},  # on 200 mm^2
        {"at": "z_max", "pressure": 500.0},  # on 2000 mm^2
    ]
    found = static(fixed=["x_min"], loads=loads)(spline)
    assert found.load == pytest.approx([3.0, 2.0, -1.0], rel=1e-9)
    weighing = static(fixed=["x_min"], loads=loads, gravity=[0, 0, -9.81])(spline)
    assert weighing.load == pytest.approx([3.0, 2.0, -1.0 - WEIGHT], rel=1e-9)


def test_a_bar_pulled_by_displacement(spline):
    """Sides free to contract: stress E e, reaction E e A, energy force times displacement / 2."""
    held = [{"at": f"{axis}_min", "components": axis} for axis in "xyz"]
    pulled = {"at": "x_max", "components": ["x"], "value": 0.1}
    found = static(fixed=[*held, pulled])(spline)
    stress = 210e9 * 1e-3
    assert found.von_mises == pytest.approx(np.full(len(found.von_mises), stress), rel=1e-9)
    assert found.reactions[3, 0] == pytest.approx(stress * 200e-6, rel=1e-9)
    assert found.reactions[0, 0] == pytest.approx(-stress * 200e-6, rel=1e-9)
    assert found.strain_energy == pytest.approx(stress * 200e-6 * 1e-4 / 2, rel=1e-9)


def test_away_limits_the_region_near_a_support(spline):
    load = {"at": "x_max", "force": [0.0, 0.0, -10.0]}
    places = []
    for away in (0.0, 0.3):
        found = static(fixed=["x_min"], loads=[load], away=away)(spline)
        reach = away * np.linalg.norm([100, 20, 10])
        assert found.singular.what == "border of x_min"
        assert reach <= found.singular.at[0] < reach + 5
        places.append(found.peak.at[0])
    assert places[0] == pytest.approx(25) and places[1] > 0.3 * np.linalg.norm([100, 20, 10])


def test_heat_flows_through_a_bar(spline, caplog):
    ends = [{"at": "x_min", "value": 20.0}, {"at": "x_max", "value": 30.0}]
    with caplog.at_level(logging.INFO):
        found = poisson(conductivity=40.0, fixed=ends)(spline)
    assert found.values == pytest.approx(20 + 0.1 * spline.control[:, 0], abs=1e-9)
    assert found.flows == pytest.approx([-0.8, 0.8], rel=1e-9)  # 40 x 10 / 0.1 x 2e-4
    assert found.flux == pytest.approx(np.tile([-4000.0, 0, 0], (len(found.flux), 1)), abs=1e-6)
    assert "-0.8 W at x_min, 0.8 W at x_max, supplied 0 W" in caplog.text


def test_supplied_heat_leaves_through_the_prescribed_places(spline):
    given = [{"at": "z_max", "value": 1000.0}]  # 2 W on 2000 mm^2
    found = poisson(fixed=[{"at": "x_min", "value": 0}], flux=given, source=1e5)(spline)
    assert found.supplied == pytest.approx(2.0 + 1e5 * 2e-5, rel=1e-9)
    assert found.flows == pytest.approx([-found.supplied], rel=1e-9)


def test_refuses_too_few_supports_and_missing_places(spline):
    with pytest.raises(InputError, match="leave 3 of 6 rigid motions free"):
        static(fixed=[{"at": "z_min", "components": ["z"]}])(spline)
    with pytest.raises(InputError, match="leave 6 of 6 rigid motions free"):
        static(fixed=[])(spline)
    with pytest.raises(InputError, match=r"u is determined only up to a constant"):
        poisson(fixed=[])(spline)
    with pytest.raises(
        InputError, match=r"no boundary set 'hole_1'; there are x_min, .*z_max, pat"
    ):
        static(fixed=["hole_1"])(spline)
    with pytest.raises(InputError, match=r"lies in box 1 1 1 2 2 2; the part fills 0 0 0 to 100 "):
        modal(fixed=[{"box": [1, 1, 1, 2, 2, 2]}])(spline)


@pytest.mark.parametrize(
    ("plugin", "options", "message"),
    [
        (modal, {"fixed": "x_min"}, r"fixed must be a list such as \[x_min\]; got 'x_min'"),
        (modal, {"fixed": [1.5]}, "boundary faces are a patch number, .*; got 1.5"),
        (modal, {"fixed": [{"box": [1, 2]}]}, "boundary faces are a patch number"),
        (modal, {"fixed": [{"at": "x_min", "value": 1}]}, "entries of fixed are {at: place, co"),
        (static, {"fixed": [{"at": 1, "components": ["u"]}]}, "components must be some of x, y, z"),
        (static, {"fixed": [{"at": 1, "value": [1, 2]}]}, "fixed: value must be 3 numbers"),
        (
            static,
            {"loads": [{"at": {"edge": [1, 2]}, "pressure": 1}]},
            "loads act on faces, an edge",
        ),
        (
            static,
            {"loads": ["x_max"]},
            "entries of loads are {at: place, bearing, force, moment, point, pre",
        ),
        (static, {"loads": [{"at": 1, "force": 3}]}, "loads: force must be 3 numbers; got 3"),
        (static, {"loads": [{"at": 1, "pressure": "p"}]}, "loads: pressure must be a number"),
        (static, {"loads": [{"at": 1, "moment": [1]}]}, "loads: moment must be 3 numbers"),
        (static, {"loads": [{"at": 1, "point": [1, 2, 3]}]}, "point is where a force or a moment"),
        (static, {"temperature": [20]}, "temperature must be a number or an expression of x, y, z"),
        (
            static,
            {"temperature": 20, "material": {"young": 1.0, "poisson": 0.3, "density": 1.0}},
            "temperature needs the expansion of the material",
        ),
        (static, {"rotation": {"axis": [0, 0, 0], "rpm": 10}}, "an axis .* that is not zero"),
        (static, {"rotation": {"axis": [0, 0, 1], "speed": 1}}, "rotation takes axis, rpm, point"),
        (static, {"preloads": {"force": 1}}, "preloads are .{point, axis, force}, .*; got {'force"),
        (static, {"preloads": [3]}, "preloads are .{point, axis, force}, .*; got .3"),
        (static, {"preloads": [{"force": 1}]}, "each of preloads has a point .x, y, z., an axis"),
        (static, {"preloads": [{"at": "x_max"}]}, "preloads takes point, axis, force; got 'at'"),
        (static, {"cyclic": {"axis": [0, 0, 1]}}, "cyclic has a number of sectors, 2 or more"),
        (static, {"cyclic": {"sectors": 6, "angle": 60}}, "cyclic takes sectors, axis, point"),
        (static, {"cyclic": {"sectors": 6, "axis": [1, 0, 0]}}, "must be along that of cyclic"),
        (static, {"gravity": [1, 2]}, "gravity must be 3 numbers"),
        (static, {"gauss": 1}, "gauss must be a whole number, 2 or more; got 1"),
        (static, {"away": 1.0}, "away must be a share of the diagonal, 0 <= away < 1; got 1.0"),
        (static, {"material": "wood"}, "material must be one of steel"),
        (poisson, {"fixed": ["x_min"]}, "entries of fixed are {at: place, value}; got 'x_min'"),
        (poisson, {"flux": [{"at": 1, "value": [1]}]}, "flux: value must be a number"),
        (poisson, {"conductivity": -1.0}, "conductivity must be a number, above 0; got -1.0"),
        (poisson, {"units": "parsec"}, "units must be one of m"),
    ],
)
def test_invalid_boundary_conditions_are_refused_with_a_reason(plugin, options, message):
    with pytest.raises(ValueError, match=message):
        plugin(**options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"material": "wood"}, "material must be one of steel, .*; got 'wood'"),
        ({"material": {"young": 1}}, "material must be .*; got {'young': 1}"),
        ({"material": {"young": -1, "poisson": 0.3, "density": 1}}, "material needs young > 0"),
        ({"units": "parsec"}, "units must be one of m, .*; got 'parsec'"),
        ({"mass": "row"}, "mass must be one of consistent, lumped; got 'row'"),
        ({"modes": 0}, "modes must be a whole number, 1 or more; got 0"),
        ({"gauss": 1}, "gauss must be a whole number, 2 or more; got 1"),
    ],
)
def test_invalid_options_are_refused_with_a_reason(options, message):
    with pytest.raises(ValueError, match=message):
        modal(**options)
