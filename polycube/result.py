"""Results of a run of the Python interface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from polycube.analysis.problem import Problem
from polycube.errors import InputError
from polycube.io.bezier import write_solution
from polycube.registry import build, names, provide
from polycube.report.files import write_hexes
from polycube.types import HexMesh, Json, Modes, Polycube, Solution, Spline, TriMesh

if TYPE_CHECKING:
    import pyvista

VTU = ".vtu"


@dataclass(frozen=True, eq=False)
class Result:
    """Results of a run; results that were not requested or not reached are None.

    Parameters
    ----------
    surface : the surface that was meshed
    polycube : the polycube of the structure
    hexes : the hex mesh
    spline : the volumetric spline
    solution : the solution of the analysis
    report : the content of `report.json`
    failure : reason why there is no valid result, or None
    warnings : warnings about the mesh
    interrupted : whether the run was interrupted
    problem : the problem that the analysis solves
    config : the settings of the run, as in `config.json`
    """

    surface: TriMesh
    polycube: Polycube | None
    hexes: HexMesh | None
    spline: Spline | None
    solution: Solution | None
    report: Mapping[str, object]
    failure: str | None = None
    warnings: tuple[str, ...] = ()
    interrupted: bool = False
    problem: Problem | None = None
    config: Json = field(default_factory=dict)

    @property
    def modes(self) -> Modes | None:
        """The solution if it consists of vibration modes, else None."""
        return self.solution if isinstance(self.solution, Modes) else None

    def save(self, path: str | Path) -> Path:
        """Write the hex mesh in the format that belongs to the suffix of a path.

        Parameters
        ----------
        path : path of the file, such as "part.vtu" or "part.inp"

        Returns
        -------
        The path of the written file.

        Raises
        ------
        InputError
            If there is no hex mesh or no export plugin for the suffix, or if the format contains
            the analysis and the mesh does not have one of its places.
        """
        path = Path(path)
        suffixes = {build("export", {"plugin": name}).suffix: name for name in names("export")}
        known = sorted([VTU, *suffixes])
        if path.suffix not in known or self.hexes is None:
            what = "there is no hex mesh" if self.hexes is None else "no format has this suffix"
            raise InputError(what, str(path), f"choose one of {', '.join(known)}")
        if path.suffix == VTU:
            return write_hexes(path, self.hexes, self.surface, self.polycube)
        export = build("export", {"plugin": suffixes[path.suffix]})
        complete = provide(export, spline=self.spline, problem=self.problem)
        return complete(self.hexes, path.with_suffix(""))

    def to_pyvista(self, what: str = "hexes") -> pyvista.UnstructuredGrid:
        """A PyVista grid with the arrays of the files of a run.

        Parameters
        ----------
        what : "hexes", as in hex.vtu; or "solution", as in modes.vtu, static.vtu or poisson.vtu

        Returns
        -------
        The grid, with lengths in model units.

        Raises
        ------
        InputError
            If the run has no such result.
        """
        import pyvista

        if what not in ("hexes", "solution") or getattr(self, what) is None:
            raise InputError(f"there is nothing called {what!r}", remedy="use hexes or solution")
        with TemporaryDirectory() as folder:
            if what == "hexes":
                self.save(Path(folder) / "hex.vtu")
            elif self.spline is not None and self.solution is not None:
                write_solution(Path(folder), self.spline, self.solution)
            [path] = Path(folder).glob("*.vtu")
            return pyvista.UnstructuredGrid(path)
