"""The stages of the bundle parametric."""

from functools import cache

import numpy as np
import pytest

from polycube.config import compose
from polycube.errors import MeshingError
from polycube.fitting.snapping import exceeded_limits
from polycube.hexmesh.connectivity import check_conforming
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.registry import build
from polycube.stages import check_chain
from polycube.structure.rough_map import affine_map
from polycube.testing import check_plugin
from polycube.types import Json, Labels
from tests.fixtures.charts import ring


@cache
def bundle() -> Json:
    return compose("infer", ["meshing=parametric"])["meshing"]


def stage(kind: str, **options: object):
    return build(f"meshing/{kind}", bundle()[kind] | options)


@pytest.fixture(scope="module")
def torus():
    """A torus, its polycube, its parametrization and a rough map that is too large."""
    surface, polycube, _, places = ring()
    rough_map = affine_map(polycube, np.diag([6.0, 6.0, 1.4]), np.array([-3, -3, -0.7]))
    return surface, polycube, places, rough_map


def test_order_is_a_chain_and_portfolio_names_its_options():
    check_chain(
        bundle()["order"], ("surface", "polycube", "rough_map", "blocks", "parametrization")
    )
    for variant in bundle()["portfolio"]:
        for kind, options in variant.items():
            stage(kind.removeprefix("meshing/"), **options)


@pytest.mark.slow
def test_from_labels_to_an_accepted_mesh(torus):
    surface, polycube, places, rough_map = torus
    labels = stage("segment")(surface, polycube, places)
    found = stage("map", longest=0.04)(surface, polycube, labels, places, rough_map)
    mesh = stage("subdivide", size="5%")(surface, polycube, found)
    mesh = stage("smooth", rounds=8)(surface, mesh)
    mesh = stage("pillow", rounds=6)(surface, mesh)
    mesh = stage("optimize", soft_rounds=6, hard_rounds=4)(surface, mesh)
    check_conforming(mesh)
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.5
    assert not exceeded_limits(inspect(mesh, surface))


def test_map_conforms_to_its_kind():
    check_plugin("meshing/map", {"plugin": "harmonic", "level": 2, "longest": 0.05})


@pytest.mark.slow
def test_equal_input_gives_an_equal_map(torus):
    surface, polycube, places, rough_map = torus
    labels = stage("segment")(surface, polycube, places)
    make = stage("map", level=1, longest=0.06)
    one, two = (make(surface, polycube, labels, places, rough_map) for _ in range(2))
    np.testing.assert_array_equal(one.positions, two.positions)
    assert [len(k) for k in (one.x, one.y, one.z)] == [7, 7, 3]


def test_a_structure_of_the_wrong_genus_is_refused_with_the_failing_face(torus):
    surface, polycube, places, rough_map = torus
    filled = type(polycube)(np.ones((1, 1, 1), bool), *([0, 1],) * 3, polycube.grid, ("cube",))
    labels = Labels(np.zeros(len(surface.faces)), np.zeros(len(surface.faces)))
    with pytest.raises(MeshingError, match=r"does not fit the surface: .*polycube face \d \("):
        stage("map", longest=0.06)(surface, filled, labels, places, rough_map)


@pytest.mark.parametrize("wrong", [{"level": -1}, {"longest": 0.0}])
def test_options_out_of_range_are_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        stage("map", **wrong)
