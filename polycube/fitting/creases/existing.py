"""Paths of the curves of a surface that a mesh has already, before it is fitted."""

import numpy as np

from polycube.fitting.creases.paths import find_routes
from polycube.fitting.problem import FitProblem
from polycube.surface.fit_target import Target
from polycube.types import HexMesh

ON = 0.02  # of the local edge length: distance of the vertices of such a path from its curve


def existing_paths(mesh: HexMesh, target: Target) -> dict[str, np.ndarray]:
    """Vertices on each curve whose path is on edges of the mesh, by its number in `followed`.

    Later searches for paths reuse them if they are the `paths` of the mesh.
    """
    problem, x = FitProblem(mesh, target, samples=1), target.to_unit(mesh.vertices)
    size, creases = problem.size(x), target.followed.creases
    number = {id(crease): str(k) for k, crease in enumerate(creases)}
    found = find_routes(target.followed, problem, x, ON)[0] if creases else []
    return {
        number[id(route.crease)]: route.vertices
        for route in found
        if (route.crease.nearest(x[route.vertices])[1] < ON * size[route.vertices]).all()
    }
