import itertools
import logging

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycube.errors import InputError
from polycube.registry import build
from polycube.structure.lattice import boundary, collapse, genus, lattice
from polycube.structure.rough_map import evaluate
from polycube.surface.frames import rotations, turn
from polycube.types import Candidate, Polycube, TriMesh
from tests.conftest import first_quick
from tests.fixtures.polycubes import NAMES, PRIMITIVES, THREE, TWO, part

SCALE = np.diag([20.0, 15.0, 11.0])


def propose(surface: TriMesh, name: str = "slices", grid=TWO, **options) -> list[Candidate]:
    config = {"plugin": name, **options}
    return build("structure", config, grid=grid, primitives=PRIMITIVES)(surface, ())


def shapes(polycube: Polycube) -> set:
    """The boxes in all orientations."""
    turned = [turn(collapse(polycube).occupancy, rotation) for rotation in rotations()]
    return {(boxes.shape, boxes.tobytes()) for boxes in turned}


def corner_gap(candidate: Candidate, context, linear=SCALE, grid=TWO) -> float:
    """Largest distance between the corners of the part and of the candidate, either way."""
    found = evaluate(candidate.rough_map, boundary(candidate.polycube).vertices)
    true = boundary(collapse(lattice(grid, context, PRIMITIVES))).vertices @ np.transpose(linear)
    gap = np.linalg.norm(found[:, None] - true, axis=2)
    return max(gap.min(axis=0).max(), gap.min(axis=1).max())


@pytest.mark.parametrize(("left", "right"), first_quick(6, itertools.product(NAMES, repeat=2)))
def test_slices_recognise_every_context_of_two_cells(left, right):
    context = (left, right)
    best = propose(part(context, SCALE))[0]
    expected = lattice(TWO, context, PRIMITIVES)
    assert shapes(best.polycube) == shapes(expected)
    assert best.proposal == "slices" and best.cost < 0.05
    corners = evaluate(best.rough_map, np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]))
    assert np.linalg.det(corners[1:] - corners[0]) > 0


@pytest.mark.parametrize("context", [("cube", "hole_y"), ("hole_x", "hole_z"), ("hole_x", "cube")])
def test_the_rough_map_puts_corners_within_a_voxel(context):
    assert corner_gap(propose(part(context, SCALE))[0], context) < 3**0.5 * 40 / 96


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("context", [("hole_y", "hole_z"), ("hole_x", "hole_y")])
def test_the_structure_does_not_depend_on_the_pose(context, seed):
    rotation = Rotation.random(random_state=seed).as_matrix()
    best = propose(part(context, rotation @ SCALE * 1e-3, [5, 0, -7]))[0]
    assert shapes(best.polycube) == shapes(lattice(TWO, context, PRIMITIVES))
    across = best.rough_map.positions[-1].mean(axis=(0, 1)) - best.rough_map.positions[0].mean(
        (0, 1)
    )
    assert abs(across @ rotation[:, 0]) / np.linalg.norm(across) > 0.999


def test_the_rough_map_of_a_bent_bar_with_a_hole():
    straight = part(("cube", "hole_y", "cube"), np.diag([10.0, 8, 8]), grid=THREE)
    x, y, z = straight.vertices.T
    bent = np.stack([(40 - z) * np.sin(x / 40), y, 40 - (40 - z) * np.cos(x / 40)], axis=1)
    best = propose(TriMesh(bent, straight.faces), grid=THREE)[0]
    assert genus(best.polycube) == 1
    middle = best.rough_map.positions.mean(axis=(1, 2))[20:-20]  # the ends are cut askew
    radius = np.linalg.norm(middle - [0, 4, 40], axis=1)
    assert len(middle) > 50 and np.abs(radius - 36).max() < 0.5


def test_names_follow_the_lengths():
    assert propose(part(("cube", None), np.eye(3)))[0].polycube.context == ("cube", None)
    assert propose(part(("cube", "cube"), np.eye(3)))[0].polycube.context == ("cube", "cube")
    assert propose(part(("hole_y", "cube"), np.eye(3)))[0].polycube.context in (
        ("hole_y", "cube"),
        ("cube", "hole_y"),
        ("hole_z", "cube"),
        ("cube", "hole_z"),
    )


def test_equal_structures_have_equal_keys():
    found = propose(part(("hole_x", "hole_x"), SCALE))
    readings = [c for c in found if c.key == found[0].key]
    assert len(readings) == 3  # along the hole, and across it twice
    assert {c.polycube.occupancy.shape for c in readings} == {(1, 3, 3), (3, 1, 3), (3, 3, 1)}


def test_nothing_is_proposed_without_a_row_or_for_another_genus(caplog):
    caplog.set_level(logging.INFO)
    assert propose(part(("cube", None), SCALE), grid=(2, 2, 1)) == []
    assert "not a row of cells" in caplog.text
    three = part(("hole_y",) * 3, SCALE, grid=THREE)
    assert propose(three) == []
    assert "genus 3 is that of 0 of 14 slab patterns" in caplog.text
    assert len(propose(three, grid=THREE)[0].polycube.x) == 8


@pytest.mark.parametrize("asked", [("cube", "hole_z"), ("hole_y", "cube"), ("hole_z", "cube")])
def test_given_rotates_the_context_to_fit(asked):
    best = propose(part(("cube", "hole_y"), SCALE), "given", context=list(asked))[0]
    assert best.polycube.context == asked
    assert best.cost < 0.02 and best.proposal == "given"
    hole = lattice(TWO, asked, PRIMITIVES)
    empty = np.argwhere(~hole.occupancy) / 3 + 1 / 6
    centre = evaluate(best.rough_map, empty.mean(axis=0)[None])[0]
    np.testing.assert_allclose(centre, np.array([1.5, 0.5, 0.5]) * np.diag(SCALE), atol=0.5)


@pytest.mark.slow
def test_given_rotates_a_single_cell():
    ring = part(("hole_x", None), np.diag([4.0, 10, 10]))
    found = propose(ring, "given", context=["hole_y"])
    assert found[0].cost < 0.02
    contexts = {c.polycube.context for c in found if c.cost < 0.2}
    assert contexts == {("hole_x", None), ("hole_y", None), ("hole_z", None)}


def test_given_fits_boxes_if_the_context_is_not_a_row():
    grid = (1, 2, 1)
    rotation = Rotation.random(random_state=1).as_matrix()
    surface = part(("cube", "hole_x"), rotation @ SCALE, grid=grid)
    found = propose(surface, "given", grid, context=["cube", "hole_x"])
    assert found[0].cost < 0.05 < found[-1].cost
    assert corner_gap(found[0], ("cube", "hole_x"), rotation @ SCALE, grid) < 3**0.5 * 30 / 96


@pytest.mark.parametrize(
    ("grid", "context", "message"),
    [
        (TWO, ["hole_y"], "hole_y has genus 1, but the surface has genus 0"),
        (TWO, ["cube", "cube", "cube"], "must name 1 to 2 cells of the 2x1x1 grid"),
        (TWO, [], "must name 1 to 2 cells"),
        (TWO, [None, None], "must fill at least one cell"),
        (TWO, ["sphere"], "no primitive named 'sphere'"),
        (THREE, ["cube", None, "cube"], "not one solid without voids"),
        (THREE, ["cube", "hole_x", "cube"], "not one solid without voids"),
    ],
)
def test_given_refuses_a_context_that_cannot_fit(grid, context, message):
    with pytest.raises(InputError, match=message):
        propose(part(("cube", None), SCALE), "given", grid, context=context)
