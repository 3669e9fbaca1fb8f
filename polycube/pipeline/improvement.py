"""`infer.py hex=mesh.vtu`: a hex mesh of another program, from the later stages to modes.

Nothing is proposed or subdivided.  The surface is the one given with it, or its own boundary.
What comes out is never worse than what came in, by `quality.score`.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path

from polycube.errors import InputError, MeshingError
from polycube.hexmesh.quality import BEST_SCORE, scaled_jacobian
from polycube.io.hex_meshes import boundary, check_place, read_hexes
from polycube.io.surfaces import read_surface
from polycube.pipeline.portfolio import run_portfolio
from polycube.pipeline.run import Run, meshing_stages
from polycube.pipeline.stages import Stage, load_stage, save_stage
from polycube.surface.measures import genus
from polycube.types import HexMesh

logger = logging.getLogger(__name__)

GIVEN = "given"  # the stage file of the mesh that was read


class Improvement(Run):
    """A run that begins with hexes."""

    BEFORE = ("read",)

    def _meshing(self) -> list[Stage]:
        return meshing_stages(self._backend, ("surface", "hexes"))

    @property
    def _backend(self) -> Mapping[str, object]:
        return self.cfg["improve"]

    def read(self) -> None:
        """The hex mesh and the surface, checked; raises InputError."""
        if self._kept("read"):
            folder = Path(self.cfg["resume"])
            surface, path, warnings = load_stage(folder, "read")
            given, hex_path = load_stage(folder, GIVEN)
        else:
            given, surface, path, hex_path, warnings = self.clock.run("read", self._read_files)
        for warning in warnings:
            logger.warning("warning: %s", warning)
        self.state |= {"surface": surface, "path": path, "warnings": list(warnings)}
        self.state |= {"given": given, "hex_path": hex_path, "hexes": given}

    def _read_files(self) -> tuple:
        hex_path, path = str(self.cfg["hex"]), str(self.cfg["mesh"])
        given, warnings = read_hexes(hex_path)
        if path == "???":  # no mesh=
            return given, boundary(given), hex_path, hex_path, warnings
        surface, more = read_surface(path, self.cad)
        try:
            check_place(given, surface)
        except InputError as error:
            raise InputError(f"{hex_path} and {path}: {error}") from None
        handles = genus(boundary(given)), genus(surface)
        if handles[0] != handles[1]:
            more = [*more, "the hex mesh has genus {}, the surface {}".format(*handles)]
        return given, surface, path, hex_path, [*warnings, *more]

    def structure(self) -> None:
        """None is looked for."""

    def _keep_structure(self, folder: Path) -> None:
        save_stage(folder, GIVEN, [self.state["given"], self.state["hex_path"]])

    def _make(self, stages: list[Stage], kept: list[Stage]) -> None:
        """The best mesh of the portfolio, or the one given where none is better."""
        given = self.state["given"]
        start, end = self._score(given), None
        clock = self.clock.on(self.state)
        clock.keep(given)
        try:
            end, path = run_portfolio(
                stages,
                self._backend["portfolio"],
                self.state,
                clock,
                lambda end: self._score(end["hexes"]),
                max(start, BEST_SCORE),
            )
        except MeshingError as error:
            logger.info("%s", error)
        if end is None or self._order(end["hexes"]) <= self._order(given):
            logger.info("no better mesh was found: the one given is kept")
            end, path = {**self.state, "hexes": given}, [given for _ in stages]
        self.state = end
        for stage, result in zip(stages, path, strict=True):
            save_stage(self.folder, stage.kind, result)

    def _order(self, mesh: HexMesh) -> tuple[float, float, float]:
        """Larger is better: the score, and among equals the least and the mean scaled Jacobian."""
        jacobian = scaled_jacobian(mesh.vertices, mesh.hexes)
        return self._score(mesh), float(jacobian.min()), float(jacobian.mean())


def is_improvement(cfg: Mapping[str, object]) -> bool:
    """Whether the run begins with hexes: `hex` is given, or the run resumed began so."""
    kept = Path(str(cfg["resume"])) / "stages" / f"{GIVEN}.npz"
    return bool(cfg["hex"]) or (bool(cfg["resume"]) and kept.is_file())
