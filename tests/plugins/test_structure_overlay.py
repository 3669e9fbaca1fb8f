"""Lattices as fine as the hexes: planes, topology, and full parts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import label
from scipy.spatial.transform import Rotation

from polycube.hexmesh.generation.template import mesh
from polycube.hexmesh.inspection import inspect
from polycube.io.hex_meshes import boundary
from polycube.plugins.structure.overlay.planes import manifold, planes
from polycube.registry import build
from polycube.structure.lattice import genus, is_manifold
from polycube.structure.neighbourhoods import TABLE, codes
from polycube.surface.measures import diagonal, volume
from polycube.types import Polycube, Tier, TriMesh
from tests.fixtures.hexmeshes import hex_box, surface_of
from tests.fixtures.machined import bored, pocketed
from tests.fixtures.polycubes import PRIMITIVES, part
from tests.fixtures.surfaces import box, joined, torus


def overlay(surface, **options):
    plugin = build(
        "structure", {"plugin": "overlay", **options}, grid=(1, 1, 1), primitives=PRIMITIVES
    )
    return plugin(surface, ())


def solid(full):
    return Polycube(full, *(np.arange(n + 1.0) for n in full.shape), (1, 1, 1), ("cube",))


def test_planes_of_blocks_are_on_the_faces_and_even_between_them():
    step = joined(box(high=(1, 1, 0.4)), box((2, 0, 0), (3, 1, 1)))
    found = planes(step, 2, 0.1)
    assert found[::2] == pytest.approx([0, 0.2, 0.4, 0.6, 0.8, 1])
    assert found[1::2] == pytest.approx([0.1, 0.3, 0.5, 0.7, 0.9])


def test_the_plane_within_a_block_moves_to_a_face_there():
    step = joined(box(high=(1, 1, 0.4)), box((2, 0, 0), (3, 1, 1)), box((4, 0, 0), (4.5, 1, 0.52)))
    found = planes(step, 2, 0.1)
    assert 0.52 in found.round(12)[1::2]
    assert len(found) == 11


def test_the_larger_of_two_close_faces_has_a_plane_of_blocks():
    near = joined(box(high=(1, 1, 0.51)), box((2, 0, 0), (4, 1, 0.55)), box((5, 0, 0), (6, 1, 1)))
    found = planes(near, 2, 0.1)
    assert 0.55 in found.round(12)[::2]
    assert 0.51 not in found.round(12)
    assert np.diff(found).min() > 0.06


@settings(deadline=None)
@given(seed=st.integers(0, 10**6), least=st.floats(0.2, 0.8))
@pytest.mark.slow
def test_random_cells_become_one_manifold_solid_without_voids(seed, least):
    share = np.random.default_rng(seed).random((5, 6, 4))
    full = manifold(share, least)
    assert full.any()
    assert label(full)[1] == 1
    assert label(~np.pad(full, 1))[1] == 1
    assert not TABLE[codes(np.pad(full, 1)), 1].any()
    assert is_manifold(solid(full))


def test_a_manifold_solid_is_unchanged():
    share = np.zeros((4, 4, 2))
    share[:3, :2] = 1
    assert (manifold(share, 0.5) == (share > 0)).all()


@pytest.mark.parametrize(("share", "is_kept"), [(0.25, True), (0.1, False)])
def test_a_wall_thinner_than_half_a_cell_fills_its_cells(share, is_kept):
    shares = np.zeros((6, 5, 7))
    shares[:, :, :2] = 1
    shares[3, :, 2:] = share
    shares[1, :, 2] = share  # a rib as high as a cell is no wall
    expected = shares == 1
    expected[3, :, 2:] = is_kept
    assert (manifold(shares, 0.5) == expected).all()


@pytest.mark.parametrize("doubtful", [(1, 2), (2, 1)])
def test_the_least_certain_cells_are_flipped_if_two_blocks_touch_along_an_edge(doubtful):
    share = np.zeros((4, 4, 2))
    share[:2, :2] = share[2:, 2:] = 1
    share[doubtful] = 0.45
    full = manifold(share, 0.5)
    assert full[doubtful].all()
    assert full.sum() == (share > 0.4).sum()


@pytest.mark.parametrize("turn", [[0, 0, 0], [0.4, -0.7, 1.1]])
def test_the_lattice_of_a_rotated_part_has_its_genus_position_and_volume(turn):
    frame = Rotation.from_rotvec(turn).as_matrix() @ np.diag([20.0, 15.0, 11.0])
    surface = part(("hole_y", "hole_z"), frame)
    coarse, fine = overlay(surface, size="8%")
    for made, size in ((coarse, 0.04), (fine, 0.08 / 3.3)):
        assert (made.tier, made.variants, genus(made.polycube)) == (Tier.FINE, "overlay", 2)
        lattice = mesh(
            made.polycube, made.rough_map, [np.ones(n, int) for n in made.polycube.occupancy.shape]
        )
        assert volume(boundary(lattice)) == pytest.approx(volume(surface), rel=0.02)
        length = np.diff(made.rough_map.positions[:, 0, 0], axis=0)
        assert np.linalg.norm(length, axis=1).max() < 1.5 * size * diagonal(surface)


def test_a_hole_smaller_than_a_cell_makes_the_lattice_finer():
    ring = torus()
    thick = TriMesh(ring.vertices * [1, 1, 3], ring.faces)
    [coarse] = overlay(thick, size="70%", finer=[1.0], finest=1.0, steps=[1.0, 2.0, 4.0])
    assert genus(coarse.polycube) == 1


def test_a_thin_bent_sheet_that_fills_no_cell_is_contained_in_its_lattice():
    sheet = surface_of(hex_box((24, 6, 1), (10.0, 5.0, 0.1)))
    bend = [[0, 0, 0.06]] * (sheet.vertices[:, :1] - 5) ** 2
    made = overlay(TriMesh(sheet.vertices + bend, sheet.faces), size="10%", steps=[1.0])
    assert [genus(each.polycube) for each in made] == [0, 0, 0]
    for each in made:
        assert each.tier == Tier.FINE
        assert all(np.ptp(each.rough_map.positions.reshape(-1, 3), axis=0) > [9.9, 4.9, 1.3])
        assert each.polycube.occupancy.any(axis=(1, 2)).all()


def test_the_closest_lattice_is_a_substitute_if_none_has_the_genus():
    options = {"finer": [1.0], "finest": 1.0, "steps": [1.0], "least": [0.3], "thin": []}
    [spare] = overlay(torus(), size="40%", **options)
    assert spare.tier == Tier.LAST and genus(spare.polycube) == 0
    assert is_manifold(spare.polycube)


def test_a_lattice_with_too_many_cells_is_not_proposed():
    assert len(overlay(torus(), size="10%", max_hexes=300)) < 2


def test_finer_candidates_have_a_separate_limit():
    free, bound = (overlay(torus(), size="10%", most=most) for most in (10**6, 400))
    cells = [[each.polycube.occupancy.sum() for each in found] for found in (free, bound)]
    assert cells[0][0] == cells[1][0]
    assert max(cells[0]) > 800 and max(cells[1]) < 1.4 * 400


@pytest.mark.parametrize("size", ["0.01%", "1e-6%"])
def test_too_many_cells_are_refused_before_they_are_allocated(size):
    assert overlay(torus(), size=size) == []


@pytest.mark.slow
@pytest.mark.parametrize("sheets", ["all", "none"])
def test_a_pocketed_block_loses_no_features(sheets):
    surface = pocketed()
    made = overlay(surface, size="10%", finer=[2.0])[0]
    hexes = build("meshing/subdivide", {"plugin": "template", "level": 0})(
        surface, made.polycube, made.rough_map
    )
    hexes = build("meshing/smooth", {"plugin": "register"})(surface, hexes)
    hexes = build("meshing/pillow", {"plugin": "selective", "patches": "all", "sheets": sheets})(
        surface, hexes
    )
    paths = hexes.paths
    assert (len(paths) > 0) == (sheets == "all")
    hexes = build("meshing/optimize", {"plugin": "polish"})(surface, hexes)
    assert hexes.paths.keys() == paths.keys()
    found = inspect(hexes, surface)
    assert found.scaled_jacobian > (0.3 if sheets == "all" else 0.1)
    assert not any(each.is_lost for each in found.features)
    assert not len(found.crossings)


@pytest.mark.parametrize(("at", "size"), [("around", 24), ("through", 5), ("size", 0.5)])
def test_cells_are_as_small_as_requested_numbers_need(at, size):
    surface = bored()  # 4 x 4 x 2, a hole of radius 1
    entry = {"at": "hole_1" if at == "around" else "z_max", at: size}
    wanted = {"around": 2 * np.pi / 24, "through": 2 / 5, "size": 0.5}[at]
    plain = overlay(surface, size="30%", finer=[2.0], finest=2.0)
    made, *others = overlay(surface, size="30%", finer=[2.0], finest=2.0, at=[entry])
    lengths = [
        np.linalg.norm(np.diff(each.rough_map.positions, axis=a), axis=-1).max()
        for each in (plain[0], made)
        for a in range(3)
    ]
    assert max(lengths[3:]) < 1.3 * wanted < max(lengths[:3])
    assert [each.key for each in others] == [each.key for each in plain]


def test_cells_are_as_small_as_max_hexes_permits():
    surface = bored()
    entry = {"at": "hole_1", "size": 0.01}
    made = overlay(surface, size="30%", finer=[2.0], at=[entry], max_hexes=3000)[0]
    assert 1000 < made.polycube.occupancy.sum() <= 3000
