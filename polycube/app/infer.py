"""`infer.py`: the config in, the results folder and an exit code out.

Exit codes: 0 a valid result, 2 an input or option that must be refused, 3 no valid result.
"""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from logging.handlers import MemoryHandler
from pathlib import Path

import hydra
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

import polycube.search_path  # noqa: F401  (lets Hydra see the conf of installed plugin packages)
from polycube import HOME
from polycube.app.improve import Improvement, is_improvement
from polycube.app.run import Run
from polycube.errors import InputError, MeshingError
from polycube.pipeline import State
from polycube.report.results import summarize, write_results

logger = logging.getLogger(__name__)

INTERRUPTED = 130  # as shells say it


def infer(cfg: Mapping[str, object]) -> dict[str, object]:
    """Do the whole run and write its folder; returns the numbers of `report.json`, as `finish`."""
    return finish(cfg)[1]


def finish(cfg: Mapping[str, object]) -> tuple[State, dict[str, object]]:
    """Do the whole run and write its folder; returns what was made, and its numbers.

    Raises InputError before anything is written.  When a stage fails, what was made before it is
    kept, the report names the stage, and `valid` is false.
    """
    with _logging(cfg["quiet"]) as log_to:
        run = Improvement(cfg) if is_improvement(cfg) else Run(cfg)
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
        report = summarize(run.state, run.clock.seconds, run.clock.effort, cfg)
        write_results(folder, run.state, report, run.exports, cfg)
        _say(report, folder)
        return run.state, report


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
        compose_and_run()
    except SystemExit as end:
        refused = not codes and end.code  # Hydra has said what is wrong with the overrides
        sys.exit(2 if refused else end.code)
    sys.exit(max(codes, default=0))  # of several runs (-m) the worst


def _command(cfg: DictConfig) -> int:
    try:
        if OmegaConf.is_missing(cfg, "mesh") and not cfg.resume and not cfg.hex:
            raise InputError("no surface given: say mesh=part.stl, or mesh=example:rod to try it")
        report = infer(OmegaConf.to_container(cfg, resolve=True, throw_on_missing=False))
    except (InputError, OmegaConfBaseException) as error:
        sys.stderr.write(f"error: {' '.join(str(error).split())}\n")
        return 2
    except MeshingError as error:
        sys.stderr.write(f"error: {' '.join(str(error).split())}; nothing was written\n")
        return 3
    except KeyboardInterrupt:
        sys.stderr.write("error: interrupted; stages that had finished are kept\n")
        return INTERRUPTED
    if not report["valid"]:
        sys.stderr.write(f"error: {report['failure']}; what was made is kept, marked invalid\n")
        return 3
    return 0


def _say(report: Mapping[str, object], folder: Path) -> None:
    """The outcome in two lines."""
    if "hex" in report:
        numbers = report["hex"]
        everywhere = numbers["certificate"]["positive_everywhere"]
        valid = "valid" if everywhere else "valid (at corners only)"
        logger.info(
            "%s hex mesh: %d hexes, scaled Jacobian at least %.3f (mean %.3f), "
            "within %.2f %% of the diagonal",
            valid if numbers["inverted"] == 0 else "INVALID",
            numbers["hexes"],
            numbers["min_scaled_jacobian"],
            numbers["mean_scaled_jacobian"],
            100 * max(numbers["mesh_to_surface_max"], numbers["surface_to_mesh_max"]),
        )
    for doubt in report.get("doubts", ()):
        logger.warning("warning: look at the mesh before you use it: %s", doubt)
    page = folder / "report.html"
    logger.info("results: %s", page if page.is_file() else folder)


def _folder(cfg: Mapping[str, object]) -> Path:
    """The results folder: as asked for, that of the run resumed, or a new one for this part."""
    if cfg["output_dir"] or cfg["resume"]:
        folder = Path(cfg["output_dir"] or cfg["resume"])
    else:
        part = Path(str(cfg["hex"] or cfg["mesh"]).removeprefix("example:")).stem
        folder = Path("outputs") / part / time.strftime("%Y%m%d-%H%M%S")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "run.log").open("a").close()
    except OSError as error:
        raise InputError(f"cannot write results to {folder}: {error.strerror}") from None
    return folder


@contextmanager
def _logging(quiet: bool) -> Iterator[object]:
    """Log to the terminal, and to a file as soon as the run has a folder; yields `log_to(path)`."""
    root = logging.getLogger("polycube")
    terminal = logging.StreamHandler(sys.stderr)
    terminal.setLevel(logging.WARNING if quiet else logging.INFO)
    terminal.setFormatter(logging.Formatter("%(message)s"))
    early = MemoryHandler(10_000, flushLevel=logging.CRITICAL + 1, flushOnClose=False)
    before = root.level
    root.setLevel(logging.INFO)
    handlers: list[logging.Handler] = [terminal, early]
    for handler in handlers:
        root.addHandler(handler)

    def log_to(path: Path) -> None:
        file = logging.FileHandler(path, mode="w", encoding="utf-8")
        file.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
        early.setTarget(file)
        early.flush()
        root.addHandler(file)
        handlers.append(file)
        root.removeHandler(early)

    try:
        yield log_to
    finally:
        root.setLevel(before)
        for handler in handlers:
            root.removeHandler(handler)
            handler.close()
