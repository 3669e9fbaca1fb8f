"""The published rod: its mesh, sharp vertices and refinement, and LS-DYNA's eigenvalues."""

import meshio
import numpy as np
import pytest
from scipy.sparse import diags, eye, kron

from polycube.analysis.modal import lowest
from polycube.io.hex_meshes import boundary, read_hexes
from polycube.registry import build
from polycube.spline.bezier import bezier_points
from polycube.spline.spaces.refinement import refined_spline
from polycube.spline.spaces.selection import Refinement
from tests.fixtures.hierarchies import space_on
from tests.oracles.matrices import assemble

EIGOUT = [
    *(0.2022243, 0.2529111, 0.7143972, 0.7263861, 0.7695793, 0.8427821, 0.8701956),
    *(1.172720, 1.224381, 1.309215, 1.371980, 1.547532, 1.655640, 1.720681),
]
CONSISTENT = [0.21190, 0.26165, 0.81964, 0.84270, 0.93360, 1.77116, 2.17861, 2.22001, 2.50718]

PUBLISHED = {"single_hex_edges": False, "angle": 179}  # only listed vertices are sharp


@pytest.fixture(scope="module")
def folder(testdata):
    path = testdata / "rod_benchmark"
    if not path.is_dir():
        pytest.skip(f"no {path}")
    return path


def rod(folder, elements=()):
    """The space of the published mesh with its sharp edges, refined, without other changes."""
    mesh, _ = read_hexes(folder / "rod_hex_paper_used.vtk")
    maker = build("spline", {"plugin": "h2s", "sharp": str(folder / "sharp.txt")} | PUBLISHED)
    space = space_on(maker, mesh)
    return space, refined_spline(space, Refinement(elements=elements), boundary(mesh))


@pytest.fixture(scope="module")
def refined(folder):
    return rod(folder, str(folder / "lev_rfid.txt"))[1]


def test_functions_elements_volume(folder, refined):
    assert refined.extraction.shape[1] == 1851
    assert np.bincount(refined.level).tolist() == [1264, 124, 32]
    assert abs(refined.extraction.sum(axis=1) - 1).max() < 1e-12
    assert refined.extraction.min() >= 0
    _, plain = rod(folder)
    is_coarse = refined.level == 0
    before = bezier_points(plain)[refined.element_hex[is_coarse]]
    assert bezier_points(refined)[is_coarse] == pytest.approx(before, abs=1e-12)


@pytest.mark.slow
def test_control_points_of_level_one(folder):
    published = meshio.read(folder / "rod_hex_gref_lev1_CM.vtk")
    fine, _ = rod(folder)[0].finer(np.arange(1280))
    theirs = published.points[published.cells_dict["hexahedron"]]
    assert len(fine.control) == len(published.points) == 12303
    assert fine.control[fine.mesh.hexes] == pytest.approx(theirs, abs=6e-5)  # as printed


@pytest.mark.slow
def test_lumped_eigenvalues_are_those_of_eigout(refined):
    stiffness, mass = assemble(refined, 50.0, 0.3, 1.0, 3)
    assert mass.sum() == pytest.approx(193.642, rel=1e-5)
    rows = kron(diags(np.asarray(mass.sum(axis=1)).ravel()), eye(3), "csr")
    found = lowest(stiffness, rows, 20)[0]
    assert abs(found[:6]).max() < 1e-10
    assert found[6:] == pytest.approx(EIGOUT, rel=2e-5)


@pytest.mark.slow
def test_consistent_eigenvalues_are_the_converged_ones(folder, refined):
    stiffness, mass = assemble(refined, 50.0, 0.3, 1.0, 4)
    found = lowest(stiffness, kron(mass, eye(3), "csr"), 20)[0]
    assert found[6:15] == pytest.approx(CONSISTENT, rel=1e-4)
