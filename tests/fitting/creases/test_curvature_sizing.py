"""Parts on curved surfaces: exact on a cylinder, whose chord errors are known."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from polycube.fitting.creases import chord_counts as chords
from polycube.hexmesh.generation import sizing
from polycube.hexmesh.generation.template import mesh
from polycube.structure.rough_map import identity_map
from polycube.surface.fit_target import target
from polycube.types import Polycube, TriMesh

BOX = Polycube(np.ones((1, 1, 1)), [-1, 1], [-1, 1], [-1, 1], (1, 1, 1), ("cube",))


def _round(points):
    """Map squares around the z axis to circles, evenly by angle."""
    x, y, z = points.T
    radius = np.maximum(np.abs(x), np.abs(y))
    turn = np.divide(
        np.minimum(np.abs(x), np.abs(y)), radius, where=radius > 0, out=np.zeros(len(x))
    )
    angle = np.pi / 4 * turn
    angle = np.where(np.abs(x) >= np.abs(y), angle, np.pi / 2 - angle)
    return np.stack(
        [np.sign(x) * radius * np.cos(angle), np.sign(y) * radius * np.sin(angle), z], 1
    )


@pytest.mark.parametrize("parts", [1, 2, 3, 5])
def test_chords_of_a_cylinder(parts):
    solid = trimesh.creation.cylinder(radius=1, height=2, sections=720)
    goal = target(TriMesh(solid.vertices, solid.faces))
    counts = tuple(np.array([n]) for n in (parts, parts, 3))
    hexes = mesh(BOX, identity_map(BOX), counts)
    hexes = replace(hexes, vertices=_round(hexes.vertices))
    x, y, z = chords.gaps(BOX, hexes, counts, goal)
    assert goal.scale == pytest.approx(12**0.5, rel=1e-3)
    sagitta = (1 - np.cos(np.pi / 4 / parts)) / 12**0.5
    assert x == pytest.approx([sagitta], rel=2e-3) and y == pytest.approx([sagitta], rel=2e-3)
    assert z == pytest.approx([0], abs=1e-5)


def test_parts_grow_with_the_root_of_the_gap_and_are_at_most_doubled():
    wide = Polycube(np.ones((3, 1, 1)), range(4), [0, 1], [0, 1], (3, 1, 1), ("cube",) * 3)
    counts = tuple(np.array(n) for n in ([4, 4, 4], [4], [4]))
    gap = tuple(np.array(g) for g in ([1.0, 1.5, 0.1], [1.0], [1.0]))
    x, y, z = chords.finer(wide, counts, counts, gap, 1.0)
    assert x.tolist() == [4, 5, 4] and y.tolist() == z.tolist() == [4]
    few = tuple(n // 2 for n in counts)  # the gap of half the parts is four times that of all
    assert chords.finer(wide, counts, few, tuple(4 * g for g in gap), 1.0)[0].tolist() == x.tolist()
    x, y, z = chords.finer(wide, counts, counts, tuple(100 * g for g in gap), 1.0)
    assert (x <= 8).all() and y <= 8
    assert sizing.number_of_hexes(wide, (x, y, z)) <= 2 * sizing.number_of_hexes(wide, counts)
