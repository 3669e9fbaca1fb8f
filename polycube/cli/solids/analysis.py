"""The analysis of all solids together, if their meshes share vertices at every contact."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from polycube.analysis.boundary_sets import check_names, is_edge, quads_of
from polycube.analysis.preconditioner import is_factored
from polycube.analysis.problem import Material, Problem
from polycube.assembly.spline import united
from polycube.cli.solids.settings import is_analysed, states_assemblies
from polycube.errors import InputError, MeshingError
from polycube.hexmesh.connectivity import quad_edges
from polycube.io import bezier
from polycube.io.solids.listing import Solid
from polycube.kinds import Export
from polycube.numerics import memory
from polycube.pipeline.settings import Files
from polycube.registry import build, provide
from polycube.report.numbers import solutions
from polycube.report.numbers.problem import numbers
from polycube.report.pictures.fields import makers
from polycube.report.pictures.loads import supports_and_loads
from polycube.report.pictures.pictures import draw
from polycube.stages import Clock
from polycube.surface.measures import connected
from polycube.types import HexMesh, Json, Solution, Spline, TriMesh

Part = tuple[TriMesh | None, HexMesh]  # surface and mesh of a solid
SHARED, TIED = "shared vertices", "tie"  # how meshes are joined at a contact


class Solved(NamedTuple):
    """The spline of all solids, the solution on it, and pictures; empty without an analysis."""

    spline: Spline | None = None
    solution: Solution | None = None
    pictures: Mapping[str, bytes] = {}

    def write(self, folder: Path, files: Json) -> None:
        """Write the files of the solution, with the options `files`."""
        if self.spline is not None and self.solution is not None:
            options = Files(**files)
            how = options.has_curved_cells(len(self.spline.nodes)), options.precision
            bezier.write_solution(folder, self.spline, self.solution, *how)


def analysed(
    cfg: Json,
    solids: Sequence[Solid],
    problem: Problem,
    exports: Sequence[Export],
    parts: Mapping[int, Part],
    mesh: HexMesh,
    report: dict[str, Any],
) -> Solved:
    """Solve a problem of all solids if possible, and add its numbers to the report.

    parts : surface and mesh by the number of the solid, from 0.  mesh : of all solids

    Raises InputError if places or supports are wrong, or if solids with supports or loads cannot be
    analysed together and no deck states the problem.
    """
    solves, has_deck = is_analysed(cfg, solids), any(map(states_assemblies, exports))
    if not report["valid"] or not (solves or has_deck):
        return Solved()
    check_names(problem.places, mesh.sets)
    report["problem"] = numbers(problem, mesh)
    if not solves:
        return Solved()
    clock, given, solid = Clock(), problem.materials, mesh.cell
    try:
        _check(problem, report["contacts"], mesh)
        spline = clock.run("spline", partial(_spline, cfg["spline"], problem, parts, mesh))
        memory.warn(len(spline.control), is_factored(spline))
        is_elastic = isinstance(given[0], Material)
        each = Material.of_elements(given, solid) if is_elastic else np.array(given)[solid]
        plugin = build("analysis", {**cfg["analysis"], "units": problem.units})
        solution = clock.run("analysis", partial(provide(plugin, of_elements=each), spline))
    except InputError as error:
        if problem.places and not has_deck:
            raise
        report["not_analysed"] = str(error)
        return Solved()
    except MeshingError as error:
        report |= {"valid": False, "failure": f"the solids were not analysed together: {error}"}
        return Solved()
    report["seconds"] |= {f"{name} of all": spent for name, spent in clock.seconds.items()}
    report["spline"] = {"functions": len(spline.control), "elements": len(spline.nodes)}
    report |= solutions.numbers(spline, solution)
    scenes = {name: make() for name, make in makers(spline, solution).items()}
    scenes["problem"] = supports_and_loads(mesh, problem)
    return Solved(spline, solution, draw(scenes))


def _check(problem: Problem, contacts: Sequence[Json], mesh: HexMesh) -> None:
    """Raise InputError unless shared vertices join all solids."""
    part = connected(mesh.hexes[:, :-1].ravel(), mesh.hexes[:, 1:].ravel(), len(mesh.vertices))
    apart = mesh.cell[part[mesh.hexes[:, 0]] != part[mesh.hexes[0, 0]]]
    what = "cyclic symmetry is for one solid" if problem.cyclic_symmetry else ""
    if len(apart):
        what = f"{mesh.primitives[apart[0]]} is not joined to {mesh.primitives[mesh.cell[0]]}"
    for each in contacts:
        if each["joined"] != SHARED:
            (a, b), (f, g) = each["solids"], each["faces"]
            what = f"the meshes of {a} and {b} share no vertices where {a}_{f} touches {b}_{g}"
    if what:
        raise InputError(what, "analysis", "a deck of export=[abaqus] can have ties")


def _spline(options: Json, problem: Problem, parts: Mapping[int, Part], mesh: HexMesh) -> Spline:
    """The spline of all solids, if possible with sharp borders of the supports."""
    plugin = build("spline", {**options, "held": []})

    def make(solid: int, own: HexMesh, *edges: np.ndarray) -> Spline:
        return provide(plugin, joined=edges)(parts[solid][0], own)

    places = [each.place for each in problem.supports if not is_edge(each.place)]
    held = [quad_edges(mesh.quads[quads_of(mesh, place)], is_closed=False) for place in places]
    borders = [edges[sides[:, 0] == sides[:, 1]] for edges, sides in held]
    return united({k: own for k, (_, own) in parts.items()}, mesh, make, borders)
