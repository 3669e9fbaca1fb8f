"""The surface of a run: read, repaired where that is asked for, or only looked at."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

from polycube.errors import InputError
from polycube.io.cad import Cad
from polycube.io.preflight import preflight
from polycube.io.stl import write_stl
from polycube.io.surfaces import read_repaired
from polycube.io.vtk import write_named_vtp
from polycube.pipeline.stages import State, load_stage, save_stage
from polycube.surface.repair.repair import LEVELS
from polycube.types import TriMesh

REPAIR = "repair"  # the key of the state, the stage file and `report.json`

Reading = tuple[TriMesh, list[str], dict[str, object] | None]  # surface, warnings, repair


def check_intake(cfg: Mapping[str, object]) -> None:
    """Raise InputError for a `repair` or `preflight` that makes no sense."""
    level, wish = level_of(cfg), cfg["preflight"]
    if level not in LEVELS:
        raise InputError(f"repair must be {', '.join(LEVELS)}; got {level!r}")
    if cfg["hex"] and (level != LEVELS[0] or wish is not False):
        raise InputError("repair and preflight are for the surface of mesh=, not beside hex=")
    if not isinstance(wish, bool) and not str(wish).lower().endswith(".vtp"):
        raise InputError(f"preflight must be true, false or the name of a .vtp file; got {wish!r}")


def level_of(cfg: Mapping[str, object]) -> str:
    """The level of repair asked for."""
    return cfg["repair"] or LEVELS[0]  # YAML may read off as false


def read_part(cfg: Mapping[str, object], cad: Cad) -> Reading:
    """The surface of `mesh`; raises InputError."""
    surface, warnings, repair = read_repaired(str(cfg["mesh"]), cad, level_of(cfg))
    return surface, warnings, repair and repair.numbers()


def kept_repair(folder: Path) -> State:
    """What an earlier run repaired; empty where it did not."""
    try:
        return {REPAIR: load_stage(folder, REPAIR)}
    except InputError:
        return {}


def keep_repair(folder: Path, state: State) -> None:
    """Write the repaired surface, and what was changed for runs that resume."""
    if REPAIR in state:
        save_stage(folder, REPAIR, state[REPAIR])
        surface = state["surface"]
        write_stl(folder / "repaired.stl", surface.vertices, surface.faces)
        write_named_vtp(
            folder / "repaired.vtp", surface.vertices, {"surface": surface.faces}, "part"
        )


def check(cfg: Mapping[str, object]) -> tuple[int, str]:
    """Print what is wrong with the surface: exit code 0 where it is usable, else 2, and why.

    The places are written only where `preflight` is the name of a file.
    """
    check_intake(cfg)
    cad = Cad(**cfg["cad"], units=cfg["analysis"].get("units"))
    found = preflight(str(cfg["mesh"]), cad, level_of(cfg))
    sys.stdout.write(f"{found.table()}\n")
    if not isinstance(cfg["preflight"], bool):
        sys.stdout.write(f"places: {found.write(Path(cfg['preflight']))}\n")
    if not found.is_usable:
        return 2, found.verdict
    sys.stdout.write(f"{found.verdict}\n")
    return 0, ""
