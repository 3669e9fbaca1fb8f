"""`python -m polycube.make_pairs`: write a file of training pairs for each part.

A part is meshed on a coarse polycube, by the meshing stages of a run with few slabs per axis.

Exit codes: 0 if at least one part gave pairs, 2 if none did or an option is invalid, 130
interrupted.
"""

import csv
import json
import logging
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import Any

from polycube.cli.command import command, files_of
from polycube.cli.signals import INTERRUPTED, terminable
from polycube.cli.terminal import logging_to
from polycube.config import compose
from polycube.diffusion.pairs.lattices import MOST_SLABS
from polycube.diffusion.pairs.meshed_parts import meshed_part, tilted
from polycube.diffusion.pairs.part_files import SUFFIX, write_part
from polycube.errors import InputError, MeshingError
from polycube.io import manifest
from polycube.pipeline.intake import read_part
from polycube.pipeline.run import Run
from polycube.pipeline.settings import Settings
from polycube.search.structures import choose
from polycube.state import RunState
from polycube.structure.lattice import collapse
from polycube.types import Json

TABLE = "summary.csv"
COLUMNS = ("part", "result", "says", "genus", "slabs", "tilted_percent", "seconds", "path")
MADE, NONE = "pairs", "no pairs"  # results

Row = dict[str, Any]
COARSE = ("structure=coarse", "order=[meshing]")
NAMES = {"size": "meshing.size"} | {n: n for n in ("effort", "seconds", "repair", "seed")}


def make_pairs(cfg: Json, folder: Path | None = None) -> list[Row]:
    """Mesh all parts, write those with a coarse polycube, and return the rows of the summary.

    folder : folder of the files; default: `output_dir`

    Raises InputError for an invalid option, if a file would be overwritten, and if no part gave
    pairs.
    """
    folder = folder or Path(str(cfg["output_dir"]))
    parts = _files(cfg["parts"])
    check_settings(cfg)
    manifest.check(folder, [TABLE, *(f"{path.stem}{SUFFIX}" for path in parts)], parts)
    manifest.remove(folder, [f"{path.stem}{SUFFIX}" for path in parts], parts)
    rows: list[Row] = []
    with terminable() as interrupt:
        for path in parts:
            rows.append(_row(path, cfg, folder, interrupt))
            sys.stderr.write(f"{_line(rows[-1])}\n")
            _write_table(rows, folder)
    made = sum(row["result"] == MADE for row in rows)
    sys.stderr.write(f"{made} of {len(rows)} parts gave pairs: {folder / TABLE}\n")
    if not made:
        raise InputError("no part gave pairs", str(folder / TABLE), "the table gives the reasons")
    return rows


def main() -> None:
    """Command line."""
    try:
        command("make_pairs", lambda cfg, _: make_pairs(cfg))
    except KeyboardInterrupt:
        sys.stderr.write("interrupted; the pairs of completed parts are saved\n")
        sys.exit(INTERRUPTED)


def _row(path: Path, cfg: Json, folder: Path, interrupt: Event) -> Row:
    """Mesh one part and write its file; the row describes the result."""
    row: Row = {"part": path.stem, "result": NONE, "path": str(path)}
    began = time.perf_counter()
    try:
        with logging_to(logging.CRITICAL):
            state = mesh_coarsely(str(path), cfg, interrupt)
        assert state.hexes is not None and state.polycube is not None  # of a valid mesh
        part = meshed_part(state.hexes, state.polycube)
        with manifest.writing(folder) as scratch:
            write_part(scratch / f"{path.stem}{SUFFIX}", part)
        row |= {"result": MADE, "genus": part.genus}
        row["slabs"] = "x".join(map(str, part.polycube.occupancy.shape))
        row["tilted_percent"] = round(100 * tilted(part), 2)
    except Exception as error:  # an error in the program must not end the other parts
        is_expected = isinstance(error, InputError | MeshingError | ValueError)
        kind = "" if is_expected else f"{type(error).__name__}: "
        row["says"] = " ".join(f"{kind}{error}".split())
    return row | {"seconds": round(time.perf_counter() - began, 1)}


def _line(row: Row) -> str:
    """A row for the terminal."""
    if row["result"] == NONE:
        return f"{row['part']}: {NONE}: {row['says']}"
    return f"{row['part']}: {MADE}, genus {row['genus']}, {row['slabs']} slabs, {row['seconds']} s"


def _write_table(rows: Sequence[Row], folder: Path) -> None:
    with (
        manifest.writing(folder) as scratch,
        (scratch / TABLE).open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)


def _files(patterns: object) -> list[Path]:
    """Files of the patterns; raises InputError if there are none, or two with the same name."""
    if not isinstance(patterns, list) or not patterns:
        raise InputError("no parts given", "parts", 'use "parts=[cad/*.step,scans/*.stl]"')
    found = files_of(patterns)
    name, count = Counter(path.stem for path in found).most_common(1)[0]
    if count > 1:
        raise InputError(f"{count} parts have the name {name}", "parts", "rename them")
    return found


def mesh_coarsely(path: str, cfg: Json, interrupt: Event | None = None) -> RunState:
    """The last state of a run that ended with a valid mesh.

    path : path of the part
    cfg : size, effort, seconds, repair and seed, as in a run

    Raises
    ------
    InputError
        If the part is invalid, or if it has no structure with few slabs.
    MeshingError
        If no mesh is valid.
    KeyboardInterrupt
        If the user ended the run.
    """
    settings = replace(_settings(cfg), mesh=path)
    run = Run(settings, read_part, interrupt)
    state = run.begin()
    ranked = [
        entry
        for entry in state.ranked
        if max(collapse(entry.candidate.polycube).occupancy.shape) <= MOST_SLABS
    ]
    if not ranked:
        raise InputError(
            f"all structures found have more than {MOST_SLABS} slabs along an axis, which is more "
            "than the network can describe"
        )
    state = run.mesh(choose(replace(state, ranked=ranked), 0, run.primitives))
    if state.interrupted:
        raise KeyboardInterrupt
    if state.failure is not None:
        raise MeshingError(state.failure)
    return state


def check_settings(cfg: Json) -> None:
    """Raise InputError for an invalid setting."""
    Run(_settings(cfg), read_part)


def _settings(cfg: Json) -> Settings:
    options = [f"{NAMES[name]}={json.dumps(cfg[name])}" for name in NAMES]
    return Settings.of(compose("infer", [*COARSE, *options]))
