from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from polycube.errors import MeshingError
from polycube.numerics.element_matrices import zero_matrices
from polycube.spline.bezier import min_detj
from polycube.spline.spaces.extraction import volumetric_spline
from polycube.spline.spaces.sharp_features import creases, single_hex_edges, union
from polycube.types import ElementFunctions
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder
from tests.oracles.integrals import integrate
from tests.oracles.matrices import assemble


def spline_of(mesh):
    return volumetric_spline(mesh, union(creases(mesh, np.radians(60)), single_hex_edges(mesh)))


MESHES = {"box": hex_box((2, 3, 2)), "cylinder": hex_cylinder(2, 2, 2), "ball": hex_ball(2)}


@pytest.fixture(scope="module", params=MESHES)
def spline(request):
    return spline_of(MESHES[request.param])


def rigid_motions(x):
    moves = [np.tile(np.eye(3)[i], (len(x), 1)) for i in range(3)]
    turns = [np.cross(np.eye(3)[i], x) for i in range(3)]
    return np.stack(moves + turns).reshape(6, -1).T


def test_matrices_are_symmetric_and_positive(spline):
    stiffness, mass = assemble(spline, 7.0, 0.3, 2.0)
    assert abs(stiffness - stiffness.T).max() < 1e-14
    assert abs(mass - mass.T).max() < 1e-15
    assert np.linalg.eigvalsh(mass.toarray()).min() > 0
    assert np.linalg.eigvalsh(stiffness.toarray())[:7].round(10)[6] > 0


def test_rigid_motions_have_no_energy(spline):
    stiffness, _ = assemble(spline, 1.0, 0.3, 1.0)
    assert abs(stiffness @ rigid_motions(spline.control)).max() < 1e-14


def test_mass_is_density_times_volume(spline):
    _, mass = assemble(spline, 1.0, 0.3, 2.5, n_gauss=5)
    assert mass.sum() == pytest.approx(2.5 * min_detj(spline).volume, rel=1e-12)


def test_constant_strain_is_exact(spline):
    young, poisson = 3.0, 0.3
    lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    shear = young / (2 * (1 + poisson))
    gradient = np.array([[0.1, 0.2, 0.0], [-0.3, 0.4, 0.7], [0.5, 0.0, -0.2]])
    strain = (gradient + gradient.T) / 2
    stress = lame * np.trace(strain) * np.eye(3) + 2 * shear * strain
    stiffness, _ = assemble(spline, young, poisson, 1.0, n_gauss=5)
    u = (spline.control @ gradient.T).ravel()
    energy = (stress * strain).sum() * min_detj(spline).volume
    assert u @ stiffness @ u == pytest.approx(energy, rel=1e-12)


def test_constant_strain_is_in_equilibrium_inside():
    mesh = MESHES["ball"]
    spline = spline_of(mesh)
    u = spline.control @ np.diag([1.0, -2.0, 3.0])
    stiffness, _ = assemble(spline, 1.0, 0.3, 1.0, n_gauss=5)
    force = (stiffness @ u.ravel()).reshape(-1, 3)
    inside = np.setdiff1d(np.arange(len(mesh.vertices)), mesh.quads)
    at_boundary = spline.extraction[boundary_nodes(spline)].sum(axis=0)
    inside = inside[np.asarray(at_boundary).ravel()[inside] == 0]
    assert len(inside) > 0
    assert abs(force[inside]).max() < 1e-14
    assert abs(force).max() > 0.1


def boundary_nodes(spline):
    grid = spline.nodes.reshape(-1, 4, 4, 4)
    faces = [np.take(grid, side, axis).reshape(-1, 16) for axis in (1, 2, 3) for side in (0, 3)]
    faces = np.concatenate(faces)
    _, inverse, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    return np.unique(faces[count[inverse.ravel()] == 1])


def test_agrees_with_element_by_element_sums(spline):
    poisson = 0.25
    stiffness, mass = assemble(spline, 1.0, poisson, 3.0)
    lame = poisson / ((1 + poisson) * (1 - 2 * poisson))
    shear = 1 / (2 * (1 + poisson))
    size = len(spline.control)
    slow_k, slow_m = np.zeros((size + 1, 3, size + 1, 3)), np.zeros((size + 1, size + 1))
    for chunk in integrate(spline, spline.element_functions(), 4):
        for ids, m, s in zip(chunk.functions, chunk.mass, chunk.gradient, strict=True):
            at = np.ix_(ids, range(3), ids, range(3))
            k = lame * s + shear * s.transpose(0, 3, 2, 1)
            k += shear * np.einsum("akbk,ij->aibj", s, np.eye(3))
            slow_m[np.ix_(ids, ids)] += 3 * m
            slow_k[at] += k
    assert mass.toarray() == pytest.approx(slow_m[:-1, :-1], abs=1e-14)
    dense = slow_k[:-1, :, :-1].reshape(3 * size, 3 * size)
    assert stiffness.toarray() == pytest.approx(dense, abs=1e-14)


def test_numbers_do_not_depend_on_the_number_of_threads(on_cores):
    spline = spline_of(hex_box((12, 12, 4)))
    on_cores(4)
    found = assemble(spline, 1.0, 0.3, 1.0)
    on_cores(1)
    for one, other in zip(found, assemble(spline, 1.0, 0.3, 1.0), strict=True):
        assert np.array_equal(one.data, other.data)


def test_refuses_inverted_elements():
    spline = spline_of(MESHES["box"])
    with pytest.raises(MeshingError, match=r"det J > 0; got -0.0833 at a Gauss point of element"):
        assemble(replace(spline, control=-spline.control), 1.0, 0.3, 1.0)


def test_functions_that_share_256_elements_are_counted():
    both = csr_matrix(np.ones((512, 64)))
    functions = ElementFunctions(np.arange(257) * 2, np.tile([0, 1], 256), both)
    (matrix,) = zero_matrices(functions, 2, 1)
    assert matrix.indices.tolist() == [0, 0, 1]
