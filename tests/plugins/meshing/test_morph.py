"""The stages of the bundle morph, in sequence."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import trimesh

from polycube.config import compose
from polycube.errors import BadOption, MeshingError
from polycube.fitting.snapping import exceeded_limits
from polycube.hexmesh.connectivity import check_conforming
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.quality import deviation
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.registry import build
from polycube.stages import check_chain
from polycube.structure.rough_map import affine_map
from polycube.types import Json, Polycube, TriMesh


@cache
def bundle() -> Json:
    return compose("infer", ["meshing=morph"])["meshing"]


def stage(kind: str, **options: object):
    return build(f"meshing/{kind}", bundle()[kind] | options)


@pytest.fixture(scope="module")
def cylinder() -> TriMesh:
    mesh = trimesh.creation.cylinder(radius=1, height=3, sections=32)
    return TriMesh(mesh.vertices, mesh.faces)


def _bar():
    bar = Polycube(np.ones((1, 1, 1)), [0, 2], [0, 1], [0, 1], (2, 1, 1), ("cube", "cube"))
    along = np.array([[0, 1.6, 0], [0, 0, 1.6], [1.5, 0, 0]])
    return bar, affine_map(bar, along, -along @ [1, 0.5, 0.5])


@pytest.fixture(scope="module")
def template(cylinder):
    return stage("subdivide", size="10%")(cylinder, *_bar())


def test_order_is_a_chain_and_portfolio_names_its_options():
    check_chain(bundle()["order"], ("surface", "polycube", "rough_map", "blocks"))
    for variant in bundle()["portfolio"]:
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
    assert not exceeded_limits(inspect(mesh, cylinder))
    assert set(mesh.patch) == set(template.patch)
    middle = mesh.vertices[mesh.hexes].mean(axis=1)
    assert (middle[mesh.cell == 0, 2] < 0.3).all() and (middle[mesh.cell == 1, 2] > -0.3).all()


def test_smooth_without_rounds_does_not_change_the_hexes(cylinder, template):
    assert stage("smooth", rounds=0)(cylinder, template) is template


def test_pillow_covers_all_or_none(cylinder, template):
    assert stage("pillow", patches="none")(cylinder, template) is template
    mesh = stage("pillow", patches="all", rounds=1)(cylinder, template)
    assert len(mesh.hexes) == len(template.hexes) + len(template.quads)


def test_pillow_refuses_unknown_options():
    with pytest.raises(ValueError, match="patches must be one of auto, all, none; got 'some'"):
        stage("pillow", patches="some")


def test_subdivide_divides_intervals_and_requires_a_size(cylinder):
    bar = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    rough_map = affine_map(bar, np.diag([2.0, 2.0, 3.0]), np.array([-1.0, -1.0, -1.5]))
    coarse = stage("subdivide", size="10%")(cylinder, bar, rough_map)
    fine = stage("subdivide", size="10%", finer=2.0)(cylinder, bar, rough_map)
    assert (len(coarse.hexes), len(fine.hexes)) == (5 * 5 * 7, 10 * 10 * 15)
    for name in ("size", "finer", "coarse"):
        with pytest.raises(ValueError, match=rf"{name} must be a .*(positive|above 0).*; got 0"):
            stage("subdivide", **{name: 0})


@pytest.fixture
def box():
    cube = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    return cube, affine_map(cube, np.diag([2.0, 2.0, 3.0]), np.array([-1.0, -1.0, -1.5]))


def test_subdivide_refuses_too_many_hexes_and_suggests_a_size(cylinder, box):
    with pytest.raises(MeshingError, match=r"size 1e-07 needs .* hexes, more than max_hexes 999;"):
        stage("subdivide", size=1e-7, max_hexes=999)(cylinder, *box)
    with pytest.raises(MeshingError, match=r"level 9 needs 1.34e\+08 hexes, .* size") as refusal:
        stage("subdivide", level=9, max_hexes=999)(cylinder, *box)
    size = float(str(refusal.value).split("; size ")[1].split()[0])
    assert 0.8 * 999 < len(stage("subdivide", size=size, coarse=size)(cylinder, *box).hexes) <= 999


def test_subdivide_by_octree_level(cylinder, box):
    mesh = stage("subdivide", level=2)(cylinder, *box)
    assert len(mesh.hexes) == 4**3
    with pytest.raises(BadOption, match=r"level must be null or a whole number, 0 to 10; got 2\.5"):
        stage("subdivide", level=2.5)


@pytest.mark.parametrize(
    "size", ["fine", "5", "-5%", "%", "nan%", 0, -1, float("inf"), True, None, [1]]
)
def test_subdivide_refuses_an_invalid_size(size):
    with pytest.raises(BadOption, match="size must be a positive number"):
        stage("subdivide", size=size)


@pytest.mark.parametrize(
    "region",
    [
        "box",
        {"size": "1%"},
        {"box": [0, 0, 0, 1, 1], "size": "1%"},
        {"box": [0] * 6, "size": 1},
        {"box": [0, 0, 0, 1, 1, 1], "size": 1, "along": "u"},
    ],
)
def test_subdivide_refuses_an_invalid_region(region):
    with pytest.raises(BadOption, match="a region is"):
        stage("subdivide", regions=[region])


def test_hexes_are_finer_in_a_region(cylinder, box):
    """Slabs through the box become finer, with a gradual transition; other slabs do not change."""
    region = {"box": [-2, -2, 1.0, 2, 2, 1.6], "size": 0.1}
    plain = stage("subdivide", size=0.4)(cylinder, *box)
    mesh = stage("subdivide", size=0.4, regions=[region])(cylinder, *box)
    check_conforming(mesh)
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0
    middle = mesh.vertices[mesh.hexes].mean(axis=1)[:, 2]
    heights = np.ptp(mesh.vertices[mesh.hexes][:, :, 2], axis=1)
    assert np.median(heights[middle > 1.1]) == pytest.approx(0.1, rel=0.25)
    assert np.median(heights[middle < 0]) == pytest.approx(0.4, rel=0.3)
    wide = stage("subdivide", size=0.4, regions=[region | {"size": 10.0}])(cylinder, *box)
    assert len(wide.hexes) == len(plain.hexes) < len(mesh.hexes)


def test_curvature_adds_parts_around_a_cylinder_but_not_along_it(cylinder, template):
    plain = stage("subdivide", size="10%", curvature=None)(cylinder, *_bar())
    fine = stage("subdivide", size="10%", curvature="0.2%")(cylinder, *_bar())
    assert len(plain.hexes) < len(fine.hexes) <= 2 * len(plain.hexes)
    layers = [len(np.unique(np.round(m.vertices[:, 2], 9))) for m in (plain, fine)]
    assert layers[0] == layers[1]
    few = stage("subdivide", size="10%", curvature="0.2%", max_hexes=len(fine.hexes) - 1)
    assert len(few(cylinder, *_bar()).hexes) == len(plain.hexes)
    level = [stage("subdivide", level=2, curvature=c)(cylinder, *_bar()) for c in (None, "0.1%")]
    assert len(level[0].hexes) == len(level[1].hexes)


@pytest.mark.slow
def test_chords_are_shorter_on_cad_faces_and_for_smaller_sizes(cylinder):
    cad = replace(cylinder, region=np.ones(len(cylinder.faces), int))

    def number(surface: TriMesh, size: str = "10%", **options: object) -> int:
        return len(stage("subdivide", size=size, **options)(surface, *_bar()).hexes)

    assert number(cylinder) == number(cylinder, curvature="0.3%")
    assert number(cad) == number(cad, curvature="0.2%") > number(cad, curvature="2%")
    assert number(cad, features="off") == number(cad, features="off", curvature="0.3%")
    finer = stage("subdivide", size="10%").finer_options(1.4)
    assert finer == {"finer": 1.4}
    asked = number(cylinder, finer=1.4, curvature="0.3%")
    assert asked == number(cylinder, size=f"{10 / 1.4}%", curvature=f"{0.3 / 1.4**2}%")


@pytest.mark.slow
def test_refine_reaches_the_deviation_or_gives_a_reason(cylinder, caplog):
    mesh = stage("subdivide", size="12%")(cylinder, *_bar())
    mesh = stage("pillow")(cylinder, stage("smooth", rounds=10)(cylinder, mesh))
    mesh = stage("optimize", soft_rounds=6, hard_rounds=4)(cylinder, mesh)
    assert stage("refine")(cylinder, mesh) is mesh
    assert stage("refine", deviation="20%")(cylinder, mesh) is mesh
    apart = deviation(mesh, cylinder)
    asked = 0.7 * max(apart.to_mesh.p99, apart.to_surface.p99)
    finer = stage("refine", deviation=f"{100 * asked}%")(cylinder, mesh)
    assert len(finer.hexes) == 8 * len(mesh.hexes)
    apart = deviation(finer, cylinder)
    assert max(apart.to_mesh.p99, apart.to_surface.p99) <= asked
    assert not caplog.records and not finer.warnings
    few = {"max_hexes": len(finer.hexes) - 1}
    kept = stage("refine", deviation=f"{100 * asked}%", **few)(cylinder, mesh)
    assert (kept.hexes == mesh.hexes).all() and (kept.vertices == mesh.vertices).all()
    assert len(kept.warnings) == 1 and "more than max_hexes" in kept.warnings[0]
    assert "more than max_hexes" in caplog.text and "smaller meshing.size" in caplog.text


@pytest.mark.parametrize("options", [{"deviation": "near"}, {"times": -1}, {"max_hexes": 0}])
def test_refine_refuses_invalid_options(options):
    with pytest.raises(BadOption, match=next(iter(options))):
        stage("refine", **options)


@pytest.mark.slow
def test_quality_of_real_parts(testdata):
    """A box of hexes around a real part becomes a valid mesh of the part."""
    part = trimesh.load(testdata / "surfaces" / "ddpm_dice.obj")
    surface = TriMesh(part.vertices, part.faces)
    cube = Polycube(np.ones((1, 1, 1)), [0, 1], [0, 1], [0, 1], (1, 1, 1), ("cube",))
    extent = np.ptp(surface.vertices, axis=0)
    rough_map = affine_map(cube, np.diag(extent), surface.vertices.min(axis=0))
    mesh = stage("subdivide")(surface, cube, rough_map)
    for kind in ("smooth", "pillow", "optimize"):
        mesh = stage(kind)(surface, mesh)
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.5
    assert not exceeded_limits(inspect(mesh, surface))
