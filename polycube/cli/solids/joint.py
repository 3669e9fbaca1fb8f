"""Hexes of solids that touch, with common quads, for the runs of these solids."""

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from polycube.assembly.joint_mesh import joint_meshes
from polycube.errors import InputError, MeshingError, printable
from polycube.io import manifest
from polycube.io.removal.options import Remove
from polycube.io.solids.listing import Solid
from polycube.io.solids.touching import touching
from polycube.io.vtk import write_hex_vtu
from polycube.kinds import Structure
from polycube.pipeline.primitives import voxels
from polycube.pipeline.settings import Settings
from polycube.registry import build
from polycube.types import Json, Tier

FOLDER = "joint"
ALONE = ("at", "regions")  # options of meshing that refer to a solid alone


def write_joint_meshes(
    cfg: Json, solids: Sequence[Solid], folder: Path
) -> tuple[list[dict[int, Path]], list[str]]:
    """Mesh solids that touch together.

    Returns files with the hexes of the solids of each such group, by their number; and reasons why
    others are meshed one by one, with ties.

    cfg : settings of one of the solids
    """
    settings = Settings.of(cfg)
    if any(cfg["meshing"].get(name) for name in ALONE) or settings.cad.remove != Remove():
        why = "meshing.at, meshing.regions and cad.remove are for solids that are meshed one by one"
        return [], [why]
    try:
        groups = touching(Path(str(cfg["mesh"])), cfg["cad"]["segments"])
    except InputError as error:
        return [], [f"all solids are meshed one by one, because {error}"]
    found: list[dict[int, Path]] = []
    notes = []
    for surfaces in groups:
        named = ", ".join(solids[number - 1].name for number in surfaces)
        try:
            meshes = joint_meshes([*surfaces.values()], _structures(settings))
        except MeshingError as error:
            notes.append(f"{named} are meshed one by one, because {error}")
            continue
        sys.stderr.write(f"{printable(named)} are meshed together\n")
        with manifest.writing(folder) as scratch:
            (scratch / FOLDER).mkdir(exist_ok=True)
            names = {number: f"{FOLDER}/{solids[number - 1].name}.vtu" for number in surfaces}
            for name, mesh in zip(names.values(), meshes, strict=True):
                write_hex_vtu(scratch / name, mesh)
            found.append({number: folder / name for number, name in names.items()})
    return found, notes


def given(cfg: Json, path: Path) -> dict[str, Any]:
    """The settings of a solid whose hexes are in a file, and are not changed."""
    return {**cfg, "hex": str(path), "improve": {**cfg["improve"], "order": []}}


def _structures(settings: Settings) -> list[Structure]:
    """The structures with exact features among those of the settings."""
    own = settings.structure.get("proposals") or {"": settings.structure}
    shape, primitives = settings.grid["shape"] or (1, 1, 1), voxels(settings.primitives["use"])
    made = partial(build, "structure", grid=shape, primitives=primitives)
    return [each for each in map(made, own.values()) if each.tier == Tier.EXACT]
