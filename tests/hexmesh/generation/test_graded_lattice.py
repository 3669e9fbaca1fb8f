"""Lattices with hexes of twice the size in regions that do not need small ones."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.hexmesh.connectivity import check_conforming, genus
from polycube.hexmesh.generation.graded_lattice import graded, planned
from polycube.hexmesh.quality import volume
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.structure.lattice import genus as genus_of_polycube
from polycube.structure.lattice import is_manifold
from polycube.types import Polycube


def polycube(full: np.ndarray) -> Polycube:
    return Polycube(full, *(np.arange(n + 1.0) for n in full.shape), (1, 1, 1), ("cube",))


def marked(shape: tuple[int, int, int], *cells: tuple[int, int, int]) -> np.ndarray:
    found = np.zeros(shape, bool)
    for cell in cells:
        found[cell] = True
    return found


def test_each_block_is_one_hex_if_no_cell_is_needed():
    full = np.ones((8, 4, 6), bool)
    mesh = graded(full, [np.zeros_like(full)])
    assert len(mesh.hexes) == 4 * 2 * 3
    assert scaled_jacobian(mesh.vertices, mesh.hexes) == pytest.approx(1)
    assert mesh.vertices.min(axis=0).tolist() == [0, 0, 0]
    assert mesh.vertices.max(axis=0).tolist() == [8, 4, 6]


def test_no_graded_lattice_if_all_cells_are_needed():
    assert graded(np.ones((8, 8, 8), bool), [np.ones((8, 8, 8), bool)]) is None


def test_a_solid_without_half_full_blocks_is_not_graded():
    rod = np.ones((16, 1, 1), bool)
    assert graded(rod, [np.zeros_like(rod)]) is None


def test_hexes_are_cells_near_a_needed_cell_and_blocks_far_from_it():
    full = np.ones((24, 24, 24), bool)
    mesh = graded(full, [marked(full.shape, (2, 3, 2))])
    check_conforming(mesh)
    assert genus(mesh) == 0
    assert volume(mesh) == pytest.approx(24**3)
    size = np.ptp(mesh.vertices[mesh.hexes], axis=1).max(axis=1)
    middle = mesh.vertices[mesh.hexes].mean(axis=1)
    near = ((middle > 2) & (middle < 4)).all(axis=1)
    assert near.sum() == 8
    assert size[near] == pytest.approx(1)
    assert size[middle.max(axis=1) > 10] == pytest.approx(2)
    assert len(mesh.hexes) < 24**3 / 4


def test_a_small_hole_stays_open_where_it_is_needed():
    full = np.ones((24, 24, 8), bool)
    full[10:12, 11:13, :] = False
    round_hole = np.zeros_like(full)
    round_hole[8:14, 9:15] = True
    mesh = graded(full, [round_hole & full])
    check_conforming(mesh)
    assert genus(mesh) == 1
    assert volume(mesh) == pytest.approx(full.sum())


def test_blocks_that_would_be_pinched_are_divided():
    full = np.ones((16, 16, 4), bool)
    full[:8, :8] = full[8:, 8:] = False
    full[7:9, 7:9] = True  # a bridge of less than half a block on each side
    assert is_manifold(polycube(full))
    plan = planned(np.pad(full, 4), [np.zeros(np.array(full.shape) + 8, bool)])
    assert plan is not None
    assert plan.cells[11:13, 11:13, 4:8].all()
    mesh = graded(full, [np.zeros_like(full)])
    check_conforming(mesh)
    assert genus(mesh) == 0


@settings(deadline=None, max_examples=25)
@given(seed=st.integers(0, 10**6))
@pytest.mark.slow
def test_random_solids_are_conforming_and_connected(seed):
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(*[np.arange(20) + 0.5] * 3, indexing="ij"), axis=-1)
    full = np.zeros((20, 20, 20), bool)
    for _ in range(3):  # balls that hold the middle
        centre = 10 + rng.uniform(-2.5, 2.5, 3)
        full |= np.linalg.norm((grid - centre) / rng.uniform(4.5, 7, 3), axis=-1) < 1
    needed = full & (np.linalg.norm(grid - rng.uniform(0, 20, 3), axis=-1) < 4)
    if not is_manifold(polycube(full)):
        return
    mesh = graded(full, [needed])
    if mesh is None:
        return
    check_conforming(mesh)
    assert genus(mesh) == genus_of_polycube(polycube(full))
    middle = mesh.vertices[mesh.hexes].mean(axis=1)
    for cell in np.argwhere(needed) + 0.5:
        assert np.abs(middle - cell).max(axis=1).min() < 1e-9


def test_three_sizes_from_a_cell_to_blocks_of_four():
    full = np.ones((48, 48, 48), bool)
    cell = marked(full.shape, (20, 20, 20))
    mesh = graded(full, [cell, cell])
    check_conforming(mesh)
    assert genus(mesh) == 0
    assert volume(mesh) == pytest.approx(48**3)
    size = np.ptp(mesh.vertices[mesh.hexes], axis=1).max(axis=1)
    middle = mesh.vertices[mesh.hexes].mean(axis=1)
    assert size[((middle > 20) & (middle < 21)).all(axis=1)] == pytest.approx(1)
    assert size[middle.max(axis=1) > 40] == pytest.approx(4)
    assert len(mesh.hexes) < len(graded(full, [cell]).hexes) / 3


@pytest.mark.slow
@given(st.integers(0, 10_000))
@settings(max_examples=15, deadline=None)
def test_any_needed_cells_give_a_conforming_mesh_of_three_sizes(seed):
    generator = np.random.default_rng(seed)
    full = np.ones(2 * generator.integers(2, 15, 3), bool)
    small = generator.random(full.shape) < 2 / full.size
    large = generator.random(full.shape) < 4 / full.size
    mesh = graded(full, [small, small | large])
    if mesh is None:
        return
    check_conforming(mesh)
    assert genus(mesh) == 0
    where = mesh.vertices[mesh.hexes]
    low, high = where.min(axis=1), where.max(axis=1)
    for cells, most in ((small, 1), (small | large, 2)):
        for middle in np.argwhere(cells) + 0.5:
            own = ((low < middle) & (high > middle)).all(axis=1)
            # a hex beside larger ones is wider by an eighth of a cell of those
            assert np.ptp(where[own], axis=1).max(axis=1).min() < 1.25 * most


def test_fine_blocks_that_touch_another_leg_along_an_edge():
    full = np.zeros((16, 16, 24), bool)
    full[:6, :6] = full[10:, 10:] = full[:, :, 20:] = True  # two legs of an arch
    mesh = graded(full, [marked(full.shape, (2, 2, 2))])  # up to 10 along each axis are cut
    check_conforming(mesh)
    assert genus(mesh) == 0
