"""Refined spline spaces: nested levels, independent functions, sides of the solid."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import eye, kron

from polycube.hexmesh.connectivity import split
from polycube.io.hex_meshes import boundary
from polycube.registry import build
from polycube.spline.bezier import min_detj
from polycube.spline.spaces.extraction import TENSOR, bezier_nodes, volumetric_spline
from polycube.spline.spaces.hierarchy import coarsest, hierarchical_spline, remainder, ring
from polycube.spline.spaces.refinement import refined_spline
from polycube.spline.spaces.selection import Refinement
from polycube.spline.spaces.subdivision import CASTELJAU
from tests.fixtures.hexmeshes import hex_ball, hex_box, hex_cylinder
from tests.fixtures.hierarchies import MESHES, SPACES, at_the_finest, levels_of, sharpened, space_of
from tests.oracles.matrices import assemble


@pytest.mark.parametrize("plugin", ["h2s", "optimal"])
@pytest.mark.parametrize("name", ["cylinder", "ball"])
def test_functions_are_linearly_independent(name, plugin):
    """Includes functions around extraordinary edges, some of which change between h2s levels."""
    space = space_of(MESHES[name], plugin)
    patch = ring(space, np.array([0]))[:6] if plugin == "optimal" else ring(space, np.array([0]))
    rows = hierarchical_spline(levels_of(space, patch, [0, 1, 9])).extraction
    gram = (rows.T @ rows).toarray()
    scale = 1 / np.sqrt(gram.diagonal())
    assert np.linalg.eigvalsh(gram * scale * scale[:, None])[0] > 1e-4


def anywhere(space, seed=0):
    """The space with random coefficients for its geometry: three random functions of it."""
    rng = np.random.default_rng(seed)
    if hasattr(space, "points"):
        coefficients = rng.random(space.control.shape)
        return replace(space, points=space.extraction @ coefficients)
    return replace(space, mesh=replace(space.mesh, vertices=rng.random(space.control.shape)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "plugin"),
    [("box", "h2s"), *((name, plugin) for name in MESHES for plugin in ("optimal", "c0"))],
)
def test_nested_levels_contain_the_coarser_functions(name, plugin):
    mesh = MESHES[name]
    space = anywhere(space_of(mesh, plugin))
    patch = ring(space, np.array([len(mesh.hexes) // 2]))
    levels = levels_of(space, patch, np.arange(12))
    assert all(abs(remainder(*pair)).max() < 1e-14 for pair in pairwise(levels))
    spline = hierarchical_spline(levels)
    nodes, found = at_the_finest(mesh, levels, spline, spline.extraction @ spline.control)
    fields = (space.extraction @ space.control)[space.nodes]
    for _ in range(2):
        fields = np.einsum("kab,ebc->ekac", CASTELJAU, fields).reshape(-1, 64, 3)
    finer, _ = bezier_nodes(split(split(mesh)).hexes[:, TENSOR])
    target = np.zeros((finer.max() + 1, 3))
    target[finer] = fields
    assert found == pytest.approx(target[nodes], abs=1e-13)


@pytest.mark.parametrize("mesh", [hex_cylinder(2, 2, 3), hex_ball(2)], ids=["cylinder", "ball"])
def test_h2s_levels_are_nearly_nested(mesh):
    space = space_of(mesh)
    plain, spline = (
        hierarchical_spline(levels_of(space, *some)) for some in ([], [ring(space, np.array([0]))])
    )
    assert len(spline.control) > len(plain.control)
    assert min_detj(spline).volume == pytest.approx(min_detj(plain).volume, rel=1e-3)
    assert min_detj(spline).lower_bound > 0


def test_one_level_is_the_spline_itself():
    mesh = MESHES["cylinder"]
    maker = build("spline", {"plugin": "h2s"})
    plain = volumetric_spline(mesh, *sharpened(maker, mesh))
    spline = hierarchical_spline([coarsest(space_of(mesh))])
    assert abs(spline.extraction - plain.extraction).max() == 0
    for name in ("control", "nodes", "sides", "patch", "element_hex", "level"):
        assert np.array_equal(getattr(spline, name), getattr(plain, name))


@pytest.mark.parametrize("plugin", SPACES)
def test_full_refinement_of_nested_levels_is_the_finer_space(plugin):
    mesh = MESHES["box"]
    space = space_of(mesh, plugin)
    everywhere = hierarchical_spline(levels_of(space, np.arange(len(mesh.hexes))))
    finer = hierarchical_spline([coarsest(space, halvings=1)])
    assert abs(everywhere.extraction - finer.extraction).max() < 1e-15
    assert everywhere.control == pytest.approx(finer.control, abs=1e-15)
    assert (finer.level == 1).all()
    assert np.array_equal(finer.element_hex, np.repeat(np.arange(len(mesh.hexes)), 8))


def test_a_function_needs_four_finer_elements_in_each_direction():
    space = space_of(hex_box((6, 6, 6)))
    cells = np.arange(216).reshape(6, 6, 6)
    for n, functions in ((1, 0), (2, 1), (3, 27)):
        spline = hierarchical_spline(
            levels_of(space, cells[2 : 2 + n, 2 : 2 + n, 2 : 2 + n].ravel())
        )
        assert len(spline.control) == 343 + functions


def test_sides_and_patches_are_those_of_the_solid():
    mesh = MESHES["box"]
    mesh = replace(mesh, patch=np.arange(len(mesh.quads)))
    spline = hierarchical_spline(levels_of(space_of(mesh), [0]))
    corner = np.isin(mesh.quads, mesh.hexes[0]).all(axis=1)
    assert np.array_equal(np.sort(spline.patch), np.repeat(mesh.patch, np.where(corner, 4, 1)))
    points = (spline.extraction @ spline.control)[spline.nodes]
    element, side = spline.sides.T
    face = points[element].reshape(-1, 4, 4, 4, 3)  # z, y, x
    for k in range(6):
        ends = np.take(face[side == k], 3 * (k % 2), axis=3 - k // 2)[..., k // 2]
        assert ends == pytest.approx(np.full_like(ends, k % 2), abs=1e-15)


def lowest_of(spline, n=14):
    stiffness, mass = assemble(spline, 1.0, 0.3, 1.0, 4)
    mass = kron(mass, eye(3)).toarray()
    return eigh(stiffness.toarray(), mass, eigvals_only=True, subset_by_index=(6, n - 1))


def test_finer_functions_lower_the_eigenvalues_of_the_same_solid():
    mesh = hex_box((4, 2, 2), (2.0, 1.0, 1.0))
    space = space_of(mesh)
    found = [
        lowest_of(hierarchical_spline(levels_of(space, *elements)))
        for elements in ([], [np.arange(8)], [np.arange(16)])
    ]
    for coarse, fine in pairwise(range(3)):
        assert (found[fine] < found[coarse] + 1e-12).all()
        assert (found[fine] < found[coarse] * (1 - 1e-5)).any()


def test_refined_spline_is_the_hierarchy_of_its_marks():
    mesh = MESHES["box"]
    space = space_of(mesh)
    refine = Refinement(elements=[3, 1], boxes=[{"box": [0, 0, 0.7, 1, 1, 1], "level": 1}], rings=0)
    spline = refined_spline(space, refine, boundary(mesh), 7)
    top = np.flatnonzero(mesh.vertices[mesh.hexes, 2].max(axis=1) > 0.7)
    wanted = hierarchical_spline(levels_of(space, np.concatenate([[3, 1], top])))
    assert spline.extraordinary_edges == 7
    assert abs(spline.extraction - wanted.extraction).max() == 0
    assert np.array_equal(spline.element_hex, wanted.element_hex)
