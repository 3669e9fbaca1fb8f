"""`infer.py`: the config in, the results folder and an exit code out.

Exit codes: 0 a valid result, 2 an input or option that must be refused, 3 no valid result, 130
interrupted.
"""

from __future__ import annotations

import logging
import os
import sys
import time
from collections.abc import Mapping
from pathlib import Path

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from polycube import HOME
from polycube.cli.batch import expanded, run_job
from polycube.cli.command import refused
from polycube.cli.overrides import plain_refusals
from polycube.cli.terminal import PLAIN, QUIET, VERBOSE, logging_to
from polycube.errors import InputError, MeshingError
from polycube.hexmesh.quality import scaled_jacobian
from polycube.pipeline.improvement import Improvement, is_improvement
from polycube.pipeline.intake import check
from polycube.pipeline.run import Run
from polycube.pipeline.stages import State
from polycube.pipeline.stopping import INTERRUPTED, terminable
from polycube.report.numbers.results import summarize, write_results

logger = logging.getLogger(__name__)


def infer(
    cfg: Mapping[str, object], level: int | None = None, is_alone: bool = False
) -> dict[str, object]:
    """Do the whole run and write its folder; returns the numbers of `report.json`, as `finish`."""
    return finish(cfg, level, is_alone)[1]


def finish(
    cfg: Mapping[str, object], level: int | None = None, is_alone: bool = False
) -> tuple[State, dict[str, object]]:
    """Do the whole run and write its folder; returns what was made, and its numbers.

    level : of messages that go to the terminal; by default `quiet` and `verbose` say which
    is_alone : the process does nothing else, see `terminal.logging_to`
    Raises InputError before anything is written.  When a stage fails, what was made before it is
    kept, the report names the stage, and `valid` is false.  A KeyboardInterrupt, or SIGTERM, while
    there is a folder ends in a report too, marked "interrupted"; before, it is raised.
    """
    if level is None:
        level = QUIET if cfg["quiet"] is True else VERBOSE if cfg["verbose"] is True else PLAIN
    with terminable() as asked, logging_to(level, is_alone) as log_to:
        run = Improvement(cfg) if is_improvement(cfg) else Run(cfg)
        run.clock.asked = asked
        _check_place(cfg)
        run.read()
        run.structure()
        folder = _folder(cfg)
        log_to(folder / "run.log")
        run.keep_input(folder)
        try:
            if "meshing" in cfg["order"]:
                run.mesh()
                run.solve()
        except MeshingError as error:
            run.state["failure"] = str(error)
        except KeyboardInterrupt:
            _note_interruption(run.state)
        logger.debug("report begins", extra={"stage": "report"})
        report = summarize(run.state, run.clock.seconds, run.clock.effort, cfg)
        write_results(folder, run.state, report, run.exports, cfg)
        _say(report, folder, cfg)
        return run.state, report


def _note_interruption(state: State) -> None:
    logger.warning("interrupted: writing what there is; once more, and it stops at once")
    state["interrupted"] = True
    hexes = state.get("hexes")
    if hexes is None or scaled_jacobian(hexes.vertices, hexes.hexes).min() <= 0:
        state["failure"] = "interrupted before there was a valid mesh"
    elif "stopped" not in state:
        state["stopped"] = "the run was interrupted after meshing"


def main() -> None:
    """Command line: Hydra composes the config, `infer` runs, the exit code says how it went."""
    codes = []

    @hydra.main(version_base="1.3", config_path=str(HOME / "conf"), config_name="infer")
    def compose_and_run(cfg: DictConfig) -> None:
        codes.append(1)  # of a bug, which Hydra prints
        codes[-1] = _command(cfg)
        if codes[-1] == INTERRUPTED:
            sys.exit(INTERRUPTED)

    try:
        sys.argv[1:] = expanded(sys.argv[1:])
        with plain_refusals():
            compose_and_run()
    except InputError as error:
        sys.exit(refused(error))
    sys.exit(max(codes, default=0))


def _command(cfg: DictConfig) -> int:
    """Exit code of a run, or of a job of a batch; says on the terminal what is wrong."""
    hydra_cfg = HydraConfig.get() if HydraConfig.initialized() else None
    try:
        given = not OmegaConf.is_missing(cfg, "mesh") and cfg.mesh
        if not given and not cfg.resume and not cfg.hex:
            raise InputError("no surface given: say mesh=part.stl, or mesh=example:rod to try it")
        settings = OmegaConf.to_container(cfg, resolve=True, throw_on_missing=False)
    except (InputError, OmegaConfBaseException) as error:
        return refused(error)
    if hydra_cfg and hydra_cfg.mode == RunMode.MULTIRUN:
        folder = Path(hydra_cfg.runtime.output_dir)
        return run_job(settings, folder, hydra_cfg.job.override_dirname, _silently)
    code, sentence = _attempt(settings, is_alone=HydraConfig.initialized())
    if sentence:
        sys.stderr.write(f"error: {sentence}\n")
    return code


def _silently(cfg: Mapping[str, object]) -> tuple[int, str]:
    return _attempt(cfg, logging.CRITICAL)


def _attempt(
    cfg: Mapping[str, object], level: int | None = None, is_alone: bool = False
) -> tuple[int, str]:
    """Exit code, and where it is not 0, the sentence why."""
    try:
        if cfg["preflight"] is not False:
            return check(cfg)
        report = infer(cfg, level, is_alone)
    except (InputError, OmegaConfBaseException) as error:
        return 2, " ".join(str(error).split())
    except MeshingError as error:
        return 3, f"{' '.join(str(error).split())}; nothing was written"
    except KeyboardInterrupt:
        return INTERRUPTED, "interrupted; stages that had finished are kept"
    if report.get("interrupted"):
        kept = "the best mesh so far is kept" if report["valid"] else "there is no valid mesh yet"
        return INTERRUPTED, f"interrupted; {kept}"
    if not report["valid"]:
        return 3, f"{report['failure']}; what was made is kept, marked invalid"
    return 0, ""


def _say(report: Mapping[str, object], folder: Path, cfg: Mapping[str, object]) -> None:
    """The outcome in two lines; doubts, and what else to try, in more."""
    if "hex" in report:
        numbers = report["hex"]
        creases = numbers["creases_to_edges_p95"]
        everywhere = numbers["certificate"]["positive_everywhere"]
        valid = "valid" if everywhere else "valid (at corners only)"
        logger.info(
            "%s hex mesh: %d hexes, scaled Jacobian at least %.3f (mean %.3f), "
            "within %.2f %% of the diagonal%s",
            valid if numbers["inverted"] == 0 else "INVALID",
            numbers["hexes"],
            numbers["min_scaled_jacobian"],
            numbers["mean_scaled_jacobian"],
            100 * max(numbers["mesh_to_surface_max"], numbers["surface_to_mesh_max"]),
            f", sharp edges within {100 * creases:.2f} % (95 of 100)" * (creases > 0),
        )
    for doubt in report.get("doubts", ()):
        logger.warning("warning: look at the mesh before you use it: %s", doubt)
    if report.get("doubts") and not cfg["hex"] and cfg["meshing"].get("otherwise"):
        logger.warning("hint: try %s", cfg["meshing"]["otherwise"])
    page = folder / "report.html"
    logger.info("results: %s", page if page.is_file() else folder)


def _place(cfg: Mapping[str, object]) -> Path:
    """The results folder: as asked for, that of the run resumed, or a new one for this part."""
    if cfg["output_dir"] or cfg["resume"]:
        return Path(cfg["output_dir"] or cfg["resume"])
    part = Path(str(cfg["hex"] or cfg["mesh"]).removeprefix("example:")).stem
    return Path("outputs") / part / time.strftime("%Y%m%d-%H%M%S")


def _check_place(cfg: Mapping[str, object]) -> None:
    """Raise InputError before any work where results can not be written; nothing is made yet."""
    folder = _place(cfg).absolute()
    there = next(path for path in (folder, *folder.parents) if path.exists())
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        raise InputError(f"cannot write results to {folder}: {there} is no folder to write in")


def _folder(cfg: Mapping[str, object]) -> Path:
    """The results folder, made where it is not there."""
    folder = _place(cfg)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "run.log").open("a").close()
    except OSError as error:
        raise InputError(f"cannot write results to {folder}: {error.strerror}") from None
    return folder
