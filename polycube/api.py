"""Python interface: `polycube.mesh("part.step", size=2.0)`.

Arguments and results are objects. The state of the process is not changed, so the interface can be
used inside another Hydra program, in a notebook and on any thread.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from threading import Event

import numpy as np

from polycube.config import SHORT, compose, literal
from polycube.errors import InputError, MeshingError
from polycube.io.access.lock import locked
from polycube.io.access.reading import read_json
from polycube.io.hex_meshes import FORMATS, boundary
from polycube.io.solids.motions import Motion
from polycube.kinds import Export
from polycube.pipeline.improvement import Improvement, Placement, is_improvement, read_given
from polycube.pipeline.intake import read_part
from polycube.pipeline.resume.settings import with_earlier_settings
from polycube.pipeline.run import Read, Run
from polycube.pipeline.settings import Settings
from polycube.pipeline.solving import check_places
from polycube.registry import build, provide
from polycube.report.citation import bibtex
from polycube.report.files import check_folder, start_folder, write_results
from polycube.report.numbers.problem import problem_of
from polycube.report.numbers.results import summarize
from polycube.result import Result
from polycube.state import RunState
from polycube.surface.checks import check_closed, check_surface
from polycube.surface.repair.clean import clean
from polycube.types import HexMesh, TriMesh


def mesh(
    source: object, *overrides: str, output_dir: str | Path | None = None, **options: object
) -> Result:
    """Compute polycube, hex mesh, spline and analysis of a part.

    Parameters
    ----------
    source : path of a surface, CAD file or hex mesh, `example:rod`, a `TriMesh` (with its CAD
        faces), a `HexMesh` to be improved, or any object with `vertices` (V, 3) and triangles
        `faces` (F, 3) such as a trimesh.Trimesh; lengths are in the units of the part
    overrides : settings as on the command line, such as "meshing.optimize.samples=500"
    output_dir : folder for the files of the run; None: no files are written
    options : `size`, `material`, or any setting of `infer.py`: a value, such as
        `context=["cube", "hole_z"]`, `order=["meshing"]` or `meshing="parametric"`; or a mapping of
        options, such as `analysis={"modes": 12}`

    Returns
    -------
    The results, in the units and the placement of the part.

    Raises
    ------
    InputError
        If the part or an option is invalid.
    MeshingError
        If there is no valid result; its `result` contains the completed stages.
    KeyboardInterrupt
        If the run is interrupted.

    Examples
    --------
    >>> part = polycube.mesh("example:rod", size="8%", order=["meshing"])  # doctest: +SKIP
    >>> part.save("rod.inp")  # doctest: +SKIP
    """
    chosen, read = _input(source)
    more = [setting for name in options for setting in _overrides(name, options[name])]
    settings = Settings.of(compose("infer", [*overrides, chosen, *more]))
    if output_dir is None:
        settings = replace(settings, order=tuple(h for h in settings.order if h != "report"))
    result = execute(settings, Path(output_dir) if output_dir else None, read)
    if result.interrupted:
        raise KeyboardInterrupt
    if result.failure is not None:
        error = MeshingError(result.failure)
        error.result = result
        raise error
    return result


def execute(
    settings: Settings,
    folder: Path | None = None,
    read: Read | None = None,
    interrupt: Event | None = None,
    started: Callable[[Path], None] = lambda folder: None,
    placed: tuple[Path, Motion] | None = None,
) -> Result:
    """Do a complete run; used by `mesh` and by the command line.

    Parameters
    ----------
    settings : settings of the run
    folder : folder for the files of the run; None: no files are written
    read : function that makes the first state; None: read the files given in the settings
    interrupt : set by another thread or by a signal handler to end the run with the best mesh
    started : called with the folder after the input was accepted
    placed : folder of the run of an identical solid, and the motion of its mesh to this one

    Returns
    -------
    The results, also those of a failed or interrupted run.

    Raises
    ------
    InputError
        If the input or a setting is invalid; no file is written then.
    KeyboardInterrupt
        If the run is interrupted before the folder is made.
    """
    settings = with_earlier_settings(settings)
    if placed is not None:
        run: Run = Placement(settings, *placed, interrupt)
    elif is_improvement(settings):
        run = Improvement(settings, read or read_given, interrupt)
    else:
        run = Run(settings, read or read_part, interrupt)
    built = [build("export", config) for config in settings.export.values()]
    with locked(folder) if folder is not None else nullcontext():
        if folder is not None:
            check_folder(folder, settings, run.names, built)
        state = run.begin()
        settings = run.settings
        problem = problem_of(settings.composed)
        exports = [provide(each, problem=problem) for each in built]
        if folder is not None:
            start_folder(folder, settings, state)
            started(folder)
            run.store_input(state, folder)
        state = _work(run, state, exports)
        if state.failure is not None or state.interrupted:  # the exports' sets were not checked
            exports = built
        report = summarize(state, run.clock.seconds, run.clock.effort, settings.composed)
        if folder is not None:
            write_results(folder, state, report, exports, settings)
    return Result(
        state.surface,
        state.polycube,
        state.hexes,
        state.spline,
        state.solution,
        report,
        state.failure,
        state.verdict.warnings if state.verdict else (),
        state.interrupted,
        problem,
        settings.composed,
    )


def _work(run: Run, state: RunState, exports: Sequence[Export]) -> RunState:
    """Mesh and solve; after a failure or an interruption, the last state is returned."""
    try:
        if "meshing" in run.settings.order:
            state = run.mesh(state)
        if state.hexes is not None and state.failure is None and not state.interrupted:
            check_places(state.hexes, run.solving, exports, run.results.folder)
            state = run.solve(state)
    except MeshingError as error:
        return replace(state, failure=str(error))
    except KeyboardInterrupt:
        if state.hexes is None:
            failure = "interrupted before there was a valid mesh"
            return replace(state, interrupted=True, failure=failure)
        return replace(state, interrupted=True, stopped="the run was interrupted after meshing")
    return state


def citation(result: Result | str | Path) -> str:
    """BibTeX entries of the program and of the methods that a run used.

    Parameters
    ----------
    result : what `mesh` returned, or the folder of a run

    Raises
    ------
    InputError
        For a folder without the report of a run.

    Examples
    --------
    >>> print(polycube.citation("results"))  # doctest: +SKIP
    """
    if isinstance(result, Result):
        return bibtex(result.report, result.config)
    return bibtex(*(read_json(Path(result) / name) for name in ("report.json", "config.json")))


def _input(source: object) -> tuple[str, Read | None]:
    """The override for a part, and the function that makes the first state of an object."""
    if isinstance(source, str | Path):
        key = "hex" if str(source).lower().endswith(FORMATS) else "mesh"
        return f"{key}={literal(str(source))}", None
    if isinstance(source, HexMesh):
        start = RunState(boundary(source), "object", given=source, hex_path="object", hexes=source)
        return "hex=object", lambda settings, clock: start
    surface = _surface(source)
    return "mesh=object", lambda settings, clock: RunState(surface, path="object")


def _surface(source: object) -> TriMesh:
    """A closed surface from anything with vertices and triangles; raises InputError."""
    if isinstance(source, TriMesh):
        check_closed(source)
        check_surface(source)
        return source
    if not hasattr(source, "vertices") or not hasattr(source, "faces"):
        kind = type(source).__name__
        what = f"a part must be a path, a mesh or an object with vertices and faces; got {kind}"
        raise InputError(what)
    return clean(np.asarray(source.vertices, float), np.asarray(source.faces))[0]


def _overrides(name: str, value: object) -> list[str]:
    """Overrides in Hydra's syntax for a keyword of `mesh`."""
    if isinstance(value, Mapping):
        return [each for key in value for each in _overrides(f"{name}.{key}", value[key])]
    return [f"{SHORT.get(name, name)}={literal(value)}"]
