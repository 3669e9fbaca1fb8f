"""Descriptions of the material, supports and loads of an analysis, with the size of each place."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from polycube.analysis.boundary_sets import is_edge, quads_of
from polycube.analysis.loads import Load
from polycube.analysis.problem import MATERIALS, Conduction, Material, Prescribed, Problem, Statics
from polycube.hexmesh.face_groups import measure
from polycube.hexmesh.named_sets import set_name
from polycube.registry import build
from polycube.report.numbers.formatting import number
from polycube.types import AXES, HexMesh, Json

AXIS = "xyz"


def problem_of(config: Json) -> Problem | None:
    """The problem of the analysis in the settings; None if it does not describe one."""
    chosen = config.get("analysis") or {}
    if chosen.get("plugin") is None:
        return None
    return getattr(build("analysis", chosen), "problem", None)


def numbers(problem: Problem, mesh: HexMesh) -> dict[str, object]:
    """The problem in `report.json`; its keys:

    units : length unit of the part
    material : description of the material; empty for an assembly
    supports, loads : for each place its description `words`, and `quads` and `area` of its faces in
        the mesh; both are null for edges, and for cyclic symmetry, gravity and sources, which
        concern the whole part
    """
    own = getattr(problem, "conductivity" if isinstance(problem, Conduction) else "material", None)
    return {
        "units": problem.units,
        "material": describe_material(own) if own and not problem.materials else "",
        "supports": [{"words": text, **_size(mesh, place)} for place, text in _supports(problem)],
        "loads": [{"words": text, **_size(mesh, place)} for place, text in _loads(problem)],
    }


def _size(mesh: HexMesh, place: object) -> dict[str, object]:
    if place is None or is_edge(place):
        return {"quads": None, "area": None}
    quads = quads_of(mesh, place)
    area = measure(mesh.vertices[mesh.quads[quads]]).area.sum()
    return {"quads": len(quads), "area": float(area)}


def describe_material(found: Material | float) -> str:
    """Name and values of a material, or a conductivity."""
    if not isinstance(found, Material):
        return f"Conductivity {number(found)} W/(m K)"
    name = next((name for name, each in MATERIALS.items() if each == found), "given by its values")
    modulus = f"Young's modulus {number(found.young / 1e9)} GPa"
    others = f"Poisson's ratio {number(found.poisson)}, density {number(found.density)} kg/m³"
    return f"{name.capitalize()}: {modulus}, {others}"


def _supports(problem: Problem) -> Iterator[tuple[object, str]]:
    if cyclic := problem.cyclic_symmetry:
        axis, at = _vector(cyclic.axis), _numbers(cyclic.point)
        yield None, f"The part is one of {cyclic.sectors} equal sectors about {at}, {axis}"
    for each in problem.supports:
        name, is_plural = describe_place(each.place)
        is_heat = isinstance(problem, Conduction)
        held = f"kept at {number(each.values[0])} K" if is_heat else _held(each, problem.units)
        yield each.place, f"{name[0].upper()}{name[1:]} {'are' if is_plural else 'is'} {held}"


def _held(support: Prescribed, unit: str) -> str:
    """What happens to the components of the displacement."""
    values = dict(zip(support.components, support.values, strict=True))
    held = [AXIS[axis] for axis, value in values.items() if value == 0]
    moved = [f"{number(value)} {unit} in {AXIS[axis]}" for axis, value in values.items() if value]
    if len(held) == len(AXIS):
        return "clamped"
    phrases = [f"moved by {' and '.join(moved)}"] if moved else []
    phrases += [f"held in {' and '.join(held)}"] if held else []
    free = [axis for i, axis in enumerate(AXIS) if i not in values]
    phrases += [f"free in {' and '.join(free)}"] if free else []
    return ", ".join(phrases)


def _loads(problem: Problem) -> Iterator[tuple[object, str]]:
    if isinstance(problem, Statics):
        for each in problem.loads:
            for text in _applied(each):
                yield each.place, text
        if any(problem.acceleration):
            size = number(float(np.linalg.norm(problem.acceleration)))
            yield None, f"Gravity of {size} m/s², {_vector(problem.acceleration)}"
        if problem.rotation:
            axis, at = _vector(problem.rotation.axis), _numbers(problem.rotation.point)
            yield None, f"Rotation of {number(problem.rotation.rpm)} rpm about {at}, {axis}"
        if problem.temperature:
            yield None, f"Temperature {problem.temperature} K above that without stress"
        for preload in problem.preloads:
            at, axis = _numbers(preload.point), _vector(preload.axis)
            yield None, f"Preload of {number(preload.force)} N at {at}, {axis}"
    if isinstance(problem, Conduction):
        for flow in problem.flows:
            into = describe_place(flow.place)[0]
            yield flow.place, f"Flux of {number(flow.flux)} W/m² into {into}"
        if problem.source:
            yield None, f"Heat source of {number(problem.source)} W/m³ in the whole part"


def _applied(load: Load) -> Iterator[str]:
    """A sentence for each force on a place."""
    on = describe_place(load.place)[0]
    if isinstance(load.pressure, str):
        yield f"Pressure of {load.pressure} Pa on {on}"
    elif load.pressure:
        yield f"{'Pressure' if load.pressure > 0 else 'Suction'} of {stress(load.pressure)} on {on}"
    if any(isinstance(each, str) for each in load.traction):
        yield f"Traction of ({', '.join(map(str, load.traction))}) Pa on {on}"
    elif any(load.traction):
        size = stress(float(np.linalg.norm(load.traction)))
        yield f"Traction of {size} on {on}, {_vector(load.traction)}"
    point = "" if load.point is None else f", acting at {_numbers(load.point)}"
    for what, unit, vector, how in (
        ("Force", "N", load.force, point or ", distributed evenly"),
        ("Moment", "N m", load.moment, ""),
        ("Bearing load", "N", load.bearing, ", on the side that resists"),
    ):
        if any(vector):
            size = number(float(np.linalg.norm(vector)))
            yield f"{what} of {size} {unit} on {on}, {_vector(vector)}{how}"


def stress(value: float) -> str:
    """The size of a stress in Pa, kPa or MPa."""
    size = abs(value)
    units = (1e6, "MPa"), (1e3, "kPa")
    factor, unit = next(((f, u) for f, u in units if size >= 0.1 * f), (1, "Pa"))
    return f"{number(size / factor)} {unit}"


def _numbers(values: Sequence[float]) -> str:
    return f"({', '.join(map(number, values))})"


def _vector(value: Sequence[float]) -> str:
    """The direction of a vector: the name of an axis if it is along one, else a unit vector."""
    way = np.array(value) / np.linalg.norm(value)
    axis = int(np.abs(way).argmax())
    if abs(way[axis]) > 1 - 1e-9:
        return f"in direction {AXES[2 * axis + int(way[axis] < 0)]}"
    return f"in direction ({', '.join(f'{x + 0.0:.3g}' for x in way.round(3))})"


def describe_place(place: object) -> tuple[str, bool]:
    """Description of a place on the boundary, and whether it is a plural."""
    if is_edge(place):
        return "the edge between '{}' and '{}'".format(*map(set_name, place["edge"])), False
    if isinstance(place, Mapping):
        [(kind, values)] = place.items()
        found = [number(float(value)) for value in values]
        if kind == "plane":
            normal = " + ".join(f"{n} {axis}" for n, axis in zip(found, AXIS, strict=False))
            return f"the faces on the plane {normal} = {found[3]}", True
        low, high = ", ".join(found[:3]), ", ".join(found[3:])
        return f"the faces in the box from ({low}) to ({high})", True
    return f"face '{set_name(place)}'", False
