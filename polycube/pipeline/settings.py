"""The checked settings of a run, composed from `conf/infer.yaml`; `files.*` are the formats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from polycube.errors import InputError
from polycube.io.cad import SUFFIXES, Cad
from polycube.io.removal.options import Remove
from polycube.surface.clouds.options import Points
from polycube.types import Json
from polycube.types.checks import options_of
from polycube.types.options import Options, Positive, check_options, limits
from polycube.units import AUTO

PHASES = ("meshing", "spline", "analysis")  # of a run; each needs the preceding ones
LARGE = 1500  # number of elements from which `auto` selects the smaller files


@dataclass(frozen=True, eq=False)
class Settings(Options):
    """Settings of the whole run, and the composed configuration of every group.

    Names, defaults and help are in `conf/infer.yaml`; `start` is `from` there.
    """

    mesh: str | None
    hex: str | None
    cad: Cad
    points: Points
    files: Files
    repair: Literal["off", "safe", "aggressive"]
    order: tuple[str, ...]
    context: Sequence[str | None] | None
    # the composed groups; plugins check the types of their options
    grid: Json
    primitives: Json
    structure: Json
    context_structure: Json
    ranking: Json
    meshing: Json
    improve: Json
    acceptance: Json
    policy: Json
    spline: Json
    analysis: Json
    export: Mapping[str, Json]
    seed: Annotated[int, limits(0)]
    seconds: Positive | None
    strict: bool
    quiet: bool
    verbose: bool
    resume: Path | None
    start: str | None
    composed: Mapping[str, Any]  # complete, as written to config.json

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.hex and self.repair != "off":
            what = "repair works on the surface of mesh=, it cannot be combined with hex="
            raise InputError(what)
        is_cad = self.mesh is not None and self.mesh.lower().endswith(SUFFIXES)
        if self.cad.remove != Remove() and not is_cad and self.resume is None:
            raise InputError("features are removed from STEP, IGES and BREP files", "cad.remove")

    @classmethod
    def of(cls, composed: Json) -> Settings:
        """Check a composed configuration.

        Raises InputError if a setting of the whole run is invalid; plugins check their own options.
        """
        values = {each.name: composed.get(each.name, {}) for each in fields(cls)}
        values |= {"start": composed["from"], "composed": composed}
        values["repair"] = composed["repair"] or "off"  # YAML may read off as false
        for name in ("mesh", "hex", "resume", "start"):
            is_given = values[name] and values[name] != "???"
            values[name] = str(values[name]) if is_given else None
        check_options(cls, values)
        values["resume"] = values["resume"] and Path(values["resume"])
        for name, kind in {"cad": Cad, "points": Points, "files": Files}.items():
            values[name] = options_of(name, kind, values[name])
        values["cad"] = replace(values["cad"], units=composed["analysis"].get("units"))
        return cls(**{**values, "order": _order(composed)})

    def in_unit(self, of_file: str) -> Settings:
        """The settings with the unit of the file in place of `analysis.units=auto`."""
        if self.analysis.get("units") != AUTO or not of_file:
            return self
        analysis = {**self.analysis, "units": of_file}
        return replace(self, analysis=analysis, composed={**self.composed, "analysis": analysis})


def _order(composed: Json) -> tuple[str, ...]:
    """The phases of the run, without those that are switched off, as by `spline=none`."""
    value = composed["order"]
    value = [value] if isinstance(value, str) else value
    chain = [name for name in value if name != "report"] if isinstance(value, list) else ["?"]
    if chain != list(PHASES[: len(chain)]):
        first = f"the first of [{', '.join(PHASES)}], and report for the page"
        raise InputError(f"order must be a list of {first}; got {value}")
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
