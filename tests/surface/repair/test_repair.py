"""Repairs: each kind of damage of a box or torus, and the given collection of bad files."""

import numpy as np
import pytest

from polycube.errors import InputError
from polycube.io.stl import read_stl, write_stl
from polycube.io.surfaces import read_repaired, read_surface
from polycube.surface.checks import check_surface
from polycube.surface.intersections import self_intersections
from polycube.surface.measures import genus, volume
from polycube.surface.repair.repair import repaired
from polycube.types import TriMesh
from tests.fixtures.surfaces import box, joined, torus

RING = torus(48, 24)


def without(surface: TriMesh, *faces: int) -> TriMesh:
    return TriMesh(surface.vertices, np.delete(surface.faces, faces, axis=0))


def test_a_good_surface_is_left_as_it_is():
    surface, repair = repaired(RING.vertices, RING.faces, "aggressive")
    np.testing.assert_array_equal(
        surface.faces[np.lexsort(surface.faces.T)].shape, RING.faces.shape
    )
    assert volume(surface) == pytest.approx(volume(RING), rel=1e-14)
    assert repair.changes == () and repair.deviation == 0
    assert repair.sentence() == "repair=aggressive: there was nothing to repair"


def test_small_holes_are_closed_by_safe_wide_ones_by_aggressive_only():
    surface, repair = repaired(RING.vertices, without(RING, 5, 300, 301).faces, "safe")
    check_surface(surface)
    assert len(surface.faces) == len(RING.faces)
    assert "closed holes: 3 of 3, 9 edges, 3 new faces" in repair.changes[0]
    assert volume(surface) == pytest.approx(volume(RING), rel=1e-3)
    assert 0 <= repair.deviation_percent < 1

    wide = without(RING, *np.flatnonzero(RING.vertices[RING.faces][:, :, 0].min(axis=1) > 2))
    with pytest.raises(InputError, match="not closed"):
        repaired(wide.vertices, wide.faces, "safe")
    surface, repair = repaired(wide.vertices, wide.faces, "aggressive")
    check_surface(surface)
    assert repair.deviation > 0.1


def test_an_open_box_gets_its_flat_lid_exactly():
    surface, repair = repaired(box().vertices, box().faces[2:], "safe")
    check_surface(surface)
    assert volume(surface) == pytest.approx(1, rel=1e-14)
    assert repair.deviation > 0  # of the lid from what was given


def test_debris_and_loose_faces_are_left_out():
    crumb = box((3, 3, 3), (3.01, 3.01, 3.01))
    fin = np.append(RING.faces, [[*RING.faces[7, :2], len(RING.vertices)]], axis=0)
    finned = TriMesh(np.append(RING.vertices, [[9, 9, 9.0]], axis=0), fin)
    surface, repair = repaired(joined(finned, crumb).vertices, joined(finned, crumb).faces, "safe")
    check_surface(surface)
    assert len(surface.faces) == len(RING.faces)
    assert [change.partition(":")[0] for change in repair.changes] == [
        "removed faces that are attached to only one edge",
        "removed faces of debris",
    ]
    assert repair.deviation == 0


def test_voids_are_filled_by_size_and_named_with_their_volume():
    void = box((0.4, 0.4, 0.4), (0.8, 0.8, 0.8))
    hollow = joined(box(), TriMesh(void.vertices, void.faces[:, ::-1]))
    with pytest.raises(InputError, match="inner void"):
        repaired(hollow.vertices, hollow.faces, "safe")
    surface, repair = repaired(hollow.vertices, hollow.faces, "aggressive")
    assert volume(surface) == pytest.approx(1)
    assert "1 filled, 6.4 % of the volume" in repair.changes[-1]
    assert repair.volume_before == pytest.approx(1 - 0.4**3)


@pytest.mark.slow
def test_overlapping_solids_become_one_and_touching_ones_are_refused():
    two = joined(box(), box((0.51, 0.52, 0.53), (1.51, 1.52, 1.53)))
    surface, repair = repaired(two.vertices, two.faces, "aggressive")
    check_surface(surface)
    assert not len(self_intersections(surface))
    assert volume(surface) == pytest.approx(2 - 0.49 * 0.48 * 0.47, rel=0.02)
    assert repair.cell is not None and "rebuilt on cells" in repair.sentence()
    assert repair.deviation_percent < 2
    apart = joined(box(), box((3, 0, 0), (4, 1, 1)))
    with pytest.raises(InputError, match="2 separate pieces"):
        repaired(apart.vertices, apart.faces, "aggressive")


@pytest.mark.parametrize("scale", [1e-9, 1e9])
@pytest.mark.parametrize("offset", [0.0, 1e3])
def test_repairs_do_not_depend_on_scale_and_place(scale, offset):
    vertices = scale * (RING.vertices + offset)
    surface, repair = repaired(vertices, without(RING, 5, 300).faces, "safe")
    _, plain = repaired(RING.vertices, without(RING, 5, 300).faces, "safe")
    check_surface(surface)
    assert repair.deviation_percent == pytest.approx(plain.deviation_percent, rel=1e-4)


def test_stl_is_written_as_it_is_read(tmp_path):
    path = write_stl(tmp_path / "part.stl", RING.vertices, RING.faces)
    corners, faces, *_ = read_stl(path)
    np.testing.assert_allclose(corners[faces], RING.vertices[RING.faces], atol=1e-6)


SAFE = [  # refused as they are, usable after `safe`
    "debris_component.obj",
    "inner_void_sphere.obj",
    "nonmanifold_edge_fin.obj",
    "open_one_triangle.stl",
    "real_heart_ddpm.obj",
]
AGGRESSIVE = [
    "inf_text.obj",
    "inner_void.obj",
    "nan_coordinate.stl",
    "nan_text.obj",
    "open_hole.obj",
]
NEVER = ["flat_double_sheet.obj", "klein_bottle.obj", "two_components.stl"]


@pytest.mark.parametrize("name", SAFE + AGGRESSIVE)
def test_the_refusal_names_the_level_that_helps(testdata, name):
    level = "safe" if name in SAFE else "aggressive"
    with pytest.raises(InputError, match=f"; repair={level} makes it usable"):
        read_surface(testdata / "bad" / name)
    surface, warnings, repair, _ = read_repaired(testdata / "bad" / name, None, level)
    check_surface(surface)
    assert repair.changes and warnings[0] == repair.sentence()


@pytest.mark.parametrize("name", NEVER)
def test_what_no_repair_helps_is_refused_at_every_level(testdata, name):
    for level in ("off", "safe", "aggressive"):
        with pytest.raises(InputError) as caught:
            read_repaired(testdata / "bad" / name, None, level)
        assert "repair=" not in str(caught.value)


@pytest.mark.parametrize(
    "name", [pytest.param("real_cup_ddpm.obj", marks=pytest.mark.slow), "real_rod_ddpm.obj"]
)
def test_crossings_of_published_parts_are_gone(testdata, name):
    surface, _, repair, _ = read_repaired(testdata / "bad" / name, None, "aggressive")
    before, _ = read_surface(testdata / "bad" / name)
    check_surface(surface)
    assert not len(self_intersections(surface))
    assert genus(surface) == genus(before)
    assert repair.deviation_percent < 1
    assert volume(surface) == pytest.approx(volume(before), rel=1e-3)
