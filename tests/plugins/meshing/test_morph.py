"""The stages of the morph backend, one after the other."""

import numpy as np
import pytest
import trimesh
import yaml

from polycube import HOME
from polycube.errors import MeshingError
from polycube.geometry.hexes import check_conforming
from polycube.geometry.quality import accept, deviation, scaled_jacobian
from polycube.geometry.rough_map import affine_map
from polycube.kinds import check_chain
from polycube.registry import build
from polycube.types import Polycube, TriMesh

MORPH = yaml.safe_load((HOME / "conf" / "meshing" / "morph.yaml").read_text())


def stage(kind: str, **options: object):
    name = next(d[kind] for d in MORPH["defaults"] if kind in d)
    config = yaml.safe_load((HOME / "conf" / "meshing" / kind / f"{name}.yaml").read_text())
    return build(f"meshing/{kind}", config | options)


@pytest.fixture(scope="module")
def cylinder() -> TriMesh:
    mesh = trimesh.creation.cylinder(radius=1, height=3, sections=32)
    return TriMesh(mesh.vertices, mesh.faces)


@pytest.fixture(scope="module")
def template(cylinder):
    bar = Polycube(np.ones((1, 1, 1)), [0, 2], [0, 1], [0, 1], (2, 1, 1), ("cube", "cube"))
    along = np.array([[0, 1.6, 0], [0, 0, 1.6], [1.5, 0, 0]])
    rough_map = affine_map(bar, along, -along @ [1, 0.5, 0.5])
    return stage("subdivide", size=0.1)(cylinder, bar, rough_map)


def test_order_is_a_chain_and_portfolio_names_its_options():
    check_chain(MORPH["order"], ("surface", "polycube", "rough_map", "parametrization"))
    for variant in MORPH["portfolio"]:
        for kind, options in variant.items():
            stage(kind.removeprefix("meshing/"), **options)


def test_from_template_to_an_accepted_mesh(cylinder, template):
    mesh = stage("smooth", rounds=10)(cylinder, template)
    mesh = stage("pillow")(cylinder, mesh)
    assert len(mesh.hexes) > len(template.hexes)
    mesh = stage("optimize", soft_rounds=9, hard_rounds=6)(cylinder, mesh)
    check_conforming(mesh)
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.7
    assert deviation(mesh, cylinder).vertices < 1e-9
    assert accept(mesh, cylinder)
    assert set(mesh.patch) == set(template.patch)
    middle = mesh.vertices[mesh.hexes].mean(axis=1)
    assert (middle[mesh.cell == 0, 2] < 0.3).all() and (middle[mesh.cell == 1, 2] > -0.3).all()


def test_pillow_covers_all_or_none(cylinder, template):
    assert stage("pillow", patches="none")(cylinder, template) is template
    mesh = stage("pillow", patches="all", rounds=1)(cylinder, template)
    assert len(mesh.hexes) == len(template.hexes) + len(template.quads)


def test_pillow_refuses_other_words():
    with pytest.raises(ValueError, match="patches must be auto, all, none; got 'some'"):
        stage("pillow", patches="some")


def test_subdivide_cuts_finer_and_refuses_no_size(cylinder):
    bar = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    rough_map = affine_map(bar, np.diag([2.0, 2.0, 3.0]), np.array([-1.0, -1.0, -1.5]))
    coarse = stage("subdivide", size=0.1)(cylinder, bar, rough_map)
    fine = stage("subdivide", size=0.1, finer=2.0)(cylinder, bar, rough_map)
    assert (len(coarse.hexes), len(fine.hexes)) == (5 * 5 * 7, 10 * 10 * 15)
    for name in ("size", "finer", "coarse"):
        with pytest.raises(ValueError, match=f"{name} must be positive; got 0"):
            stage("subdivide", **{name: 0})


@pytest.mark.slow
def test_subdivide_counts_before_it_begins(cylinder):
    cube = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    box = affine_map(cube, np.diag([2.0, 2.0, 2.0]), -np.ones(3))
    with pytest.raises(MeshingError, match=r"size 1e-07 asks for .* more than max_hexes 100000"):
        stage("subdivide", size=1e-7)(cylinder, cube, box)


def test_parts_keep_their_quality(testdata):
    """A box of hexes round a real part gives a valid mesh of it."""
    part = trimesh.load(testdata / "surfaces" / "ddpm_dice.obj")
    surface = TriMesh(part.vertices, part.faces)
    cube = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    extent = np.ptp(surface.vertices, axis=0)
    rough_map = affine_map(cube, np.diag(extent), surface.vertices.min(axis=0))
    mesh = stage("subdivide")(surface, cube, rough_map)
    for kind in ("smooth", "pillow", "optimize"):
        mesh = stage(kind)(surface, mesh)
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.5
    assert accept(mesh, surface)
