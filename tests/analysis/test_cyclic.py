"""Sectors with cyclic symmetry: the result of the whole, exact answers, faces that do not match."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from polycube.analysis.constraints import Support, constrain, free_rigid_motions
from polycube.analysis.cyclic import Sector, cut_faces, matched
from polycube.analysis.modal import free_modes
from polycube.analysis.poisson import conduct
from polycube.analysis.problem import MATERIALS, Cyclic, Flow, Material, Rotation
from polycube.analysis.static import Load, deform
from polycube.errors import InputError
from polycube.hexmesh.connectivity import hex_mesh
from tests.fixtures.hexmeshes import hex_box
from tests.fixtures.splines import mapped, spline_of

SIX = Cyclic(6)
STEEL = MATERIALS["steel"]
INNER, OUTER = 0, 1  # local faces -xi and +xi of the elements


def wavy(x):
    """A ring without a plane of symmetry, with six waves; the cut faces are curved."""
    u, v, w = np.moveaxis(x, -1, 0)
    around = np.pi / 3 * v
    radius = 1 + u * (1 + 0.15 * np.sin(6 * around))
    angle = around + 0.25 * u + 0.1 * w
    height = 0.6 * w + 0.2 * u + 0.1 * np.cos(6 * around) * w
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=-1)


def ring(sectors: int):
    """Some sectors of the wavy ring; all six are closed."""
    spline = mapped(hex_box((1, 2 * sectors, 1), (1, sectors, 1)), wavy)
    ends = np.isin(spline.sides[:, 1], (2, 3)) & (sectors == 6)
    return replace(spline, sides=spline.sides[~ends], patch=spline.patch[~ends])


@pytest.fixture(scope="module")
def sector():
    return ring(1)


@pytest.fixture(scope="module")
def whole():
    return ring(6)


def on(spline, side):
    return np.flatnonzero(spline.sides[:, 1] == side)


def nodes_of(sector, whole):
    """The Bezier nodes of the whole at those of the sector."""
    points = [spline.extraction @ spline.control for spline in (sector, whole)]
    apart, own = cKDTree(points[1]).query(points[0])
    assert apart.max() < 1e-9
    return own


def polar(x):
    """A sector of 60 degrees of a tube with radii 1 and 2 and height 0.5, from a unit cube."""
    u, v, w = np.moveaxis(x, -1, 0)
    angle = np.pi / 3 * v
    return np.stack([(1 + u) * np.cos(angle), (1 + u) * np.sin(angle), 0.5 * w], axis=-1)


def tube():
    """The same as hexes."""
    box = hex_box((2, 2, 1))
    return hex_mesh(polar(box.vertices), box.hexes)


@pytest.mark.slow
def test_the_modes_of_a_sector_are_the_symmetric_modes_of_the_whole(sector, whole):
    own = free_modes(sector, STEEL, 6, "m", cyclic=SIX, enrich=True)
    every = free_modes(whole, STEEL, 40, "m", enrich=True)
    assert own.rigid == 2
    turned = np.stack([whole.control, SIX.turned(whole.control)])
    image = cKDTree(whole.control).query(turned[1])[1]
    symmetric = [
        value
        for value, shape in zip(every.eigenvalues[6:], every.shapes[6:], strict=True)
        if abs(shape[image] - shape @ SIX.turn.T).max() < 1e-3 * abs(shape).max()
    ]
    assert len(symmetric) == 4
    assert own.eigenvalues[2:] == pytest.approx(symmetric, rel=1e-6)


def test_the_modes_of_a_spline_have_the_symmetry_exactly():
    spline = spline_of(tube(), "h2s", cyclic={"sectors": 6})
    pairs = Sector.of(spline, SIX)
    modes = free_modes(spline, STEEL, 5, cyclic=SIX, enrich=True)
    assert modes.rigid == 2 and (modes.eigenvalues[2:] > 0).all()
    first, second = modes.shapes[:, pairs.functions.T].swapaxes(0, 1)
    assert second == pytest.approx(first @ SIX.turn.T, abs=1e-9 * abs(modes.shapes).max())


def test_a_turning_sector_under_pressure_deforms_like_the_whole(sector, whole):
    given = [(0, 0, -9.81), "m", 4, 0.02, Rotation((0, 0, 1), 3000.0)]

    def solved(spline, cyclic):
        hub = [Support("hub", on(spline, INNER))]
        push = [Load(on(spline, OUTER), pressure=2e5)]
        return deform(spline, STEEL, hub, push, *given, cyclic=cyclic)

    one, six = solved(sector, SIX), solved(whole, None)
    wanted = six.displacement[nodes_of(sector, whole)]
    assert one.displacement == pytest.approx(wanted, abs=1e-6 * abs(wanted).max())
    assert 6 * one.strain_energy == pytest.approx(six.strain_energy, rel=1e-9)
    turns = [np.linalg.matrix_power(SIX.turn, k) for k in range(6)]
    reaction = sum(turn @ one.reactions[0] for turn in turns)
    assert reaction == pytest.approx(six.reactions[0], abs=1e-6 * abs(one.reactions).max())


def test_a_sector_conducts_heat_like_the_whole(sector, whole):
    def solved(spline, cyclic):
        cold = [Support("cold", on(spline, INNER), (0,))]
        return conduct(spline, 50.0, cold, [Flow(on(spline, OUTER), 1e3)], cyclic=cyclic)

    one, six = solved(sector, SIX), solved(whole, None)
    wanted = (whole.extraction @ six.values)[nodes_of(sector, whole)]
    assert sector.extraction @ one.values == pytest.approx(wanted, rel=1e-9)
    assert 6 * one.flows == pytest.approx(six.flows, rel=1e-9)


@pytest.mark.parametrize(("sectors", "counts"), [(2, (1, 2, 1)), (4, (1, 1, 1))])
def test_a_sector_may_contain_the_axis(sectors, counts):
    """A half and a quarter of a square plate: on the axis, only motions along it are symmetric."""
    about = Cyclic(sectors)
    part = hex_box(counts, counts)
    part = hex_mesh(part.vertices - [0, counts[1] - 1, 0], part.hexes)
    whole = hex_box((2, 2, 1), (2, 2, 1))
    whole = hex_mesh(whole.vertices - [1, 1, 0], whole.hexes)
    part, every = (mapped(mesh, lambda x: x) for mesh in (part, whole))
    own, all_modes = (
        free_modes(spline, STEEL, number, "m", cyclic=cyclic)
        for spline, number, cyclic in ((part, 6, about), (every, 60, None))
    )
    assert own.rigid == 2
    for value in own.eigenvalues[2:]:
        assert abs(all_modes.eigenvalues / value - 1).min() < 1e-6
    axis = np.flatnonzero(np.hypot(*part.control[:, :2].T) < 1e-9)
    assert abs(own.shapes[:, axis, :2]).max() < 1e-9 * abs(own.shapes).max()


def test_a_thick_tube_under_pressure_is_that_of_lame():
    """Plane strain; a node line on a cut face holds the rotation about the axis."""
    push, inner, outer, solid = 1e-3, 1.0, 2.0, Material(1.0, 0.3, 1.0)
    spline = mapped(hex_box((4, 3, 1)), polar)
    points = spline.extraction @ spline.control
    line = np.flatnonzero(np.linalg.norm(points[:, :2] - [inner, 0], axis=1) < 1e-9)
    line = line[np.argsort(points[line, 2])][None]
    ends = np.flatnonzero(np.isin(spline.sides[:, 1], (4, 5)))
    held = [Support("ends", ends, (2,)), Support("line", ends[:0], (1,), edges=line)]
    load = Load(on(spline, INNER), pressure=push)
    found = deform(spline, solid, held, [load], length_unit="m", cyclic=SIX)
    radius = np.linalg.norm(points[:, :2], axis=1)
    nodes = np.unique(spline.nodes[:, [0, 3, 12, 15, 48, 51, 60, 63]])
    r, nu = radius[nodes], solid.poisson
    exact = (1 + nu) * push * inner**2 / (outer**2 - inner**2) * ((1 - 2 * nu) * r + outer**2 / r)
    outwards = points[nodes] * [1, 1, 0] / r[:, None]
    assert found.displacement[nodes] == pytest.approx(exact[:, None] * outwards, abs=1e-5 * push)
    assert abs(found.reactions[1]).max() < 1e-9


def test_two_rigid_motions_are_symmetric(sector):
    hub = on(sector, INNER)
    pairs = Sector.of(sector, SIX)
    for components, free in (((), 2), ((2,), 1), ((0,), 1), ((0, 2), 0)):
        held = [Support("hub", hub, components)] if components else []
        assert free_rigid_motions(sector, constrain(sector, held, 3, pairs)) == free
    with pytest.raises(InputError, match="cyclic symmetry leave 1 of 6 rigid motions free"):
        deform(sector, STEEL, [Support("hub", hub, (2,))], cyclic=SIX)


def test_prescribed_values_must_be_symmetric(sector):
    hub = on(sector, INNER)
    along = Support("hub", hub, value=(0.0, 0.0, 0.1))
    found = deform(sector, STEEL, [along], length_unit="m", cyclic=SIX)
    assert found.displacement == pytest.approx(np.tile([0, 0, 0.1], (len(found.stress), 1)))
    with pytest.raises(InputError, match="prescribed at the two cut faces differ"):
        deform(sector, STEEL, [Support("hub", hub, value=(0.1, 0.0, 0.0))], cyclic=SIX)


def test_cut_faces_with_equal_quads_are_made_equal():
    mesh = tube()
    x = mesh.vertices.copy()
    inside = np.isclose(x[:, 1], 0) & np.isclose(x[:, 0], 1.5)
    x[inside, 0] += 0.2
    crooked = hex_mesh(x, mesh.hexes)
    with pytest.raises(InputError, match="the cut faces of the spline differ by up to"):
        Sector.of(spline_of(crooked, "h2s"), SIX)
    first, second = cut_faces(x, crooked.quads, SIX)
    assert len(first) == len(second) == 2
    moved = matched(x, crooked.quads, SIX)
    own, image = (np.unique(crooked.quads[quads]) for quads in (first, second))
    apart, _ = cKDTree(SIX.turned(moved[own])).query(moved[image])
    assert apart.max() < 1e-12 and np.array_equal(moved[own], x[own])
    spline = spline_of(crooked, "h2s", cyclic={"sectors": 6})
    a, b = Sector.of(spline, SIX).functions.T
    assert spline.control[b] == pytest.approx(SIX.turned(spline.control[a]), abs=1e-12)


def test_of_two_sectors_each_is_the_image_of_the_other():
    part = hex_box((1, 2, 1), (1, 2, 1))
    x = part.vertices - [0, 1, 0]
    x[(x == [0, 1, 0]).all(axis=1), 1] = 0.9
    moved = matched(x, part.quads, Cyclic(2))
    cut = moved[abs(moved[:, 0]) < 1e-9]
    apart, _ = cKDTree(cut).query(Cyclic(2).turned(cut))
    assert len(cut) == 6 and apart.max() < 1e-12


def test_a_mesh_without_equal_cut_faces_is_refused():
    mesh = tube()
    wrong = (Cyclic(5), Cyclic(7), Cyclic(60), Cyclic(6, (1, 0, 0)), Cyclic(6, point=(0.5, 0, 0)))
    for about in wrong:
        with pytest.raises(InputError, match="there are no cut faces"):
            cut_faces(mesh.vertices, mesh.quads, about)
    less = hex_mesh(*without(mesh, mesh.vertices[mesh.hexes].mean(axis=1)[:, 1].argmax()))
    with pytest.raises(InputError, match=r"the 2 and 1 quads .* are not connected alike"):
        matched(less.vertices, less.quads, SIX)


def without(mesh, number):
    """Vertices and hexes without one hex."""
    used, hexes = np.unique(np.delete(mesh.hexes, number, axis=0), return_inverse=True)
    return mesh.vertices[used], hexes.reshape(-1, 8)
