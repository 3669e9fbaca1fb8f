"""The CAD model with the curves and faces that the hex mesh loses."""

from __future__ import annotations

import numpy as np

from polycube.hexmesh.feature_distances import Feature
from polycube.hexmesh.inspection import inspect
from polycube.report.numbers.features import is_lost
from polycube.report.pictures.colours import KEPT, LOST_FACE, SURFACE, WORST, rgb
from polycube.report.pictures.render import Layer, Scene, from_both_sides
from polycube.surface.fit_target import target
from polycube.types import HexMesh, TriMesh

WIDTH = 8  # of the lines, pixels of the picture
CROSS = 0.012  # of the diagonal: half the width of the mark at a lost point


def lost_features(mesh: HexMesh, surface: TriMesh) -> Scene:
    """The model from both sides; lost faces, curves and points are marked.

    The curves of `Inspection.features` are the creases of the target, in their order.
    """
    found = inspect(mesh, surface).features
    gone = [each for each in found if is_lost(each)]
    faces = [each.faces[0] for each in gone if each.kind == "face"]
    is_lost_face = np.isin(surface.region, faces).astype(int)
    colours = rgb((SURFACE, LOST_FACE))[is_lost_face]
    goal = target(surface)
    curves = [each for each in found if each.kind == "curve"]
    scene = [Layer(surface.vertices, surface.faces, colours, smooth=True)]
    for is_gone, colour in ((False, KEPT), (True, WORST)):
        chains = [
            goal.to_model(crease.points)
            for crease, each in zip(goal.features.creases, curves, strict=True)
            if is_lost(each) == is_gone
        ]
        if is_gone:
            chains += [_cross(each, goal.scale) for each in gone if each.kind == "point"]
        if chains:
            scene.append(_lines(chains, colour))
    return from_both_sides(scene)


def _lines(chains: list[np.ndarray], colour: str) -> Layer:
    points = np.concatenate(chains)
    ends = np.cumsum([len(chain) for chain in chains])
    first = np.setdiff1d(np.arange(len(points)), ends - 1)
    nothing = np.zeros((0, 3), np.int64)
    lines = np.stack([first, first + 1], axis=1)
    return Layer(
        points, nothing, nothing.astype(np.uint8), lines, line_colour=colour, line_width=WIDTH
    )


def _cross(feature: Feature, size: float) -> np.ndarray:
    """A chain of points that draws a cross of three lines at a lost point."""
    arms = CROSS * size * np.array([[1, 0, 0], [-1, 0, 0], [0, 0, 0]])
    return np.array(feature.place) + np.concatenate([np.roll(arms, k, axis=1) for k in range(3)])
