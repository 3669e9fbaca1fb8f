"""Decks solved by CalculiX where it is installed: exact answers, and beams."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest
from scipy.optimize import brentq

from polycube.analysis.problem import Material
from polycube.assembly.combined import combined
from polycube.cli.infer import _command
from polycube.hexmesh.connectivity import hex_mesh
from polycube.hexmesh.named_sets import boundary_sets
from polycube.io.hex_meshes import patches
from polycube.spline.second_order import hex_elements
from tests.fixtures import assemblies
from tests.fixtures.calculix import CCX, WHY, run_ccx, written
from tests.fixtures.hexmeshes import barrel, hex_box
from tests.fixtures.runs import config, run
from tests.fixtures.splines import spline_of

pytestmark = pytest.mark.skipif(CCX is None, reason=WHY)

YOUNG, LENGTH, SIDE = 70e9, 10.0, 1.0
METAL = {"young": YOUNG, "poisson": 0.0, "density": 2700.0}
BEAM = hex_box((10, 2, 2), (LENGTH, SIDE, SIDE))


def frequencies(table: str) -> np.ndarray:
    """Frequencies of the modes in ascending order, in Hz."""
    rows = map(str.split, table.partition("P A R T I C I P A T I O N")[0].splitlines())
    return np.array([float(row[3]) for row in rows if len(row) == 5 and row[0].isdigit()])


def solved(mesh, folder, analysis, element, spline=None, asked="U", materials=()) -> np.ndarray:
    """Numbers of the nodes, and the requested results at each."""
    path = written(mesh, folder, analysis, element, spline, materials)
    more = f"*NODE PRINT, NSET=all\n{asked}\n*END STEP\n"
    path.write_text(path.read_text().replace("*END STEP\n", more))
    rows = map(str.split, run_ccx(path).splitlines())
    width = {"U": 4, "NT": 2}[asked]
    return np.array([row for row in rows if len(row) == width and row[0].isdigit()], float)


@pytest.mark.parametrize("element", ["C3D8I", "C3D20", "C3D20R"])
@pytest.mark.parametrize(
    "load", [{"traction": [2e8, 0, 0]}, {"pressure": -2e8}, {"force": [200, 0, 0]}]
)
def test_a_bar_in_tension_is_exact(element, load, tmp_path) -> None:
    """u = sigma x / E: 200 MPa on one square mm, by nodes and by a pressure on faces."""
    analysis = {
        "plugin": "static",
        "material": METAL,
        "fixed": ["x_min"],
        "loads": [{"at": "x_max", **load}],
    }
    rows = solved(BEAM, tmp_path, analysis, element)
    own = hex_elements(BEAM, None, 20 if "20" in element else 8)
    assert rows[:, 0].tolist() == list(range(1, len(own.points) + 1))
    np.testing.assert_allclose(rows[:, 1], 2e8 / YOUNG * own.points[:, 0], atol=1e-8)
    np.testing.assert_allclose(rows[:, 2:], 0, atol=1e-8)


def halves(counts, joints=(), friction=None):
    """The two halves of the beam along x, tied in the middle, joined, or in contact."""
    meshes = {}
    for number, size in enumerate(counts):
        plain = hex_box(size, (LENGTH / 2, SIDE, SIDE))
        moved = plain.vertices + np.array([number * LENGTH / 2, 0, 0])
        mesh = hex_mesh(moved, plain.hexes, plain.quads, patches(plain))
        meshes[number] = replace(mesh, sets=boundary_sets(mesh))
    return combined(meshes, ["a", "b"], joints, [((1, "x_min"), (0, "x_max"))], friction)


@pytest.mark.parametrize("element", ["C3D8I", "C3D20R"])
@pytest.mark.parametrize("counts", [((4, 2, 2), (4, 4, 4)), ((4, 2, 2), (5, 3, 3))])
def test_tied_halves_are_one_bar(element, counts, tmp_path) -> None:
    """Tension of two halves whose meshes differ: u = sigma x / E at the end and on average."""
    analysis = {
        "plugin": "static",
        "material": METAL,
        "fixed": [{"plane": [1, 0, 0, 0]}],
        "loads": [{"at": {"plane": [1, 0, 0, LENGTH]}, "traction": [2e8, 0, 0]}],
    }
    mesh = halves(counts)
    rows = solved(mesh, tmp_path, analysis, element)
    own = hex_elements(mesh, None, 20 if "20" in element else 8).points
    exact = 2e8 / YOUNG * own[:, 0]
    assert rows[own[:, 0] == LENGTH, 1] == pytest.approx(2e8 / YOUNG * LENGTH, rel=1e-2)
    np.testing.assert_allclose(rows[:, 1], exact, atol=0.02 * exact.max())


def pressed(mesh, folder, element="C3D8I", **analysis) -> tuple[np.ndarray, np.ndarray]:
    """Displacements of the nodes (N, 3), and pressure and friction (K, 3) at points in contact."""
    fixed = ["a_x_min", *({"at": f"a_{axis}_min", "components": [axis]} for axis in "yz")]
    analysis["fixed"] = [*fixed, *analysis.get("fixed", [])]
    path = written(mesh, folder, {"plugin": "static", "material": METAL, **analysis}, element)
    more = "*NODE PRINT, NSET=all\nU\n*CONTACT PRINT\nCSTR\n*END STEP\n"
    path.write_text(path.read_text().replace("*END STEP\n", more))
    rows = [row.split() for row in run_ccx(path).splitlines()]
    found = [[row for row in rows if len(row) == n and row[0].isdigit()] for n in (4, 5)]
    moved, stress = (np.array(each, float) for each in found)
    return moved[:, 1:], stress.reshape(-1, 5)[:, 2:]


@pytest.mark.parametrize("element", ["C3D8I", "C3D20R"])
@pytest.mark.parametrize("counts", [((4, 2, 2), (4, 2, 2)), ((4, 2, 2), (5, 3, 3))])
def test_halves_in_contact_carry_pressure(element, counts, tmp_path) -> None:
    """u = p x / E, and the contact pressure is p; a small penetration is added."""
    sides = [{"at": f"b_{axis}_min", "components": [axis]} for axis in "yz"]
    loads = [{"at": "b_x_max", "pressure": 2e8}]
    mesh = halves(counts, friction=0.0)
    moved, stress = pressed(mesh, tmp_path, element, fixed=sides, loads=loads)
    x = hex_elements(mesh, None, 20 if "20" in element else 8).points[:, 0]
    exact = -2e8 / YOUNG * x
    np.testing.assert_allclose(moved[:, 0], exact, atol=1e-3 * abs(exact).max())
    np.testing.assert_allclose(stress, np.tile([200, 0, 0], (len(stress), 1)), atol=0.01)


def test_halves_in_contact_carry_no_tension(tmp_path) -> None:
    """One is pulled off by 0.1 mm; the other does not move."""
    off = {"at": "b_x_max", "value": [0.1, 0, 0]}
    moved, stress = pressed(halves(((4, 2, 2), (5, 3, 3)), friction=0.0), tmp_path, fixed=[off])
    assert len(stress) == 0
    np.testing.assert_allclose(moved[:45], 0, atol=1e-9)
    np.testing.assert_allclose(moved[45:], np.tile([0.1, 0, 0], (6 * 16, 1)), atol=1e-9)


def test_halves_in_contact_slide_with_friction(tmp_path) -> None:
    """The shear stress of a half that is pressed and then slides is 0.2 of the pressure."""
    slid = [
        {"at": f"b_{side}", "components": ["y"], "value": [0.02]} for side in ("y_min", "y_max")
    ]
    held = [{"at": "a_y_max", "components": ["y"]}, {"at": "b_z_min", "components": ["z"]}]
    loads = [{"at": "b_x_max", "pressure": 2e8}]
    mesh = halves(((4, 2, 2), (4, 2, 2)), friction=0.2)
    _, stress = pressed(mesh, tmp_path, fixed=[*slid, *held], loads=loads)
    assert stress[:, 0].mean() == pytest.approx(200, rel=0.01)
    np.testing.assert_allclose(np.hypot(*stress[:, 1:].T), 0.2 * stress[:, 0], rtol=1e-3)


SOFT = Material(YOUNG / 4, 0.0, 5400.0, 4e-5)
METALS = (Material(**METAL), SOFT)
SAME = (4, 2, 2), (4, 2, 2)
ONE = [(0, 1, np.stack([np.arange(36, 45), np.arange(9)], axis=1))]  # their common vertices


@pytest.mark.parametrize("element", ["C3D8I", "C3D20R"])
@pytest.mark.parametrize(("counts", "joints"), [(SAME, ONE), (((4, 2, 2), (4, 4, 4)), [])])
def test_the_elongations_of_bars_of_two_materials_add(element, counts, joints, tmp_path) -> None:
    """sigma / E of each half, whether they share vertices or have a tie."""
    analysis = {
        "plugin": "static",
        "material": METAL,
        "fixed": ["x_min"],
        "loads": [{"at": "b_x_max", "force": [200, 0, 0]}],
    }
    mesh = halves(counts, joints)
    assert bool(joints) != bool(mesh.ties)
    rows = solved(mesh, tmp_path, analysis, element, materials=METALS)
    x = hex_elements(mesh, None, 20 if "20" in element else 8).points[:, 0]
    strain, half = 200 / SIDE**2 / (YOUNG * 1e-6), LENGTH / 2
    exact = strain * (np.minimum(x, half) + 4 * np.maximum(x - half, 0))
    off = 1e-6 if joints else 0.01
    np.testing.assert_allclose(rows[:, 1], exact, atol=off * exact.max())


@pytest.mark.parametrize(("counts", "joints"), [(SAME, ONE), (((4, 2, 2), (4, 4, 4)), [])])
def test_the_longitudinal_modes_of_a_bar_of_two_materials(counts, joints, tmp_path) -> None:
    """E k cot(k L) of the held half is that of the free one with tan; k = omega / c of each."""
    sides = [{"at": f"{s}_{end}", "components": s} for s in "yz" for end in ("min", "max")]
    fixed = [*sides, {"at": "a_x_min", "components": "x"}]
    analysis = {"plugin": "modal", "material": METAL, "fixed": fixed, "modes": 2}
    speeds = [np.sqrt(m.young / m.density) for m in METALS]
    half = LENGTH / 2 * 1e-3

    def balance(omega):
        first, second = (omega / c for c in speeds)
        held = METALS[0].young * first * np.cos(first * half) * np.cos(second * half)
        return held - SOFT.young * second * np.sin(second * half) * np.sin(first * half)

    grid = np.linspace(1, 4 * speeds[1] / half, 2000)
    signs = np.flatnonzero(np.diff(np.sign(balance(grid))))[:2]
    exact = [brentq(balance, grid[k], grid[k + 1]) / (2 * np.pi) for k in signs]
    path = written(halves(counts, joints), tmp_path, analysis, "C3D20", materials=METALS)
    np.testing.assert_allclose(frequencies(run_ccx(path)), exact, rtol=5e-3)


def test_a_hot_bar_of_two_materials_expands_by_each(tmp_path) -> None:
    metals = Material(**METAL, expansion=2e-5), SOFT
    analysis = {
        "plugin": "static",
        "material": asdict(metals[0]),
        "fixed": [{"at": f"{axis}_min", "components": [axis]} for axis in "xyz"],
        "temperature": 100,
    }
    rows = solved(halves(SAME, ONE), tmp_path, analysis, "C3D8I", materials=metals)
    assert rows[:, 1].max() == pytest.approx(100 * (2e-5 + 4e-5) * LENGTH / 2, rel=0.02)


@pytest.mark.parametrize("element", ["C3D8I", "C3D20"])
def test_a_hot_bar_expands(element, tmp_path) -> None:
    """u = alpha T x, with a temperature that is linear in x: alpha c x^2 / 2."""
    analysis = {
        "plugin": "static",
        "material": {**METAL, "expansion": 2e-5},
        "fixed": [{"at": f"{axis}_min", "components": [axis]} for axis in "xyz"],
        "temperature": "100 + 0 * x",
    }
    rows = solved(BEAM, tmp_path, analysis, element)
    own = hex_elements(BEAM, None, 20 if "20" in element else 8)
    np.testing.assert_allclose(rows[:, 1:], 2e-3 * own.points, atol=1e-8)


def test_a_rotating_bar_is_stretched(tmp_path) -> None:
    """u = rho omega^2 (L^2 x / 2 - x^3 / 6) / E without Poisson's ratio."""
    analysis = {
        "plugin": "static",
        "material": METAL,
        "fixed": ["x_min"],
        "rotation": {"axis": [0, 0, 2], "rpm": 30000, "point": [0, SIDE / 2, SIDE / 2]},
    }
    rows = solved(BEAM, tmp_path, analysis, "C3D20")
    own = hex_elements(BEAM, None, 20)
    tip = np.argmax(own.points @ [1, -0.01, -0.01])
    length = LENGTH * 1e-3
    exact = 2700 * (1000 * np.pi) ** 2 * length**3 / 3 / YOUNG * 1e3  # in mm
    assert rows[tip, 1] == pytest.approx(exact, rel=1e-2)


@pytest.mark.parametrize("element", ["C3D8I", "C3D20"])
def test_a_moment_and_a_remote_force_bend_a_bar(element, tmp_path) -> None:
    """A force along x with a lever of 3 mm about z, and its opposite moment, leave tension."""
    force, lever = 50.0, 3.0
    load = {"at": "x_max", "force": [force, 0, 0], "point": [LENGTH, SIDE / 2 + lever, SIDE / 2]}
    analysis = {"plugin": "static", "material": METAL, "fixed": ["x_min"], "loads": [load]}
    rows = solved(BEAM, tmp_path, analysis, element)
    own = hex_elements(BEAM, None, 20 if "20" in element else 8).points
    end = np.isclose(own[:, 0], LENGTH)
    bend = -force * lever / (YOUNG * 1e-6 * SIDE**4 / 12) * LENGTH**2 / 2
    assert rows[end, 2].mean() == pytest.approx(bend, rel=1e-2)
    load["moment"] = [0, 0, force * lever * 1e-3]
    rows = solved(BEAM, tmp_path, analysis, element)
    stretch = force / (YOUNG * 1e-6 * SIDE**2)
    np.testing.assert_allclose(rows[:, 1], stretch * own[:, 0], atol=1e-7)
    np.testing.assert_allclose(rows[:, 2:], 0, atol=1e-7)


@pytest.mark.parametrize(
    ("element", "within"), [("C3D8I", 2e-2), ("C3D20", 2e-3), ("C3D20R", 2e-3)]
)
def test_a_cantilever_bends_as_a_timoshenko_beam(element, within, tmp_path) -> None:
    """P L^3 / 3 E I + P L / (5/6 G A), at the middle of the free end."""
    force = 10.0
    analysis = {
        "plugin": "static",
        "material": METAL,
        "fixed": ["x_min"],
        "loads": [{"at": "x_max", "force": [0, 0, -force]}],
    }
    rows = solved(BEAM, tmp_path, analysis, element)
    young, inertia = YOUNG * 1e-6, SIDE**4 / 12
    expected = force * LENGTH**3 / (3 * young * inertia)
    expected += force * LENGTH / (5 / 6 * young / 2 * SIDE**2)
    end = np.flatnonzero((BEAM.vertices == [LENGTH, SIDE / 2, SIDE / 2]).all(axis=1))
    assert rows[end, 3] == pytest.approx(-expected, rel=within)


@pytest.mark.parametrize("element", ["C3D8I", "C3D20R"])
def test_a_hanging_bar_is_exact(element, tmp_path) -> None:
    """u = density g (L x - x^2 / 2) / E."""
    gravity = 5e5
    analysis = {
        "plugin": "static",
        "material": METAL,
        "fixed": ["x_min"],
        "gravity": [gravity, 0, 0],
    }
    rows = solved(BEAM, tmp_path, analysis, element)
    own = hex_elements(BEAM, None, 20 if "20" in element else 8)
    x = own.points[rows[:, 0].astype(int) - 1, 0]
    expected = METAL["density"] * gravity / YOUNG * 1e-3 * (LENGTH * x - x**2 / 2)
    np.testing.assert_allclose(rows[:, 1], expected, atol=1e-5 * expected.max())


def test_a_prescribed_rigid_motion_of_a_curved_part_is_exact(tmp_path) -> None:
    """A rigid motion of curved hexes of 20 nodes has no strain: all nodes follow it."""
    plain = barrel((3, 3, 3), 0.3)
    mesh = hex_mesh(plain.vertices, plain.hexes, plain.quads, patches(plain))
    spline = spline_of(mesh, "h2s", fit={"rounds": 0})
    fixed = [{"at": "z_min", "value": [0.5, -0.25, 0.125]}]
    analysis = {"plugin": "static", "material": METAL, "fixed": fixed}
    rows = solved(mesh, tmp_path, analysis, "C3D20R", spline)
    np.testing.assert_allclose(rows[:, 1:], np.tile([0.5, -0.25, 0.125], (len(rows), 1)), atol=1e-6)


def test_the_longitudinal_modes_of_a_bar(tmp_path) -> None:
    """(2 n - 1) / 4 L times the speed of sound, among the modes that move along x alone."""
    sides = [{"at": side, "components": side[0]} for side in ("y_min", "y_max", "z_min", "z_max")]
    analysis = {
        "plugin": "modal",
        "material": METAL,
        "fixed": [*sides, {"at": "x_min", "components": "x"}],
        "modes": 2,
    }
    speed = np.sqrt(YOUNG / METAL["density"]) * 1e3  # mm/s
    expected = np.array([1, 3]) * speed / (4 * LENGTH)
    for element, within in [("C3D8I", 1e-2), ("C3D20", 1e-4)]:
        found = frequencies(run_ccx(written(BEAM, tmp_path, analysis, element)))
        np.testing.assert_allclose(found, expected, rtol=within)


@pytest.mark.parametrize("element", ["C3D8I", "C3D20"])
def test_heat_through_a_bar_is_exact(element, tmp_path) -> None:
    """T = 300 + q x / k with a flux, and a parabola with a source."""
    flux, source, k = 4000.0, 1e6, 50.0
    analysis = {
        "plugin": "poisson",
        "conductivity": k,
        "fixed": [{"at": "x_min", "value": 300}],
        "flux": [{"at": "x_max", "value": flux}],
        "source": source,
    }
    rows = solved(BEAM, tmp_path, analysis, element, asked="NT")
    own = hex_elements(BEAM, None, 20 if element == "C3D20" else 8)
    x = own.points[rows[:, 0].astype(int) - 1, 0] * 1e-3
    length = LENGTH * 1e-3
    expected = flux / k * x + source / k * (length * x - x**2 / 2)
    np.testing.assert_allclose(rows[:, 1] - 300, expected, atol=2e-4)


@pytest.mark.slow
@pytest.mark.parametrize(("interfaces", "ties"), [("tie", 2), ("conform", 0)])
def test_a_bolt_carries_its_load_to_the_plate(interfaces, ties, tmp_path) -> None:
    """The reactions of both ends of the plate are half of the force on the head of the bolt."""
    part = assemblies.named(assemblies.write("bolted", tmp_path), "PLATE", "BOLT")
    words = ["cad.solid=all", "order=[meshing]", "meshing.size=3", "export=[abaqus]"]
    words += ["effort=first", "analysis=static", "cad.materials={PLATE: aluminium}"]
    words += [f"cad.interfaces={interfaces}"]
    words += ["analysis.fixed=[PLATE_x_min, x_max]"]
    words += ["analysis.loads=[{at: BOLT_z_max, force: [0, 0, 500]}]"]
    assert _command(config(f"mesh={part}", f"output_dir={tmp_path / 'out'}", *words)) == 0
    path = tmp_path / "out" / "hex.inp"
    assert path.read_text().count("*TIE") == ties
    asked = "*NODE PRINT, NSET={}, TOTALS=ONLY\nRF\n".format
    more = f"{asked('PLATE_x_min')}{asked('x_max')}*END STEP\n"
    path.write_text(path.read_text().replace("*END STEP\n", more))
    forces = [row.split() for row in run_ccx(path).splitlines() if row.count("E") == 3]
    found = np.array(forces, float)
    np.testing.assert_allclose(found[:, 2], -250, rtol=0.01)
    np.testing.assert_allclose(found.sum(axis=0), [0, 0, -500], atol=0.1)


@pytest.mark.slow
def test_bars_from_cad_press_on_each_other(tmp_path) -> None:
    """They are meshed together, keep their vertices, and are shortened by sigma x / E."""
    part = assemblies.named(assemblies.write("bars", tmp_path), "first", "second")
    words = ["cad.solid=all", "order=[meshing]", "meshing.size=5", "export=[abaqus]"]
    words += ["cad.interfaces=contact", "cad.friction=0.1", "effort=first", "analysis=static"]
    words += ["analysis.material={young: 2e9, poisson: 0, density: 1000}"]
    fixed = "[first_x_min, {at: second_y_min, components: y}, {at: second_z_min, components: z}]"
    words += [f"analysis.fixed={fixed}", "analysis.loads=[{at: x_max, pressure: 2e6}]"]
    folder = tmp_path / "out"
    assert _command(config(f"mesh={part}", f"output_dir={folder}", *words)) == 0
    [contact] = json.loads((folder / "report.json").read_text())["contacts"]
    assert contact["joined"] == "contact" and contact["agree"]
    path = folder / "hex.inp"
    text = path.read_text()
    assert text.count("*CONTACT PAIR") == 1 and "*FRICTION\n0.1, " in text and "*TIE" not in text
    path.write_text(text.replace("*END STEP\n", "*NODE PRINT, NSET=x_max\nU\n*END STEP\n"))
    rows = [row.split() for row in run_ccx(path).splitlines()]
    found = np.array([row[1] for row in rows if len(row) == 4 and row[0].isdigit()], float)
    np.testing.assert_allclose(found, -100 * 2e6 / 2e9, rtol=1e-3)


@pytest.mark.slow
def test_a_cylinder_from_cad_twists_at_the_frequency_of_a_round_shaft(testdata, tmp_path) -> None:
    """sqrt(G / density) / 2 L, after six rigid modes: as round as 20 nodes on the spline are."""
    report = run(
        f"mesh={testdata / 'cad' / 'hexme' / 's15o_cylinder.stp'}",
        f"output_dir={tmp_path}",
        "order=[meshing,spline]",
        "export=[abaqus]",
        "export.abaqus.element=C3D20R",
        "analysis.modes=8",
        "analysis.material={young: 200e9, poisson: 0.25, density: 8000}",
    )
    length = np.ptp(report["input"]["bbox"], axis=0).max() * 1e-3
    found = frequencies(run_ccx(tmp_path / "hex.inp"))
    assert found[:6].max() < 1
    twist = np.sqrt(80e9 / 8000) / (2 * length)
    assert abs(found[6:] / twist - 1).min() < 1e-4


@pytest.mark.parametrize("element", ["C3D8I", "C3D20"])
def test_a_turning_sector_has_the_symmetry_of_the_whole(tmp_path, element):
    """The radial displacement of a quarter of a ring is the same at all angles."""
    box = hex_box((2, 6, 1), (1.0, np.pi / 2, 0.5))
    radius, angle, z = np.add(box.vertices, [1, 0, 0]).T
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)
    plain = hex_mesh(points, box.hexes)
    mesh = hex_mesh(points, box.hexes, plain.quads, patches(plain))
    mesh = replace(mesh, sets=boundary_sets(mesh))
    inner = quads_at(mesh, radius, 1.0)
    about = {"cyclic": {"sectors": 4}, "material": METAL, "units": "m", "fixed": [inner]}
    turning = {"plugin": "static", "rotation": {"axis": [0, 0, 1], "rpm": 3000}, **about}
    found = solved(mesh, tmp_path, turning, element)
    nodes = found[:, 0].astype(int) - 1
    moved = np.zeros((nodes.max() + 1, 3))
    moved[nodes] = found[:, 1:]
    at = np.flatnonzero((abs(radius - 2) < 1e-9) & (z < 1e-9))
    outwards = (moved[at] * points[at]).sum(axis=1) / 2
    assert outwards.min() > 0 and outwards == pytest.approx(outwards[0], rel=1e-6)
    assert abs(np.cross(moved[at, :2], points[at, :2])).max() < 1e-6 * outwards[0]


def quads_at(mesh, radius, wanted) -> str:
    """The patch of the quads whose vertices have a radius (V,)."""
    own = (abs(radius[mesh.quads] - wanted) < 1e-9).all(axis=1)
    return f"patch_{mesh.patch[own][0]}"
