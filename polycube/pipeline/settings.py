"""The checked settings of a run, composed from `conf/infer.yaml`; `files.*` are the formats."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Literal

from polycube.errors import InputError
from polycube.io.cad import SUFFIXES, Cad
from polycube.io.removal.options import Remove
from polycube.surface.clouds.options import Points
from polycube.surface.repair.repair import LEVELS
from polycube.types.checks import is_number, is_whole
from polycube.types.options import Options
from polycube.units import AUTO, resolved

PHASES = ("meshing", "spline", "analysis")  # of a run; each needs the preceding ones
Node = Mapping[str, Any]  # a composed group; plugins check the types of their options
GROUPS = ("Cad", "Points", "Files", "Node", "Mapping[str, Node]")  # types of groups
LARGE = 1500  # number of elements from which `auto` selects the smaller files


@dataclass(frozen=True, eq=False)
class Settings:
    """Settings of the whole run, and the composed configuration of every group.

    Names, defaults and help are in `conf/infer.yaml`; `start` is `from` there.
    """

    mesh: str | None
    hex: str | None
    cad: Cad
    points: Points
    files: Files
    repair: str
    order: tuple[str, ...]
    context: Sequence[str | None] | None
    grid: Node
    primitives: Node
    structure: Node
    context_structure: Node
    ranking: Node
    meshing: Node
    improve: Node
    acceptance: Node
    policy: Node
    spline: Node
    analysis: Node
    export: Mapping[str, Node]
    seconds: float | None
    strict: bool
    resume: Path | None
    start: str | None
    composed: Mapping[str, Any]  # complete, as written to config.json

    def __post_init__(self) -> None:
        is_cad = self.mesh is not None and self.mesh.lower().endswith(SUFFIXES)
        if self.cad.remove != Remove() and not is_cad and self.resume is None:
            raise InputError("features are removed from STEP, IGES and BREP files", "cad.remove")

    @classmethod
    def of(cls, composed: Node) -> Settings:
        """Check a composed configuration.

        Raises
        ------
        InputError
            If a setting of the whole run is invalid; plugins check their own options.
        """
        names = [each.name for each in fields(cls) if each.type in GROUPS]
        groups = {name: composed.get(name, {}) for name in names}  # no group without exports
        for name, group in groups.items():
            _check(name, group, isinstance(group, Mapping), "a group of settings")
        seed, seconds, context = composed["seed"], composed["seconds"], composed["context"]
        is_list = context is None or isinstance(context, list | tuple)
        _check("context", context, is_list, "a list of primitives, such as [cube]")
        _check("seed", seed, is_whole(seed, 0), "a whole number, 0 or more")
        is_time = is_number(seconds) and 0 < seconds < math.inf
        _check("seconds", seconds, seconds is None or is_time, "null or a positive number")
        for name in ("strict", "quiet", "verbose"):
            _check(name, composed[name], isinstance(composed[name], bool), "true or false")
        repair = composed["repair"] or LEVELS[0]  # YAML may read off as false
        _check("repair", repair, repair in LEVELS, ", ".join(LEVELS))
        mesh, hexes, resume, start = (
            str(composed[name]) if composed[name] else None
            for name in ("mesh", "hex", "resume", "from")
        )
        if hexes and repair != LEVELS[0]:
            what = "repair works on the surface of mesh=, it cannot be combined with hex="
            raise InputError(what)
        groups |= {
            "cad": Cad(**groups["cad"], units=groups["analysis"].get("units")),
            "points": Points(**groups["points"]),
            "files": Files(**groups["files"]),
        }
        return cls(
            mesh=None if mesh == "???" else mesh,
            hex=hexes,
            repair=repair,
            order=_order(composed),
            context=context or None,
            seconds=seconds,
            strict=composed["strict"],
            resume=Path(resume) if resume else None,
            start=start,
            composed=composed,
            **groups,
        )

    def unit(self, of_file: str) -> str:
        """Length unit of the results; empty if neither analysis nor file has one."""
        given = self.analysis.get("units")
        return resolved(given, of_file) if given else of_file

    def in_unit(self, of_file: str) -> Settings:
        """The settings with the unit of the file in place of `analysis.units=auto`."""
        if self.analysis.get("units") != AUTO or not of_file:
            return self
        analysis = {**self.analysis, "units": of_file}
        return replace(self, analysis=analysis, composed={**self.composed, "analysis": analysis})


def _check(name: str, value: object, is_valid: bool, what: str) -> None:
    if not is_valid:
        raise InputError(f"{name} must be {what}; got {value!r}")


def _order(composed: Node) -> tuple[str, ...]:
    """The phases of the run, without those that are switched off, as by `spline=none`."""
    value = composed["order"]
    value = [value] if isinstance(value, str) else value
    chain = [name for name in value if name != "report"] if isinstance(value, list) else ["?"]
    if chain != list(PHASES[: len(chain)]):
        raise InputError(
            f"order must be a list of the first of [{', '.join(PHASES)}], and report for the "
            f"page; got {value}"
        )
    off = [name for name in chain if composed.get(name, {}).get("plugin", name) is None]
    left_out = chain[chain.index(off[0]) :] if off else []
    return tuple(phase for phase in value if phase not in left_out)


@dataclass(frozen=True)
class Files(Options):
    """Contents of the files of the spline and the solution."""

    group = "files."
    bext: Literal["auto", 1, 2, "both"] = "auto"  # versions of BEXT
    cells: Literal["auto", "lagrange", "corners"] = "auto"  # cells in the files of the solution
    precision: Literal["single", "double"] = "single"  # precision of the fields in these files

    def bext_versions(self, elements: int) -> tuple[int, ...]:
        """Versions of BEXT in which a spline with a number of elements is written, ascending."""
        if self.bext == "auto":
            return (2,) if elements > LARGE else (1, 2)
        return (1, 2) if self.bext == "both" else (int(self.bext),)

    def has_curved_cells(self, elements: int) -> bool:
        """Whether the files of a solution have curved cells, or hexahedra of eight nodes."""
        return self.cells == "lagrange" or (self.cells == "auto" and elements <= LARGE)
