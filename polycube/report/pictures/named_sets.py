"""Colours of the named sets of the boundary, common to page and picture."""

from itertools import cycle

import numpy as np

from polycube.hexmesh.connectivity import quad_edges
from polycube.hexmesh.face_groups import ENDS
from polycube.hexmesh.named_sets import kind_of
from polycube.report.pictures.colours import AXIS_COLOURS, FACES, HOLES, SURFACE, rgb
from polycube.report.pictures.render import Layer, Scene, from_both_sides
from polycube.types import HexMesh

AMBIENT = 0.6  # makes the colours in the shade similar to those of the legend
CLEAR = 0.9  # share of the quads of a set that must have its colour


def quad_colours(mesh: HexMesh) -> np.ndarray:
    """(Q,) colour of each boundary quad, as #rrggbb: that of its first set.

    Directions have the colours of the axes. Patches have no colour, because every quad is in one.
    """
    found = np.full(len(mesh.quads), SURFACE)
    is_free = np.ones(len(mesh.quads), bool)
    axis = dict(zip(ENDS, np.array(AXIS_COLOURS)[[1, 0, 3, 2, 5, 4]].tolist(), strict=True))
    holes, faces = cycle(HOLES), cycle(FACES)
    for name, own in mesh.sets.items():
        free = own[is_free[own]]
        if kind_of(name) == "patch" or not len(free):
            continue
        found[free] = axis.get(name) or next(holes if kind_of(name) == "hole" else faces)
        is_free[free] = False
    return found


def set_colours(mesh: HexMesh) -> dict[str, str]:
    """Colour of each set if nearly all of its quads have it."""
    colours = quad_colours(mesh)
    found = {}
    for name, own in mesh.sets.items():
        shown, count = np.unique(colours[own], return_counts=True)
        if len(own) and count.max() >= CLEAR * len(own) and shown[count.argmax()] != SURFACE:
            found[name] = str(shown[count.argmax()])
    return found


def memberships(mesh: HexMesh) -> tuple[np.ndarray, list[str]]:
    """Combinations of sets: their number for each boundary quad (Q,), and their names, joined."""
    is_in = np.zeros((len(mesh.quads), len(mesh.sets)), bool)
    for column, own in enumerate(mesh.sets.values()):
        is_in[own, column] = True
    found, number = np.unique(is_in, axis=0, return_inverse=True)
    names = np.array(list(mesh.sets), object)
    return number.reshape(-1), [", ".join(names[row]) for row in found]


def both_sides(mesh: HexMesh) -> Scene:
    """The boundary with coloured quads, from the front above and from behind below.

    Lines separate quads of different colours.
    """
    colours = quad_colours(mesh)
    edges, pair = quad_edges(mesh.quads)
    lines = edges[colours[pair[:, 0]] != colours[pair[:, 1]]]
    painted = rgb(tuple(colours.tolist()))
    return from_both_sides(
        [Layer(mesh.vertices, mesh.quads, painted, lines, outlined=True, ambient=AMBIENT)]
    )
