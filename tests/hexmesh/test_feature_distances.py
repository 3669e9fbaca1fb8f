"""Known distances of points, curves and faces from a hex mesh."""

import numpy as np
import pytest

from polycube.hexmesh.inspection import inspect
from polycube.surface.measures import diagonal
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


def test_without_cad_faces_there_are_no_features():
    assert inspect(cut(bar(), 0.25), box((0, 0, 0), (2, 1, 1))).features == []
