"""The checked settings of a run, composed from `conf/infer.yaml`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from polycube.errors import InputError
from polycube.io.cad import Cad
from polycube.pipeline.files import Files
from polycube.surface.clouds.options import Points
from polycube.surface.repair.repair import LEVELS
from polycube.units import AUTO, resolved

PHASES = ("meshing", "spline", "analysis")  # of a run; each needs the preceding ones
Node = Mapping[str, Any]  # a composed group; plugins check the types of their options


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
    seed: int
    seconds: float | None
    strict: bool
    resume: Path | None
    start: str | None
    composed: Node  # complete, as written to config.json

    @classmethod
    def of(cls, composed: Node) -> Settings:
        """Check a composed configuration.

        Raises
        ------
        InputError
            If a setting of the whole run is invalid; plugins check their own options.
        """
        read = _Reader(composed)
        mesh = composed["mesh"]
        return cls(
            mesh=None if mesh in (None, "", "???") else str(mesh),
            hex=str(composed["hex"]) if composed["hex"] else None,
            cad=Cad(**read.node("cad"), units=read.node("analysis").get("units")),
            points=Points(**read.node("points")),
            files=Files(**read.node("files")),
            repair=read.repair(),
            order=read.order(),
            context=read.context(),
            seed=read.integer("seed", 0),
            seconds=read.seconds(),
            strict=read.boolean("strict"),
            resume=Path(str(composed["resume"])) if composed["resume"] else None,
            start=str(composed["from"]) if composed["from"] else None,
            composed=composed,
            **{name: read.node(name) for name in GROUPS},
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


GROUPS = (
    "grid",
    "primitives",
    "structure",
    "context_structure",
    "ranking",
    "meshing",
    "improve",
    "acceptance",
    "policy",
    "spline",
    "analysis",
    "export",
)


@dataclass(frozen=True)
class _Reader:
    """Typed values of a composed configuration."""

    composed: Node

    def node(self, name: str) -> dict[str, Any]:
        value = self.composed.get(name, {})  # there is no group without exports
        if not isinstance(value, Mapping):
            raise InputError(f"{name} must be a group of settings; got {value!r}")
        return dict(value)

    def integer(self, name: str, least: int) -> int:
        value = self.composed[name]
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise InputError(f"{name} must be a whole number, {least} or more; got {value!r}")
        return value

    def boolean(self, name: str) -> bool:
        value = self.composed[name]
        if not isinstance(value, bool):
            raise InputError(f"{name} must be true or false; got {value!r}")
        return value

    def seconds(self) -> float | None:
        value = self.composed["seconds"]
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if value is None:
            return None
        if not is_number or not 0 < value < math.inf:
            raise InputError(f"seconds must be null or a positive number; got {value!r}")
        return float(value)

    def order(self) -> tuple[str, ...]:
        value = self.composed["order"]
        value = [value] if isinstance(value, str) else value
        chain = [name for name in value if name != "report"] if isinstance(value, list) else ["?"]
        if chain != list(PHASES[: len(chain)]):
            raise InputError(
                f"order must be a list of the first of [{', '.join(PHASES)}], and report for the "
                f"page; got {value}"
            )
        last = next((i for i, phase in enumerate(chain) if self.is_none(phase)), len(chain))
        return tuple(phase for phase in value if phase not in chain[last:])

    def is_none(self, phase: str) -> bool:
        """Whether a phase is switched off, as by `spline=none`."""
        return self.node(phase).get("plugin", phase) is None

    def context(self) -> Sequence[str | None] | None:
        value = self.composed["context"]
        if value is not None and not isinstance(value, list | tuple):
            raise InputError(f"context must be a list of primitives, such as [cube]; got {value!r}")
        return value or None

    def repair(self) -> str:
        value = self.composed["repair"] or LEVELS[0]  # YAML may read off as false
        if value not in LEVELS:
            raise InputError(f"repair must be {', '.join(LEVELS)}; got {value!r}")
        if self.composed["hex"] and value != LEVELS[0]:
            raise InputError(
                "repair works on the surface of mesh=, it cannot be combined with hex="
            )
        return str(value)
