"""Supports that end inside a smooth part of the boundary."""

import logging

import numpy as np
import pytest

from polycube.analysis.boundary_sets import faces_of, quads_of, zero_slope_edges
from polycube.analysis.constraints import Support, constrain
from polycube.analysis.poisson import conduct
from polycube.errors import InputError
from polycube.hexmesh.connectivity import hex_mesh
from polycube.io.hex_meshes import boundary
from polycube.registry import build
from polycube.spline.spaces.sharp_features import border
from polycube.spline.spaces.sharpness import NO_EDGES, SMOOTH_BORDER, Creases, Sharp, Trial
from polycube.types import HexMesh
from tests.fixtures.hexmeshes import hex_box, hex_cylinder

COLD, HOT, ASIDE, CAPS = 0, 1, 2, 3


def quartered(mesh: HexMesh) -> HexMesh:
    """A column whose side is divided into quarters around the axis: cold, free, hot, free."""
    middle = mesh.vertices[mesh.quads].mean(axis=1) - mesh.vertices.mean(axis=0)
    quarter = (middle[:, 0] > 0) * 2 + (middle[:, 1] > 0)
    patch = np.array([ASIDE, COLD, HOT, ASIDE])[quarter]
    low, high = mesh.vertices[:, 2].min(), mesh.vertices[:, 2].max()
    level = mesh.vertices[mesh.quads][..., 2]
    patch[(level == low).all(axis=1) | (level == high).all(axis=1)] = CAPS
    return hex_mesh(mesh.vertices, mesh.hexes, mesh.quads, patch)


COLUMNS = {
    "square": lambda n: quartered(hex_box((n, n, 2))),
    "round": lambda n: quartered(hex_cylinder(n // 2, n // 2, 2)),
}
SURFACES = {"square": boundary(COLUMNS["square"](2)), "round": boundary(COLUMNS["round"](32))}


def solid(column, n, space, held):
    return build("spline", {"plugin": space, "held": held})(SURFACES[column], COLUMNS[column](n))


def conductance(column, n, space, held=(COLD, {"at": HOT, "value": 1.0})):
    """Conductance per height between opposite quarters of the side of a column."""
    spline = solid(column, n, space, held)
    ends = [Support(str(k), faces_of(spline, k), (0,), float(k)) for k in (COLD, HOT)]
    return conduct(spline, 1.0, ends, length_unit="m").flows[1] / np.ptp(spline.control[:, 2])


@pytest.mark.parametrize(
    ("column", "space"), [("square", "h2s"), ("square", "optimal"), ("round", "h2s")]
)
def test_conductance_between_quarters_of_a_symmetric_column_is_one(column, space):
    """Exact by duality: turned by a quarter, the others are held, and both times it is the same.

    Where supports end the flux is infinite, so that the error goes with the size of the hexes.
    """
    coarse, fine = (conductance(column, n, space) - 1 for n in (4, 8))
    assert 0 < fine < 0.045
    assert 1.7 < coarse / fine < 2.6


def test_without_sharp_borders_too_much_is_constrained_and_logged(caplog):
    with caplog.at_level(logging.WARNING):
        conductance("square", 4, "h2s")
    assert not caplog.records
    with caplog.at_level(logging.WARNING):
        assert conductance("square", 4, "h2s", held=()) > 1.9
    assert "smooth at 8 of the 24 edges round the supports" in caplog.text


@pytest.mark.parametrize(("space", "flat"), [("h2s", 4), ("optimal", 4), ("c0", 0)])
def test_number_of_edges_with_zero_slope(space, flat):
    for held, expected in (((), flat), ((COLD,), 0)):
        spline = solid("square", 2, space, held)
        faces = faces_of(spline, COLD)
        constraints = constrain(spline, [Support("cold", faces, (0,))], 1)
        assert zero_slope_edges(spline, faces, constraints.basis) == (expected, 4 + 4)


def test_no_edge_has_zero_slope_if_all_faces_are_constrained():
    spline = solid("square", 2, "h2s", ())
    every = np.arange(len(spline.sides))
    constraints = constrain(spline, [Support("all", every, (0,))], 1)
    assert zero_slope_edges(spline, every, constraints.basis) == (0, 0)


def test_cost_of_a_lost_border_is_proportional_to_its_share():
    mesh = COLUMNS["square"](2)
    ring = border(mesh, quads_of(mesh, COLD))
    found = Creases(mesh, NO_EDGES, np.radians(45), True, ring)
    assert len(ring) == 8 and found.lost(found.harmless()) == 0
    half = Sharp(ring[:4], NO_EDGES[:, 0])
    assert found.lost(half) == 0.5
    spline = solid("square", 2, "h2s", ())
    costs = [Trial.of("", spline, half, SURFACES["square"], 0.1, lost).cost for lost in (0, 0.5)]
    assert costs[1] - costs[0] == pytest.approx(SMOOTH_BORDER / 2)


def test_a_missing_place_is_refused():
    with pytest.raises(InputError, match="no boundary set 'hole_1'"):
        solid("square", 2, "h2s", ("hole_1",))
    with pytest.raises(ValueError, match="boundary faces are a patch number"):
        solid("square", 2, "h2s", ("left",))
