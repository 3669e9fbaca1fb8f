"""Known distances of points, curves and faces from a hex mesh."""

import numpy as np
import pytest

from polycube.hexmesh.feature_distances import Feature
from polycube.hexmesh.inspection import inspect
from polycube.surface.measures import diagonal
from polycube.types import Goal
from tests.fixtures.hexmeshes import drilled_plate, drilled_plate_surface
from tests.fixtures.polycubes import bar, cut
from tests.fixtures.surfaces import box, halved_box


def test_a_mesh_of_the_part_loses_no_feature():
    found = inspect(cut(bar(), 0.25), halved_box()).features
    kinds = [each.kind for each in found]
    assert [kinds.count(kind) for kind in ("point", "curve", "face")] == [10, 15, 7]
    assert max(each.distance for each in found) < 1e-12
    assert {each.shape for each in found if each.kind == "curve"} == {"line"}


def test_a_curve_across_the_middle_of_quads_is_lost():
    """Hexes of 2 / 3 along x: the curve at x = 1 lies in the middle of a quad."""
    mesh = cut(bar(), 0.25)
    x = mesh.vertices.copy()
    x[:, 0] = np.interp(x[:, 0], np.linspace(0, 2, 9), [0, 0.2, 0.4, 0.6, 4 / 3, 1.5, 1.7, 1.8, 2])
    part = halved_box()
    found = inspect(mesh.__class__(x, mesh.hexes, mesh.quads, mesh.patch, mesh.cell), part).features
    lost = [each for each in found if each.distance > 0.01]
    assert sorted(each.kind for each in lost) == ["curve", "point", "point"]
    curve = next(each for each in lost if each.kind == "curve")
    assert curve.faces == (6, 7) and curve.place == pytest.approx((1, 0.5, 1))
    ends = [each for each in lost if each.kind == "point"]
    assert [each.distance * diagonal(part) for each in ends] == pytest.approx([1 / 3] * 2)
    # the nearest edges are those along x that it crosses, 1 / 4 apart
    assert curve.distance * diagonal(part) == pytest.approx(0.95 / 8, rel=0.02)


@pytest.mark.parametrize(("n", "is_lost"), [(4, True), (8, False), (16, False)])
def test_a_round_hole_is_lost_by_its_own_size(n, is_lost):
    """The rims, a chord's height off: .3 % of the diagonal would permit a triangle."""
    found = inspect(drilled_plate(n), drilled_plate_surface()).features
    rims = [each for each in found if each.shape == "circle"]
    assert len(rims) == 2 and {each.is_lost for each in rims} == {is_lost}
    height = 2 * (1 - np.cos(np.pi / n))
    unit = diagonal(drilled_plate_surface())
    for rim in rims:
        assert rim.size * unit == pytest.approx(1, rel=0.01)  # half the radius
        assert rim.distance * unit == pytest.approx(height, rel=0.05)
        assert rim.distance < Goal.features
        assert rim.excess(Goal()) == pytest.approx(height / (0.2 * 1), rel=0.05)
    assert not any(each.is_lost for each in found if each not in rims)


def test_the_limit_is_the_smaller_one():
    rim = Feature("curve", "circle", (1, 2), (0, 0, 0), distance=0.004, size=0.01)
    assert rim.excess(Goal()) == pytest.approx(0.004 / 0.002)
    large = Feature("curve", "circle", (1, 2), (0, 0, 0), distance=0.004, size=1.0)
    assert large.excess(Goal()) == pytest.approx(0.004 / 0.003)
    assert large.is_lost and large.excess(Goal(features=0.01)) < 1
    assert rim.excess(Goal(feature_share=0.5)) == pytest.approx(0.004 / 0.003)


def test_without_cad_faces_there_are_no_features():
    assert inspect(cut(bar(), 0.25), box((0, 0, 0), (2, 1, 1))).features == []
