import numpy as np
import pytest

from polycube.charts.segmentation import network
from polycube.structure.lattice import boundary, collapse, corners, lattice
from tests.fixtures.polycubes import PRIMITIVES, TWO, edges

CONTEXTS = [("cube", None), ("hole_x", "cube"), ("hole_z", "hole_x"), ("hole_y", "hole_y")]


@pytest.mark.parametrize("context", CONTEXTS)
def test_arcs_and_corners_are_those_of_the_lattice(context):
    outside = boundary(collapse(lattice(TWO, context, PRIMITIVES)))
    net = network(outside)
    ends, patches = edges(outside)
    wanted = {(*sorted(e), *p) for e, p in zip(ends.tolist(), patches.tolist(), strict=True)}
    found = {
        (*sorted((a.vertices[0], a.vertices[-1])), *sorted((a.left, a.right))) for a in net.arcs
    }
    assert found == wanted and len(net.arcs) == len(wanted)
    assert sorted(net.rings) == sorted(corners(outside).tolist())


@pytest.mark.parametrize("context", CONTEXTS)
def test_between_two_arcs_of_a_ring_lies_one_patch(context):
    """Counter-clockwise: on the left of an arc that leaves a corner, on the right of the next."""
    net = network(boundary(collapse(lattice(TWO, context, PRIMITIVES))))
    seen = 0
    for ring in net.rings.values():
        for (arc, end), (after, its_end) in zip(ring, ring[1:] + ring[:1], strict=True):
            left = net.arcs[arc].left if end == 0 else net.arcs[arc].right
            right = net.arcs[after].right if its_end == 0 else net.arcs[after].left
            assert left == right
            seen += 1
    assert seen == 2 * len(net.arcs)


def test_the_left_of_an_arc_is_seen_from_outside():
    outside = boundary(collapse(lattice(TWO, ("cube", "cube"), PRIMITIVES)))
    normals = np.repeat(np.eye(3), 2, axis=0) * np.tile([1, -1], 3)[:, None]
    axis = dict(zip(outside.patch.tolist(), outside.axis.tolist(), strict=True))
    for arc in network(outside).arcs:
        along = outside.vertices[arc.vertices[-1]] - outside.vertices[arc.vertices[0]]
        left, right = normals[axis[arc.left]], normals[axis[arc.right]]
        assert np.cross(left + right, along) @ (right - left) < 0
