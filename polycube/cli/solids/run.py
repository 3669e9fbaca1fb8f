"""Run every solid of a CAD file as a job of a batch; combine the results in one mesh and page.

The jobs run in sequence. Solids that touch are meshed together first, if they have a common
structure; their jobs take these hexes. Of other identical solids, one is meshed: the jobs of the
others move its mesh.
"""

import sys
from collections import Counter
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from polycube.cli.batch import ROW, Attempt, run_job
from polycube.cli.signals import INTERRUPTED
from polycube.cli.solids.joint import given, write_joint_meshes
from polycube.cli.solids.result import MADE, PAGE, write_assembly
from polycube.cli.solids.settings import is_analysed, of_runs, unsolved
from polycube.errors import InputError, printable
from polycube.io import manifest
from polycube.io.access.lock import locked
from polycube.io.access.reading import read_json
from polycube.io.cad import CONFORM, CONTACT, Cad
from polycube.io.solids.listing import Solid, read_solids
from polycube.io.solids.motions import Motion
from polycube.io.surfaces import is_cad
from polycube.pipeline.improvement import is_meshed
from polycube.registry import build
from polycube.report.numbers.formatting import cautions, sentences
from polycube.types import Json

ALL = "all"  # value of `cad.solid`
ALONE = {"resume": "resume the run of one solid, in its own folder", "hex": "hex= is for one solid"}

Placed = tuple[Path, Motion]  # folder of the run of an identical solid, and its motion to this one


def solids_of(cfg: Json) -> list[Solid]:
    """The solids to mesh separately; empty if the file has only one.

    Raises InputError if the file cannot be read, or if a setting is for a single solid.
    """
    for name, remedy in ALONE.items():
        if cfg[name]:
            what = f"cad.solid={ALL} cannot be combined with {name}="
            raise InputError(what, "cad.solid", remedy)
    if Cad(**{**cfg["cad"], "solid": None, "materials": None}).remove.faces:
        what = f"cad.remove.faces are faces of one solid, which cad.solid={ALL} does not choose"
        raise InputError(what, "cad.remove.faces", "remove them with the number of the solid")
    path = Path(str(cfg["mesh"]))
    solids = read_solids(path) if is_cad(path) else []
    if len(solids) > 1:
        return solids
    why = "contains one solid" if solids else "is not a CAD file"
    sys.stderr.write(f"{printable(str(path))} {why}: it is meshed without cad.solid={ALL}\n")
    return []


def check_solids(cfg: Json, solids: Sequence[Solid], attempt: Attempt) -> tuple[int, str]:
    """Check every solid without a run: the largest exit code, and the first reason.

    Raises InputError if the places are to be written to a file, which would contain those of one
    solid, or by `of_runs`.
    """
    if cfg["preflight"] is not True:
        what = f"a file of the places is for one solid, not for cad.solid={ALL}"
        remedy = "use preflight=true, or cad.solid with the number of one"
        raise InputError(what, "preflight", remedy)
    found = []
    for solid, own in zip(solids, of_runs(cfg, solids), strict=True):
        if solid.motion is None:
            sys.stdout.write(f"cad.solid={solid.number}, {solid.name}\n")
            code, why = attempt(own)
            found.append((code, f"{solid.name}: {why}"))
        else:
            sys.stdout.write(f"cad.solid={solid.number}, {solid.name}, is {solid.same_as} moved\n")
    worst, why = max(found, key=lambda each: each[0])
    return worst, why if worst else ""


def run_solids(
    cfg: Json, solids: Sequence[Solid], folder: Path, attempt: Attempt
) -> tuple[int, str]:
    """Mesh every solid in its own folder, then write the combined results.

    Returns the largest exit code of the solids, and the reason if it is not 0; 3 if their meshes
    are valid but cannot be joined. Raises InputError before any work, if nothing can be written, or
    by `of_runs`, and KeyboardInterrupt if a signal ended the run of a solid; the results of
    completed ones are saved.

    attempt : does the run of one solid
    """
    exports = [build("export", config) for config in cfg.get("export", {}).values()]
    settings = of_runs(cfg, solids)
    manifest.check(folder, [*PAGE, *(f"hex{export.suffix}" for export in exports)])
    # regions have a position, which differs for identical solids
    shared = not cfg["meshing"].get("regions")
    names = {solid.number: solid.name for solid in solids}
    codes: dict[int, int] = {}
    with locked(folder):
        is_joint = cfg["cad"]["interfaces"] in (CONFORM, CONTACT) and "meshing" in cfg["order"]
        groups, notes = write_joint_meshes(settings[0], solids, folder) if is_joint else ([], [])
        meshes = {number: path for group in groups for number, path in group.items()}
        if [len(group) for group in groups] == [len(solids)] and is_analysed(cfg, solids):
            settings = [unsolved(own) for own in settings]
        for solid, own in zip(solids, settings, strict=True):
            job = attempt
            if solid.number in meshes:
                own = given(own, meshes[solid.number])
            elif shared and solid.motion is not None and solid.same_as not in meshes:
                source = folder / names[solid.same_as], solid.motion
                job = partial(_placed, attempt, source, cfg["meshing"]["order"])
            setting = f"cad.solid={solid.number}"
            codes[solid.number] = code = run_job(own, folder / solid.name, setting, job)
            if code == INTERRUPTED:
                raise KeyboardInterrupt
        report = write_assembly(folder, cfg, solids, codes, exports, notes)
    for line in (f"{summary(report)}: {folder / PAGE[0]}", *sentences(report), *cautions(report)):
        sys.stderr.write(f"{printable(line)}\n")
    return max(codes.values()) or (0 if report["valid"] else 3), report.get("failure", "")


def _placed(attempt: Attempt, source: Placed, order: Sequence[str], cfg: Json) -> tuple[int, str]:
    """Exit code, and reason if it is not 0, of a solid identical to that of another run."""
    folder, _ = source
    row = read_json(folder / ROW) if (folder / ROW).is_file() else {}
    code = row.get("exit", 1)
    if code in MADE and is_meshed(folder, order):
        return attempt(cfg, placed=source)
    if code == 0:  # meshing is not requested
        return attempt(cfg)
    return code, f"as {folder.name}: {row.get('says', 'failed')}"


def summary(report: Json) -> str:
    """A line about the results of the solids and of the contacts between them."""
    results = Counter(solid["result"] for solid in report["solids"])
    agreeing = sum(each["agree"] is True for each in report["contacts"])
    counts = [f"{count} {result}" for result, count in results.items()]
    return ", ".join([*counts, f"meshes agree at {agreeing} of {len(report['contacts'])} contacts"])
