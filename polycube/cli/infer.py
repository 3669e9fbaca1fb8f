"""`infer.py`: from a configuration to a results folder and an exit code.

Exit codes: 0 a valid result, 2 an invalid input or option, 3 no valid result, 130 interrupted.
"""

import logging
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig

from polycube.api import execute
from polycube.cli.batch import expanded, part_name, run_job
from polycube.cli.command import in_full, refused, refusing, run_hydra, with_input
from polycube.cli.signals import INTERRUPTED, terminable
from polycube.cli.solids import run as solids
from polycube.cli.solids.settings import of_solid
from polycube.cli.terminal import PLAIN, QUIET, VERBOSE, logging_to
from polycube.config import plain
from polycube.errors import InputError, MeshingError
from polycube.io import manifest
from polycube.io.preflight import preflight
from polycube.pipeline.settings import Settings
from polycube.report.numbers.formatting import cautions, sentences
from polycube.types import Json

logger = logging.getLogger(__name__)


def infer(
    cfg: Json, level: int | None = None, is_alone: bool = False, placed: solids.Placed | None = None
) -> Json:
    """Do the whole run and write its folder.

    Returns the numbers of `report.json`. Raises InputError if the input or an option is invalid; no
    file is written then. Raises KeyboardInterrupt if a signal came before there was a folder; later
    ones end in a report.

    cfg : configuration composed from `conf/infer.yaml`
    level : level of messages on the terminal; default: from `quiet` and `verbose`
    is_alone : whether the process does nothing else, see `terminal.logging_to`
    placed : run of an identical solid whose mesh is taken, see `api.execute`
    """
    settings = Settings.of(cfg)
    if level is None:
        level = QUIET if cfg["quiet"] else VERBOSE if cfg["verbose"] else PLAIN
    folder = _folder(cfg)
    with terminable() as interrupt, logging_to(level, is_alone) as log_to:
        result = execute(
            settings,
            folder,
            interrupt=interrupt,
            started=lambda there: log_to(manifest.append_to(there, "run.log")),
            placed=placed,
        )
        _log_results(result.report, folder, cfg)
    return result.report


def check(cfg: Json) -> tuple[int, str]:
    """Print the defects of the surface: exit code 0 if it is usable, else 2, and the reason.

    Their places are only written if `preflight` is the name of a file.
    """
    option = cfg["preflight"]
    if not isinstance(option, bool) and not str(option).lower().endswith(".vtp"):
        choices = "true, false or the name of a .vtp file"
        raise InputError(f"preflight must be {choices}; got {option!r}")
    if cfg["hex"]:
        raise InputError("preflight checks the surface of mesh=, it cannot be combined with hex=")
    settings = replace(Settings.of(cfg), resume=None)
    places = None if isinstance(option, bool) else Path(str(option))
    remedy = "choose another name in preflight=, or move the file away"
    if places:
        manifest.check(places.parent, [places.name], [Path(str(settings.mesh))], remedy)
    found = preflight(str(settings.mesh), settings.cad, settings.repair, settings.points)
    sys.stdout.write(f"{found.table()}\n")
    if places:
        with manifest.writing(places.parent, remedy) as scratch:
            found.write(scratch / places.name)
        sys.stdout.write(f"places: {places}\n")
    if found.is_usable:
        sys.stdout.write(f"{found.verdict}\n")
    return (0, "") if found.is_usable else (2, found.verdict)


def main() -> None:
    """Command line: Hydra composes the configuration, `infer` runs, and the exit code is set."""

    def task(cfg: DictConfig) -> None:
        code = _command(cfg)
        # in a batch, `Summary` sets the code after the last job
        if code and (code == INTERRUPTED or HydraConfig.get().mode == RunMode.RUN):
            sys.exit(code)

    with refusing():
        sys.argv[1:] = expanded(with_input(in_full(sys.argv[1:])))
        run_hydra("infer", task)


def _command(cfg: DictConfig) -> int:
    """Exit code of a run, or of a job of a batch; errors are printed on the terminal."""
    hydra_cfg = HydraConfig.get() if HydraConfig.initialized() else None
    with refusing():  # here, because Hydra would print a line of its own
        settings = plain(cfg)
    if hydra_cfg is not None and hydra_cfg.mode == RunMode.MULTIRUN:
        folder = Path(hydra_cfg.runtime.output_dir)
        return run_job(settings, folder, hydra_cfg.job.override_dirname, _silently)
    code, sentence = _attempt(settings, is_alone=hydra_cfg is not None)
    if sentence:
        refused(sentence)
    return code


def _attempt(
    cfg: Json, level: int | None = None, is_alone: bool = False, placed: solids.Placed | None = None
) -> tuple[int, str]:
    """Exit code, and if it is not 0, a sentence with the reason."""
    try:
        if cfg["mesh"] in ("???", None, "") and not cfg["resume"] and not cfg["hex"]:
            what = "no part given: run infer.py part.step, or infer.py example:rod to try it"
            raise InputError(what)
        if cfg["cad"]["solid"] == solids.ALL:
            found = solids.solids_of(cfg)
            if found and cfg["preflight"] is not False:
                return solids.check_solids(cfg, found, _silently)
            if found:
                return solids.run_solids(cfg, found, _folder(cfg), _silently)
            cfg = of_solid(cfg, None)
        if cfg["preflight"] is not False:
            return check(cfg)
        report = infer(cfg, level, is_alone, placed)
    except InputError as error:
        return 2, " ".join(str(error).split())
    except MeshingError as error:
        return 3, f"{' '.join(str(error).split())}; no file was written"
    except KeyboardInterrupt:
        return INTERRUPTED, "interrupted; the results of completed stages are saved"
    if report.get("interrupted"):
        state = "the best mesh so far is saved" if report["valid"] else "there is no valid mesh yet"
        return INTERRUPTED, f"interrupted; {state}"
    if not report["valid"]:
        return 3, f"{report['failure']}; the files are marked as {_fault(report)}"
    return 0, ""


_silently = partial(_attempt, level=logging.CRITICAL)


def _log_results(report: Json, folder: Path, cfg: Json) -> None:
    """Print the mesh, the results of the analysis and their folder; warnings and suggestions."""
    if "hex" in report:
        numbers = report["hex"]
        creases = numbers["creases_to_edges_p95"]
        everywhere = numbers["certificate"]["positive_everywhere"]
        valid = "valid" if everywhere else "valid (at corners only)"
        off = 100 * max(numbers["mesh_to_surface_max"], numbers["surface_to_mesh_max"])
        sharp = f", 95 % of the sharp edges within {100 * creases:.2f} %" * (creases > 0)
        kind = valid if report["valid"] else _fault(report).upper()
        sizes = numbers["hexes"], numbers["min_scaled_jacobian"], numbers["mean_scaled_jacobian"]
        quality = "smallest scaled Jacobian %.3f (mean %.3f)"
        form = f"%s hex mesh: %d hexes, {quality}, distance at most %.2f %% of the diagonal%s"
        logger.info(form, kind, *sizes, off, sharp)
        counts = numbers["counts"]
        for kind, places, sentence in (
            ("around", "holes", "%d of %d holes have fewer edges than meshing.around_hole"),
            ("through", "walls", "%d of %d walls have fewer hexes than meshing.across_wall"),
        ):
            number = sum(row["kind"] == kind for row in counts["fewer"])
            if number:
                logger.info(f"{sentence}; they are listed in the report", number, counts[places])
    for result in sentences(report):
        logger.info("%s", result)
    for caution in cautions(report):
        logger.warning("warning: %s", caution)
    for warning in report.get("mesh_warnings", ()):
        logger.warning("warning: check the mesh before you use it: %s", warning)
    is_poor = report.get("mesh_warnings") or (not report["valid"] and "hex" in report)
    if is_poor and not cfg["hex"] and cfg["meshing"].get("otherwise"):
        logger.warning("hint: try %s", cfg["meshing"]["otherwise"])
    page = folder / "report.html"
    logger.info("results: %s", page if page.is_file() else folder)


def _fault(report: Json) -> str:
    return "partly fitted" if report.get("partly_fitted") else "invalid"


def _folder(cfg: Json) -> Path:
    """The results folder: requested, of the resumed run, or a new one for this part."""
    if cfg["output_dir"] or cfg["resume"]:
        return Path(str(cfg["output_dir"] or cfg["resume"]))
    name = part_name(str(cfg["hex"] or cfg["mesh"]))
    return Path("outputs") / name / time.strftime("%Y%m%d-%H%M%S")
