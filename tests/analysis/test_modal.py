import re
from dataclasses import replace

import meshio
import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import eye, kron

from polycube.analysis.modal import free_modes, lowest
from polycube.analysis.problem import MATERIALS, Material
from polycube.hexmesh.connectivity import hex_mesh
from polycube.spline.bezier import bezier_points, min_detj
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.sharp_features import edges_between, single_hex_edges
from polycube.types import HexMesh
from tests.conftest import first_quick
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder, unit_cubes
from tests.fixtures.splines import box
from tests.fixtures.splines import spline_of as fitted
from tests.oracles.matrices import assemble


def box_spline(counts, high):
    mesh = hex_box(counts, high)
    return volumetric_spline(mesh, single_hex_edges(mesh))


def spline_of(mesh):
    return volumetric_spline(mesh, single_hex_edges(mesh))


def sliding_cube(n):
    """Lowest 9 eigenvalues of the unit cube whose faces slide without friction."""
    spline = box_spline((n, n, n), (1.0, 1.0, 1.0))
    stiffness, mass = assemble(spline, 1.0, 0.3, 1.0)
    free = np.flatnonzero((spline.control.ravel() % 1) != 0)  # no normal motion on a face
    mass = kron(mass, eye(3), "csr")
    return lowest(stiffness.tocsr()[free][:, free], mass[free][:, free], 9)[0]


def test_sliding_cube_has_its_shear_and_pressure_waves():
    shear, pressure = 1 / 2.6, 2 / 2.6 + 0.3 / (1.3 * 0.4)
    exact = np.pi**2 * np.array([2 * shear] * 3 + [3 * shear] * 2 + [pressure] * 3)
    assert exact == pytest.approx([7.592] * 3 + [11.388] * 2 + [13.28601] * 3, rel=1e-6)
    found = sliding_cube(6)
    assert found[:8] == pytest.approx(exact, rel=0.005)
    assert found[8] == pytest.approx(np.pi**2 * 5 * shear, rel=0.01)


def axial_errors(n, is_held):
    """Relative errors of the first three axial modes of a bar with Poisson's ratio 0."""
    spline = box_spline((n, 1, 1), (1.0, 0.2, 0.3))
    stiffness, mass = assemble(spline, 1.0, 0.0, 1.0)
    station = np.round(spline.control[:, 0] * n).astype(int)
    along = np.zeros((len(station), 3, n + 1))
    along[np.arange(len(station)), 0, station] = 1  # u_x, the same all over a cross section
    basis = along.reshape(-1, n + 1)[:, 1:-1] if is_held else along.reshape(-1, n + 1)
    k, m = basis.T @ stiffness @ basis, basis.T @ kron(mass, eye(3)) @ basis
    values = eigh(k, m, eigvals_only=True)
    return values[0 if is_held else 1 :][:3] / (np.pi * np.arange(1, 4)) ** 2 - 1


def test_free_bar_converges_with_the_third_power_and_clamped_bar_with_the_sixth():
    assert axial_errors(8, False) == pytest.approx([1.08e-3, 4.67e-3, 1.22e-2], rel=0.01)
    assert axial_errors(8, True) == pytest.approx([1.31e-7, 1.03e-5, 1.60e-4], rel=0.01)
    for is_held, rate in ((False, 3.0), (True, 6.0)):
        steps = np.log2(axial_errors(8, is_held)[0] / axial_errors(16, is_held)[0])
        assert steps == pytest.approx(rate, abs=0.15)


@pytest.mark.parametrize("mesh", [hex_ball(2), hex_cylinder(2, 2, 2)], ids=["ball", "cylinder"])
def test_six_rigid_modes_and_mass_normalised_shapes(mesh):
    spline = spline_of(mesh)
    modes = free_modes(spline, MATERIALS["steel"], 12)
    assert abs(modes.eigenvalues[:6]).max() < 1e-8 * modes.eigenvalues[6]
    assert (np.diff(modes.eigenvalues[6:]) >= 0).all()
    metres = replace(spline, control=spline.control * 1e-3)
    stiffness, mass = assemble(metres, 210e9, 0.3, 7850)
    u = modes.shapes.reshape(12, -1).T
    assert u.T @ kron(mass, eye(3)) @ u == pytest.approx(np.eye(12), abs=1e-9)
    elastic = u.T @ stiffness @ u
    scale = modes.eigenvalues[6]
    assert elastic / scale == pytest.approx(np.diag(modes.eigenvalues) / scale, abs=1e-7)
    residual = stiffness @ u - kron(mass, eye(3)) @ u * modes.eigenvalues
    assert abs(residual).max() < 1e-9 * abs(stiffness @ u).max()
    assert modes.mass == pytest.approx(7850 * 1e-9 * min_detj(spline).volume, rel=1e-3)


def test_axial_mode_of_a_steel_bar_in_hertz():
    spline = box_spline((12, 1, 1), (200.0, 30.0, 20.0))
    modes = free_modes(spline, Material(210e9, 0.0, 7850), 24, "mm")
    expected = np.sqrt(210e9 / 7850) / (2 * 0.2)  # c / 2 L = 12930.5 Hz
    assert abs(modes.frequency / expected - 1).min() < 3e-4
    assert modes.units == {"length": "mm", "mass": "kg", "time": "s", "frequency": "Hz"}
    assert modes.mass == pytest.approx(0.2 * 0.03 * 0.02 * 7850, rel=1e-9)


def test_bending_of_a_slender_beam():
    length, height = 1.0, 0.03
    spline = box_spline((24, 1, 1), (length, height, height))
    modes = free_modes(spline, Material(1.0, 0.0, 1.0), 8, "m")
    slender = 22.37329 / (2 * np.pi) * np.sqrt(height**2 / 12) / length**2
    assert modes.frequency[6:] == pytest.approx([slender] * 2, rel=0.01)


def test_unit_and_size_scale_the_frequency():
    spline = spline_of(hex_cylinder(1, 1, 1))
    steel = MATERIALS["steel"]
    in_mm = free_modes(spline, steel, 10, "mm")
    in_m = free_modes(replace(spline, control=spline.control / 1000), steel, 10, "m")
    assert in_m.frequency[6:] == pytest.approx(in_mm.frequency[6:], rel=1e-9)
    assert in_m.mass == pytest.approx(in_mm.mass, rel=1e-12)
    inches = free_modes(spline, steel, 10, "in")
    assert inches.frequency[6:] == pytest.approx(in_mm.frequency[6:] / 25.4, rel=1e-9)


def test_modes_are_reproducible():
    spline = spline_of(hex_ball(2))
    first, again = (free_modes(spline, MATERIALS["steel"], 10) for _ in range(2))
    assert np.array_equal(first.eigenvalues, again.eigenvalues)
    assert np.array_equal(first.shapes, again.shapes)


def test_lumped_mass_preserves_the_mass_and_lowers_the_frequencies():
    spline = spline_of(hex_ball(2))
    steel = MATERIALS["steel"]
    full, lumped = (free_modes(spline, steel, 9, lumped=lumped) for lumped in (False, True))
    assert lumped.mass == pytest.approx(full.mass, rel=1e-12)
    assert (lumped.frequency[6:] < full.frequency[6:]).all()


@pytest.mark.parametrize("n_modes", [0, 24])
def test_refuses_too_many_modes(n_modes):
    with pytest.raises(ValueError, match=rf"modes must be in \[1, 23\]; got {n_modes}"):
        free_modes(box_spline((1, 1, 1), (1, 1, 1)), MATERIALS["steel"], n_modes)


@pytest.mark.parametrize("values", [(0, 0.3, 1), (1, 0.5, 1), (1, 0.3, -1)])
def test_refuses_impossible_materials(values):
    with pytest.raises(ValueError, match="material needs"):
        Material(*values)


@pytest.fixture(scope="session")
def rod(testdata):
    """The published rod: level 0, sharp vertices by list."""
    folder = testdata / "rod_benchmark"
    given = meshio.read(folder / "rod_hex_paper_used.vtk")
    mesh = hex_mesh(given.points, given.cells_dict["hexahedron"])
    lines = (folder / "sharp.txt").read_text().splitlines()
    vertices = np.array([int(line.split()[-1]) for line in lines if line.split()])
    return volumetric_spline(mesh, edges_between(mesh, vertices))


def test_rod_has_the_published_volume(rod):
    assert len(rod.control) == 1815 and len(rod.nodes) == 1280
    assert rod.extraordinary_edges == 8
    assert min_detj(rod).volume == pytest.approx(193.642166, abs=2e-6)
    assert bezier_points(rod).shape == (1280, 64, 3)


@pytest.mark.slow
def test_rod_has_the_published_modes_with_the_solver_s_settings(rod, testdata):
    """Row-sum mass and 3 Gauss points; the published space has a few functions of level 1 more."""
    text = (testdata / "rod_benchmark" / "eigout").read_text()
    rows = re.findall(r"^ +(\d+) +(\S+) +\S+ +(\S+) +\S+$", text, re.M)[:20]
    published = np.array([[float(value) for value in row[1:]] for row in rows])
    modes = free_modes(rod, Material(50, 0.3, 1), 20, "m", n_gauss=3, lumped=True)
    assert modes.eigenvalues[6:] == pytest.approx(published[6:, 0], rel=5e-4)
    assert modes.frequency[6:] == pytest.approx(published[6:, 1], rel=5e-4)
    assert modes.mass == pytest.approx(193.642, rel=1e-5)


@pytest.mark.slow
def test_rod_modes_with_consistent_mass(rod):
    expected = [0.21190, 0.26165, 0.81966, 0.84272, 0.93361, 1.77123, 2.17870, 2.22009]
    modes = free_modes(rod, Material(50, 0.3, 1), 14, "m")
    assert modes.eigenvalues[6:] == pytest.approx(expected, rel=2e-5)


def test_enriched_frequencies_are_those_of_all_continuous_tricubic_functions():
    """Of h2s, whose own frequencies are too high by several per cent; the shapes stay."""
    spline, other = (box((6, 2, 2), (6.0, 1.5, 1.0), space) for space in ("h2s", "c0"))
    solid = Material(3.0, 0.3, 2.0)
    plain, better = (free_modes(spline, solid, 12, "m", enrich=e) for e in (False, True))
    exact = free_modes(other, solid, 12, "m")
    off, rest = (each.frequency[6:] / exact.frequency[6:] - 1 for each in (plain, better))
    assert off.max() > 0.05 and abs(rest).max() < 0.1 * off.max()
    assert (np.diff(better.frequency) >= 0).all() and len(better.errors) == 6
    assert (np.array(better.errors) > abs(rest)).mean() > 0.5


def angle(line: np.ndarray) -> HexMesh:
    """Two legs of 2 x 1 x 1.5 at a right angle, with hexes between the numbers of a line."""
    n, corner = len(line) - 1, int(np.searchsorted(line, 1))
    inside = range(corner, n)
    points, hexes = unit_cubes(n, 2, n, {(i, j, k) for i in inside for j in (0, 1) for k in inside})
    x, y, z = points.astype(int).T
    return hex_mesh(np.column_stack([line[x], 0.75 * y, line[z]]), hexes)


@pytest.mark.parametrize("space", first_quick(1, ["optimal", "h2s", "c0"]))
def test_errors_at_a_re_entrant_edge_are_estimated(space):
    """The stress is unbounded there; hexes that become small towards it have the exact answer."""
    near = np.array([0, 0.5, 0.9, 0.98, 1])
    meshes = angle(np.arange(3.0)), angle(np.append(near, 2 - near[-2::-1]))
    splines = map(fitted, meshes, (space, "optimal"))
    coarse, fine = (free_modes(each, MATERIALS["steel"], 12, enrich=True) for each in splines)
    ratio = coarse.errors / (coarse.frequency[6:] / fine.frequency[6:] - 1)
    assert (ratio > 1).all() and np.median(ratio) < 5


def test_enriched_frequencies_do_not_depend_on_the_number_of_modes():
    spline = box((4, 2, 2), (3.0, 1.5, 1.0))
    x, y, z = spline.control.T
    bent = np.column_stack([x + 0.2 * y * z, y + 0.1 * x**2, z - 0.1 * x * y])  # no symmetry
    few, many = (
        free_modes(replace(spline, control=bent), Material(3.0, 0.3, 2.0), n, "m", enrich=True)
        for n in (9, 20)
    )
    assert few.frequency[6:] == pytest.approx(many.frequency[6:9], rel=1e-8)


@pytest.mark.parametrize("n", [1, 3])
def test_rigid_modes_only_have_no_errors(n):
    found = free_modes(box((2, 1, 1)), Material(3.0, 0.3, 2.0), n, "m", enrich=True)
    assert found.rigid == n and found.errors == () and found.frequency == pytest.approx(0, abs=1e-3)


def test_a_mode_whose_corrected_frequency_is_among_the_lowest_is_not_missed():
    """Bending of a thin plate is corrected by more than its stretching, so the order changes."""
    spline, solid = box((3, 2, 1), (3.0, 2.0, 0.1)), Material(3.0, 0.3, 2.0)
    many = free_modes(spline, solid, 40, "m", enrich=True).frequency
    for n in (8, 20, 22, 25):
        found = free_modes(spline, solid, n, "m", enrich=True)
        assert found.frequency[6:] == pytest.approx(many[6:n], rel=1e-6)
        assert len(found.shapes) == n and len(found.errors) == n - 6 and found.rigid == 6
