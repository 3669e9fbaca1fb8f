"""Pictures of CAD models: lost curves and faces, and the named sets of the boundary."""

from itertools import cycle

import numpy as np

from polycube.hexmesh.connectivity import quad_edges
from polycube.hexmesh.face_groups import ENDS
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.named_sets import kind_of
from polycube.report.pictures import colours as palette
from polycube.report.pictures.colours import AXIS_COLOURS, SURFACE, rgb
from polycube.report.pictures.render import Layer, Scene, from_both_sides
from polycube.surface.fit_target import target
from polycube.types import Goal, HexMesh, TriMesh

DEFAULT = Goal()  # limits of features
WIDTH = 8  # width of the lines in pixels
CROSS = 0.012  # of the diagonal: half the size of the mark at a lost point
AMBIENT = 0.6  # makes the colours in the shade similar to those of the legend
CLEAR = 0.9  # share of the quads of a set that must have its colour


def lost_features(mesh: HexMesh, surface: TriMesh, goal: Goal = DEFAULT) -> Scene:
    """The model from both sides, with lost faces, curves and points marked."""
    lost = [each for each in inspect(mesh, surface).features if each.exceeds(goal)]
    faces = [each.faces[0] for each in lost if each.kind == "face"]
    colours = rgb((SURFACE, palette.LOST_FACE))[np.isin(surface.region, faces).astype(int)]
    scene = [Layer(surface.vertices, surface.faces, colours, smooth=True)]
    for chains, colour in zip(
        _chains(mesh, surface, goal), (palette.PRESERVED, palette.WORST), strict=True
    ):
        if chains:
            scene.append(lines(chains, colour))
    return from_both_sides(scene)


def lost_segments(mesh: HexMesh, surface: TriMesh, goal: Goal = DEFAULT) -> np.ndarray:
    """(N, 2, 3) lines along lost curves and around lost faces, and crosses at lost points.

    Empty without CAD faces.
    """
    if not len(surface.region):
        return np.zeros((0, 2, 3))
    found = inspect(mesh, surface).features
    faces = {each.faces[0] for each in found if each.kind == "face" and each.exceeds(goal)}
    on = target(surface)
    around = [each for each in on.features.creases if faces.intersection(each.faces)]
    chains = _chains(mesh, surface, goal)[1] + [on.to_model(each.points) for each in around]
    pairs = [np.stack([chain[:-1], chain[1:]], axis=1) for chain in chains]
    return np.concatenate([np.zeros((0, 2, 3)), *pairs])


def _chains(
    mesh: HexMesh, surface: TriMesh, goal: Goal
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Points (N, 3) along each preserved curve, and along each lost one or at lost points.

    The curves of `Inspection.features` are the creases of the target, in the same order.
    """
    found = inspect(mesh, surface).features
    on = target(surface)
    curves = [each for each in found if each.kind == "curve"]
    preserved: list[np.ndarray] = []
    lost: list[np.ndarray] = []
    for crease, each in zip(on.features.creases, curves, strict=True):
        (lost if each.exceeds(goal) else preserved).append(on.to_model(crease.points))
    points = [each.place for each in found if each.kind == "point" and each.exceeds(goal)]
    arms = CROSS * on.scale * np.array([[1, 0, 0], [-1, 0, 0], [0, 0, 0]])
    cross = np.concatenate([np.roll(arms, k, axis=1) for k in range(3)])  # one polyline
    return preserved, lost + [np.array(place) + cross for place in points]


def lines(chains: list[np.ndarray], colour: str) -> Layer:
    """Lines through the points (N, 3) of each chain."""
    points = np.concatenate(chains)
    first = np.setdiff1d(np.arange(len(points)), np.cumsum([len(chain) for chain in chains]) - 1)
    nothing = np.zeros((0, 3), np.int64)
    lines, no_colours = np.stack([first, first + 1], axis=1), nothing.astype(np.uint8)
    return Layer(points, nothing, no_colours, lines, line_colour=colour, line_width=WIDTH)


def quad_colours(mesh: HexMesh) -> np.ndarray:
    """(Q,) colour of each boundary quad, as #rrggbb: that of its first set.

    Directions have the colours of the axes. Patches have no colour, because every quad is in one.
    """
    found = np.full(len(mesh.quads), SURFACE)
    is_free = np.ones(len(mesh.quads), bool)
    axis = dict(zip(ENDS, np.array(AXIS_COLOURS)[[1, 0, 3, 2, 5, 4]].tolist(), strict=True))
    holes, faces = cycle(palette.HOLES), cycle(palette.FACES)
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
    every = np.arange(len(mesh.quads))
    members = np.array([np.isin(every, own) for own in mesh.sets.values()], bool)
    found, number = np.unique(members.reshape(-1, len(every)), axis=1, return_inverse=True)
    names = np.array(list(mesh.sets), object)
    return number.reshape(-1), [", ".join(names[row]) for row in found.T]


def both_sides(mesh: HexMesh) -> Scene:
    """The boundary with coloured quads, from the front above and from behind below.

    Lines separate quads of different colours.
    """
    colours = quad_colours(mesh)
    edges, pair = quad_edges(mesh.quads)
    lines = edges[colours[pair[:, 0]] != colours[pair[:, 1]]]
    painted = rgb(tuple(colours.tolist()))
    part = Layer(mesh.vertices, mesh.quads, painted, lines, outlined=True, ambient=AMBIENT)
    return from_both_sides([part])
