"""The settings of the run of each solid, and the problem of all solids together.

An analysis with supports or loads is that of the assembly: the solids are analysed together, and a
deck states it; they are not analysed one by one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from polycube.analysis.boundary_sets import names_in
from polycube.analysis.problem import Material, Problem, Statics
from polycube.errors import InputError
from polycube.hexmesh.face_groups import ENDS
from polycube.io.cad import CONTACT, Cad
from polycube.io.solids.listing import Solid
from polycube.kinds import Export
from polycube.pipeline.settings import Settings
from polycube.registry import build
from polycube.report.numbers.problem import describe_material, problem_of
from polycube.types import Json
from polycube.units import METRES


def of_solid(cfg: Json, number: int | None) -> dict[str, Any]:
    """The settings for one solid, which do not depend on how it is joined to others."""
    alone = {"solid": number, "interfaces": Cad.interfaces, "friction": Cad.friction}
    return {**cfg, "cad": {**cfg["cad"], **alone}}


def of_runs(cfg: Json, solids: Sequence[Solid]) -> list[dict[str, Any]]:
    """The settings of the run of each solid.

    Raises InputError for the name of an unknown one, and for contact without a deck of statics.
    """
    settings = _with_materials(cfg, solids)
    problem = problem_of_all(cfg, solids)
    if cfg["cad"]["interfaces"] == CONTACT:
        exports = [build("export", config) for config in cfg.get("export", {}).values()]
        has_decks = bool(exports) and all(map(states_assemblies, exports))
        if not has_decks or not isinstance(problem, Statics) or is_analysed(cfg, solids):
            what = "contact is only written to decks of statics for Abaqus and CalculiX"
            remedy = "use order=[meshing] analysis=static export=[abaqus]"
            raise InputError(what, f"cad.interfaces={CONTACT}", remedy)
    if problem is None or not problem.places:
        return settings
    starts = tuple(f"{solid.name}_" for solid in solids)
    for name in names_in(problem.places):
        if name not in ENDS and not str(name).startswith(starts):
            what = f"{name!r} is no place of an assembly; {_listed(solids)}"
            remedy = f"write {starts[0]}z_max for the set of a solid, z_max for the end of all"
            raise InputError(what, "analysis", remedy)
    if is_analysed(cfg, solids):
        return [unsolved(own) for own in settings]
    held = cfg["spline"].get("held")
    is_default = held and held == cfg["analysis"].get("fixed")
    spline = {**cfg["spline"], "held": []} if is_default else cfg["spline"]
    return [{**unsolved(own), "spline": spline} for own in settings]


def is_analysed(cfg: Json, solids: Sequence[Solid]) -> bool:
    """Whether the run has an analysis, not only a deck that states one."""
    return "analysis" in Settings.of(_with_materials(cfg, solids)[0]).order


def problem_of_all(cfg: Json, solids: Sequence[Solid], unit: str = "") -> Problem | None:
    """The problem of all solids together, with the material of each; None if there is none.

    unit : length unit of the file
    """
    settings = (Settings.of(own).in_unit(unit) for own in _with_materials(cfg, solids))
    each = [problem_of(own.composed) for own in settings]
    found = (getattr(own, "material", getattr(own, "conductivity", None)) for own in each)
    return each[0] and replace(each[0], materials=tuple(found))


def materials(problem: Problem, solids: Sequence[Solid]) -> list[dict[str, Any]]:
    """Description of the material, and the mass in kg if it is elastic, of each solid."""
    volumes = [solid.volume * METRES[problem.units] ** 3 for solid in solids]
    own = zip(problem.materials, volumes, strict=False)
    masses = [(m, m.density * v if isinstance(m, Material) else None) for m, v in own]
    return [{"material": describe_material(m), "mass": mass} for m, mass in masses]


def states_assemblies(export: Export) -> bool:
    """Whether a file of this format can state a problem of several solids."""
    return bool(getattr(export, "states_assemblies", False))


def unsolved(cfg: Json) -> dict[str, Any]:
    """The settings of a solid that is analysed with others, on a spline of all."""
    own = cfg["analysis"]
    kept = {name: own[name] for name in ("units", "material") if name in own}
    return {**cfg, "analysis": {"plugin": None, **kept}, "spline": {"plugin": None}}


def _with_materials(cfg: Json, solids: Sequence[Solid]) -> list[dict[str, Any]]:
    """The settings of each solid with its material."""
    given, alike = cfg["cad"]["materials"], {**cfg, "cad": {**cfg["cad"], "materials": None}}
    settings = [of_solid(alike, solid.number) for solid in solids]
    if given is not None and not isinstance(given, Mapping):
        what = f"materials by solid are {{SOLID: material}}; got {given!r}"
        raise InputError(what, "cad.materials", f"write cad.materials={{{solids[0].name}: steel}}")
    name = "conductivity" if "conductivity" in cfg["analysis"] else "material"
    if given and name not in cfg["analysis"]:
        what = "cad.materials is for an analysis of elastic solids, or has conductivities"
        raise InputError(what, "cad.materials", "use analysis=modal, static or poisson")
    for key, material in (given or {}).items():
        own = _numbers(str(key), solids)
        if not own:
            raise InputError(f"there is no solid {key}", "cad.materials", _listed(solids))
        for k in own:
            settings[k]["analysis"] = {**cfg["analysis"], name: material}
    return settings


def _numbers(given: str, solids: Sequence[Solid]) -> list[int]:
    """Numbers from 0 of the solids with a name or number, or with a name that several have."""
    called = ((s.name, str(s.number), s.name.removesuffix(f"_{s.number}")) for s in solids)
    ways = zip(*called, strict=True)
    found = ([k for k, name in enumerate(way) if name == given] for way in ways)
    return next(filter(None, found), [])


def _listed(solids: Sequence[Solid]) -> str:
    return f"the solids are {', '.join(f'{s.number} {s.name}' for s in solids)}"
