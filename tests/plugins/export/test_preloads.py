"""Preloads in decks: exact answers of CalculiX, those of this program, and impossible sections."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from polycube.analysis.problem import Material
from polycube.errors import InputError
from polycube.hexmesh.connectivity import hex_mesh, split
from polycube.hexmesh.named_sets import boundary_sets
from polycube.io.hex_meshes import patches
from polycube.registry import build
from polycube.spline.second_order import hex_elements
from tests.fixtures.calculix import CCX, WHY, run_ccx, written
from tests.fixtures.hexmeshes import clamp, hex_box
from tests.fixtures.splines import spline_of

FORCE, YOUNG = 200.0, 70e9
METAL = {"young": YOUNG, "poisson": 0.0, "density": 2700.0}
BOLT = {"point": [2.5, 0.5, 4.4], "axis": [0, 0, 1], "force": FORCE}
STATIC = {"plugin": "static", "material": {**METAL, "poisson": 0.3}, "fixed": ["z_min"]}
needs_ccx = pytest.mark.skipif(CCX is None, reason=WHY)


def solved(path, nodes="all"):
    """The tightening of the preload, displacements (N, 4) of nodes, and stresses (P, 8)."""
    asked = f"*NODE PRINT, NSET=preload_1\nU\n*NODE PRINT, NSET={nodes}\nU\n"
    text = path.read_text().replace("*END STEP\n", f"{asked}*EL PRINT, ELSET=all\nS\n*END STEP\n")
    path.write_text(text)
    rows = [row.split() for row in run_ccx(path).splitlines()]
    moved, stress = (
        np.array([row for row in rows if len(row) == n and row[0].isdigit()], float) for n in (4, 8)
    )
    return moved[0, 1], moved[1:], stress


@needs_ccx
@pytest.mark.parametrize("element", ["C3D8I", "C3D20", "C3D20R"])
@pytest.mark.parametrize("way", [1, -1])
def test_a_clamped_bar_is_exact(element, way, tmp_path):
    mesh = hex_box((10, 2, 2), (10, 1, 1))
    preload = {"point": [4.5, 0.4, 0.4], "axis": [way, 0, 0], "force": FORCE}
    fixed = ["x_min", "x_max"]
    analysis = {"plugin": "static", "material": METAL, "fixed": fixed, "preloads": [preload]}
    amount, moved, stress = solved(written(mesh, tmp_path, analysis, element))
    strain = FORCE / (YOUNG * 1e-6)
    assert amount == pytest.approx(10 * strain, rel=1e-6)
    x = hex_elements(mesh, None, 20 if "20" in element else 8).points[:, 0]
    cut = 5 if way > 0 else 4
    np.testing.assert_allclose(moved[x < cut, 1], strain * x[x < cut], atol=1e-6 * strain)
    np.testing.assert_allclose(moved[x > cut, 1], strain * (x[x > cut] - 10), atol=1e-6 * strain)
    np.testing.assert_allclose(stress[:, 2], FORCE, rtol=1e-5)


def meshed(mesh, cells=None):
    found = hex_mesh(mesh.vertices, mesh.hexes, mesh.quads, patches(mesh), cells)
    return replace(found, sets=boundary_sets(found))


@needs_ccx
@pytest.mark.slow
def test_a_clamp_has_the_tightening_and_displacement_of_this_program(tmp_path):
    mesh, analysis = meshed(split(clamp(5))), {**STATIC, "preloads": [BOLT]}
    amount, moved, stress = solved(written(mesh, tmp_path, analysis, "C3D20R"), "z_max")
    spline = spline_of(mesh, "h2s")
    found = build("analysis", analysis)(spline)
    assert found.sections[0, 2] == pytest.approx(amount, rel=0.01)
    at = hex_elements(mesh, None, 20).points[moved[:, 0].astype(int) - 1]
    apart, own = cKDTree(spline.extraction @ spline.control).query(at)
    same, size = apart < 1e-6, abs(moved[:, 1:]).max()
    assert same.sum() == 33  # vertices of the upper face
    np.testing.assert_allclose(found.displacement[own[same]], moved[same, 1:], atol=0.02 * size)
    middle = mesh.vertices[mesh.hexes].mean(axis=1)
    for x, share in ((0.5, -0.5), (2.5, 1), (4.5, -0.5)):
        own = 1 + np.flatnonzero((abs(middle[:, [0, 2]] - [x, 4.5]) < 0.5).all(axis=1))
        of_column = stress[np.isin(stress[:, 0], own), 4]
        assert of_column.mean() == pytest.approx(share * FORCE, rel=1e-3)


@needs_ccx
def test_a_sector_with_cyclic_symmetry_is_tightened_like_the_whole(tmp_path):
    found = []
    for sectors in (1, 6):
        flat = clamp(3, plate=1, times=sectors)
        _, first, same = np.unique(
            on_a_ring(flat.vertices).round(9), axis=0, return_index=True, return_inverse=True
        )
        plain = hex_mesh(on_a_ring(flat.vertices)[first], same.ravel()[flat.hexes])
        at = on_a_ring(np.array([[5 * k + 2.5, 0.5, 2.3] for k in range(sectors)])).tolist()
        preloads = [{**BOLT, "point": point} for point in at]
        cyclic = {"sectors": 6} if sectors == 1 else None
        about = {"fixed": [{"plane": [0, 0, 1, 0]}], "cyclic": cyclic, "preloads": preloads}
        deck = written(meshed(plain), tmp_path, {**STATIC, **about}, "C3D20R")
        found.append(solved(deck)[0])
    assert found[0] == pytest.approx(found[1], rel=1e-5)


def on_a_ring(x):
    """A sixth of a ring from five units of x."""
    angle, radius = np.pi / 15 * x[:, 0], 4 + x[:, 1]
    return np.stack([radius * np.sin(angle), radius * np.cos(angle), x[:, 2]], axis=1)


@needs_ccx
def test_a_bolt_of_an_assembly_is_cut_alone(tmp_path):
    """The column is another solid, joined at its ends; the stress there is that of the preload."""
    mesh = clamp(5)
    middle = mesh.vertices[mesh.hexes].mean(axis=1)
    is_bolt = (abs(middle[:, 0] - 2.5) < 0.1) & (abs(middle[:, 2] - 4.5) < 2.6)
    mesh = replace(meshed(mesh, is_bolt.astype(int)), primitives=("frame", "bolt"))
    metals = Material(YOUNG, 0.3, 2700.0), Material(YOUNG / 2, 0.3, 5400.0)
    path = written(mesh, tmp_path, {**STATIC, "preloads": [BOLT]}, "C3D20R", materials=metals)
    _, _, stress = solved(path)
    own = 1 + np.flatnonzero(is_bolt & np.isclose(middle[:, 2], 4.5))
    assert stress[np.isin(stress[:, 0], own), 4].mean() == pytest.approx(FORCE, rel=1e-3)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"preloads": [{**BOLT, "axis": [1, 0, 1], "point": [2.5, 0.5, 7.5]}]}, "not in one layer"),
        ({"fixed": ["z_min", {"box": [2, 0, 2, 2, 1, 7]}]}, "section at a support"),
        ({"preloads": [BOLT, BOLT]}, "touches that of another one"),
        ({"preloads": [{**BOLT, "point": [1.5, 0.5, 4]}]}, "is not in the part"),
    ],
)
def test_sections_that_a_deck_cannot_hold_are_refused(change, why, tmp_path):
    analysis = {**STATIC, "preloads": [BOLT], **change}
    with pytest.raises(InputError, match=why):
        written(meshed(clamp(5)), tmp_path, analysis, "C3D8I")


def test_a_section_at_a_tied_surface_is_refused(tmp_path):
    mesh = meshed(clamp(5))
    tied = replace(mesh, ties=(("x_min", "z_min"),))
    tied = replace(tied, sets={**mesh.sets, "x_min": np.arange(len(mesh.quads))})
    with pytest.raises(InputError, match="or at a tied surface"):
        written(tied, tmp_path, {**STATIC, "preloads": [BOLT]}, "C3D8I")
