"""Preloads: bars exactly, frames with a bolt, sectors, and sections that do not exist."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from polycube.analysis.boundary_sets import faces_of
from polycube.analysis.constraints import Support
from polycube.analysis.loads import Load
from polycube.analysis.preloads.preload import Preload
from polycube.analysis.preloads.sections import CORNERS, sections
from polycube.analysis.problem import Cyclic, Material
from polycube.analysis.recovery import samples
from polycube.analysis.static import deform
from polycube.errors import InputError
from polycube.spline.boundary import corner_nodes
from tests.fixtures.hexmeshes import clamp, hex_box
from tests.fixtures.splines import box, mapped, spline_of, unclamped

SOLID = Material(3.0, 0.3, 2.0, 1e-3)
FORCE, LENGTH = 5e-4, 4.0
CENTRE = (1.9, 0.4, 0.4)
SPACES = {
    "h2s": lambda: box((8, 2, 2), (LENGTH, 1, 1), "h2s"),
    "two hexes": lambda: box((2, 2, 2), (LENGTH, 1, 1)),
    "c0": lambda: box((4, 1, 1), (LENGTH, 1, 1), "c0"),
    "two levels": lambda: spline_of(
        hex_box((14, 1, 1), (LENGTH, 1, 1)),
        "h2s",
        refine={"boxes": [{"box": [3.5, 0, 0, LENGTH, 1, 1]}]},
    ),
}


def rollers(spline, *names):
    """Supports against the motion of faces along their normals."""
    return [Support(name, faces_of(spline, name), ("xyz".index(name[0]),)) for name in names]


def ends(spline, every=True):
    held = (0, 1, 2) if every else (0,)
    return [Support(name, faces_of(spline, name), held) for name in ("x_min", "x_max")]


@pytest.mark.parametrize("space", SPACES)
def test_the_stress_of_a_bar_between_rollers_is_that_of_its_preload(space):
    """sigma = F / A everywhere; the section closes by F L / E A."""
    spline = SPACES[space]()
    held = rollers(spline, "x_min", "x_max", "y_min", "z_min")
    found = deform(
        spline, SOLID, held, length_unit="m", preloads=[Preload(CENTRE, (2, 0, 0), FORCE)]
    )
    stress = np.tile([FORCE, 0, 0, 0, 0, 0], (len(found.stress), 1))
    assert found.stress == pytest.approx(stress, abs=1e-12 * FORCE)
    strain = FORCE / SOLID.young
    assert found.sections == pytest.approx(np.array([[FORCE, FORCE, strain * LENGTH]]))
    assert found.reactions[:2, 0] == pytest.approx([-FORCE, FORCE])
    assert found.strain_energy == pytest.approx(FORCE * strain * LENGTH / 2)
    x, u = (
        samples(spline, each) for each in (spline.extraction @ spline.control, found.displacement)
    )
    points, one = spline.extraction @ spline.control, Preload(CENTRE, (1, 0, 0))
    [(section, _)] = sections(points, spline.nodes[:, CORNERS], [one])
    along = x[section[:, 0], :, 0]
    before, after = x[..., 0] < along.min() + 1e-9, x[..., 0] > along.max() - 1e-9
    assert u[before][:, 0] == pytest.approx(strain * x[before][:, 0], abs=1e-12 * strain)
    assert u[after][:, 0] == pytest.approx(strain * (x[after][:, 0] - LENGTH), abs=1e-12 * strain)
    assert found.stress_error < 1e-9 and found.load == pytest.approx(np.zeros(3), abs=1e-18)


@pytest.mark.parametrize("way", [1, -1])
def test_weight_and_heat_act_together_with_the_preload(way):
    """The stress at the section, at the end of a hex, is F / A; heat adds to the tightening."""
    spline, gravity, heat = box((8, 2, 2), (LENGTH, 1, 1)), 1e-3, 0.5
    held = rollers(spline, "x_min", "x_max", "y_min", "z_min")
    found = deform(
        spline,
        replace(SOLID, poisson=0.0),
        held,
        acceleration=(gravity, 0, 0),
        length_unit="m",
        temperature=heat,
        preloads=[Preload(CENTRE, (way, 0, 0), FORCE)],
    )
    x = (spline.extraction @ spline.control)[:, 0]
    at = 2.0 if way > 0 else 1.5
    weight = SOLID.density * gravity
    assert found.stress[:, 0] == pytest.approx(FORCE - weight * (x - at), abs=1e-12)
    mean = FORCE - weight * (LENGTH / 2 - at)
    amount = LENGTH * (mean / SOLID.young + SOLID.expansion * heat)
    assert found.sections == pytest.approx(np.array([[FORCE, FORCE, amount]]))
    assert found.reactions[:2, 0] == pytest.approx(
        [-FORCE - weight * at, FORCE - weight * (LENGTH - at)]
    )


def test_the_force_along_an_oblique_axis_passes_through_the_bar():
    """The section has steps, since the hexes are not across the axis."""
    spline, axis = box((8, 3, 3), (LENGTH, 1, 1), "h2s"), np.array([1, 0.6, 0.2])
    preload = Preload(CENTRE, tuple(axis), FORCE)
    found = deform(spline, SOLID, ends(spline), length_unit="m", preloads=[preload])
    along = found.reactions @ (axis / np.linalg.norm(axis))
    assert along == pytest.approx([-FORCE, FORCE], rel=1e-9)
    assert found.sections[0, 1] == pytest.approx(FORCE, rel=1e-3)


def bolt(height, axis=(0, 0, 1), force=FORCE):
    """A preload in the middle column of a clamp."""
    return Preload((2.5, 0.5, height), axis, force)


def clamped(mesh, loads=(), preloads=(), material=SOLID, held=()):
    spline = spline_of(mesh, "h2s")
    floor = Support("floor", faces_of(spline, "z_min"))
    pushes = [Load(faces_of(spline, place), **load) for place, load in loads]
    held = [floor, *rollers(spline, *held)]
    return spline, deform(spline, material, held, pushes, length_unit="m", preloads=preloads)


def test_a_longer_bolt_is_tightened_by_the_compliance_of_bolt_and_columns():
    """F dL / E (1 / A + 1 / 2 A) more: the plates yield the same at both lengths.

    The sides are held, so that the columns do not bend.
    """
    solid, held = replace(SOLID, poisson=0.0), ("x_min", "x_max")
    short, long = (
        clamped(clamp(n), (), [bolt(2 + n / 2)], solid, held)[1].sections[0, 2] for n in (6, 10)
    )
    assert long - short == pytest.approx(4 * FORCE / SOLID.young * 1.5, rel=2e-3)


def test_forces_on_the_faces_of_a_gap_do_the_same_as_a_preload():
    """The bolt without a hex in the middle, pulled at both ends: equal displacement elsewhere."""
    whole, found = clamped(clamp(7), preloads=[bolt(5.5)])
    faces = {z: {"box": [2, 0, z, 3, 1, z]} for z in (5, 6)}
    loads = [(faces[5], {"force": (0, 0, FORCE)}), (faces[6], {"force": (0, 0, -FORCE)})]
    gap, pulled = clamped(clamp(7, [(2, 0, 5)]), loads)
    x = whole.extraction @ whole.control
    apart, own = cKDTree(gap.extraction @ gap.control).query(x)
    same = (apart < 1e-9) & ((abs(x[:, 0] - 2.5) > 1) | (abs(x[:, 2] - 5.5) > 2.5))
    assert same.mean() > 0.8
    size = abs(found.displacement).max()
    assert found.displacement[same] == pytest.approx(
        pulled.displacement[own[same]], abs=2e-3 * size
    )
    columns = same & (abs(x[:, 2] - 5.5) < 1) & (abs(x[:, 0] - 2.5) > 1)
    assert found.stress[columns, 2].mean() == pytest.approx(-FORCE / 2, rel=1e-2)


def test_each_of_two_bolts_has_its_own_preload():
    """The columns at the sides are bolts; the middle resists both."""
    sides = [Preload((x, 0.5, 4.5), (0, 0, 1), f * FORCE) for x, f in ((0.5, 1), (4.5, 2))]
    _, found = clamped(clamp(5), preloads=sides)
    assert found.sections[:, 0] == pytest.approx([FORCE, 2 * FORCE])
    assert found.sections[:, 1] == pytest.approx([FORCE, 2 * FORCE], rel=2e-3)
    assert abs(found.reactions).max() < 1e-9 * FORCE


@pytest.mark.slow
def test_a_sector_with_a_bolt_is_like_the_whole():
    found = {}
    for sectors in (1, 6):
        spline = mapped(clamp(3, plate=1, times=sectors), _polar)
        sides = np.sort(corner_nodes(spline), axis=1)
        _, own, count = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
        outside = count[own.ravel()] == 1
        spline = replace(spline, sides=spline.sides[outside], patch=spline.patch[outside])
        at = np.stack([[5 * k + 2.5, 0.5, 2.3] for k in range(sectors)])
        preloads = [Preload(tuple(point), (0, 0, 1), FORCE) for point in _polar(at)]
        floor = Support("floor", faces_of(spline, {"plane": [0, 0, 1, 0]}))
        cyclic = Cyclic(6) if sectors == 1 else None
        own = deform(spline, SOLID, [floor], length_unit="m", preloads=preloads, cyclic=cyclic)
        found[sectors] = spline.extraction @ spline.control, own
    (points, one), (every, whole) = found[1], found[6]
    apart, own = cKDTree(every).query(points)
    assert apart.max() < 1e-9
    size = abs(whole.displacement).max()
    assert one.displacement == pytest.approx(whole.displacement[own], abs=1e-9 * size)
    assert np.tile(one.sections, (6, 1)) == pytest.approx(whole.sections)


def _polar(x):
    """A sixth of a ring from five units of x."""
    u, v, w = np.moveaxis(x, -1, 0)
    angle = np.pi / 15 * u
    return np.stack([(4 + v) * np.sin(angle), (4 + v) * np.cos(angle), w], axis=-1)


@pytest.mark.parametrize("height", [3.1, 5.9])
def test_the_section_is_that_of_the_column_with_the_point(height):
    mesh = clamp(5)
    [(section, layer)] = sections(mesh.vertices, mesh.hexes, [bolt(height)])
    assert section.tolist() == [[np.flatnonzero(layer)[0], 5]] and layer.sum() == 1
    low, high = mesh.vertices[mesh.hexes[layer]][0, [0, 6]]
    assert (low <= (2.5, 0.5, height)).all() and (high >= (2.5, 0.5, height)).all()


def test_the_section_of_a_plate_has_all_its_columns():
    mesh = clamp(5)
    [(section, layer)] = sections(mesh.vertices, mesh.hexes, [bolt(0.6)])
    assert len(section) == layer.sum() == 5


def test_a_solid_of_an_assembly_is_cut_alone_or_not_at_all():
    mesh = hex_box((4, 3, 3), (4, 3, 3))
    along = [Preload((1.5, 1.5, 1.5), (1, 0, 0))]
    [(section, _)] = sections(mesh.vertices, mesh.hexes, along)
    assert len(section) == 9
    middle = abs(mesh.vertices[mesh.hexes].mean(axis=1)[:, 1:] - 1.5).max(axis=1) < 1
    with pytest.raises(InputError, match="cuts several solids, whose meshes are joined there"):
        sections(mesh.vertices, mesh.hexes, along, middle)


BAR = [Preload(CENTRE, (1, 0, 0), FORCE)]


@pytest.mark.parametrize(
    ("preloads", "held", "why"),
    [
        ([Preload((5, 0.5, 0.5), (1, 0, 0), 1)], ends, "is not in the part"),
        ([Preload((3.9, 0.5, 0.5), (1, 0, 0), 1)], ends, "is at the end of the part"),
        (BAR, lambda spline: rollers(spline, "x_min", "y_min", "z_min"), "causes no force"),
        ([*BAR, Preload((0.7, 0.5, 0.5), (1, 0, 0), 1)], ends, "acts on the same bolt"),
        ([*BAR, Preload((1.8, 0.5, 0.5), (1, 0, 0), 1)], ends, "touches that of another one"),
        (BAR, lambda spline: [Support("y_min", faces_of(spline, "y_min"))], "section at a support"),
    ],
)
def test_impossible_sections_are_refused(preloads, held, why):
    spline = box((8, 2, 2), (LENGTH, 1, 1), "h2s")
    supports = held(spline)
    if why == "causes no force":  # against turning
        supports.append(Support("x_min", faces_of(spline, "x_min")))
    with pytest.raises(InputError, match=why):
        deform(spline, SOLID, supports, length_unit="m", preloads=preloads)


def test_a_section_at_the_border_of_refinement_is_refused():
    spline = SPACES["two levels"]()
    preload = Preload((2.5, 0.5, 0.5), (1, 0, 0), 1)
    with pytest.raises(InputError, match="at a border between refined"):
        deform(spline, SOLID, ends(spline), length_unit="m", preloads=[preload])


def test_a_section_across_the_cut_faces_of_a_sector_is_refused():
    spline = mapped(hex_box((5, 1, 8), (5, 1, 8)), _polar)
    floor = Support("floor", faces_of(spline, {"plane": [0, 0, 1, 0]}))
    preload = Preload(tuple(_polar(np.array([2.5, 0.5, 4]))), (0, 0, 1), 1)
    with pytest.raises(InputError, match="at a cut face"):
        deform(spline, SOLID, [floor], length_unit="m", preloads=[preload], cyclic=Cyclic(6))


def test_dependent_functions_are_cut_as_well():
    spline = unclamped(3)
    preload = Preload((0.5, 0.5, 0.5), (1, 0, 0), FORCE)
    found = deform(
        spline,
        SOLID,
        rollers(spline, "x_min", "x_max", "y_min", "z_min"),
        length_unit="m",
        preloads=[preload],
    )
    assert found.sections == pytest.approx(np.array([[FORCE, FORCE, FORCE / SOLID.young]]))
