"""One part, from surface to modes: what `infer.py` does between reading its config and reporting.

Each method is one step and adds to `state`; with `resume` a step before `from` is loaded instead.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from polycube.analysis.boundary_sets import check_names
from polycube.errors import InputError, MeshingError
from polycube.hexmesh.cad_faces import with_sets
from polycube.hexmesh.certificate import certify
from polycube.hexmesh.named_sets import sets_of_spline
from polycube.hexmesh.quality import ENOUGH, INVALID, accept, scaled_jacobian, score
from polycube.io.cad import Cad
from polycube.kinds import KINDS, check_chain
from polycube.pipeline.finer import meet
from polycube.pipeline.intake import REPAIR, check_intake, keep_repair, kept_repair, read_part
from polycube.pipeline.portfolio import Portfolio, search
from polycube.pipeline.primitives import voxels
from polycube.pipeline.proposals import no_structure, propose
from polycube.pipeline.ranking import GOOD_SCORE, enough, rank, worth_a_try
from polycube.pipeline.settings import check_settings, unlike
from polycube.pipeline.stages import (
    Stage,
    State,
    build_stages,
    clear_stages,
    load_stage,
    save_stage,
)
from polycube.pipeline.stopping import TimeIsUp, Watch
from polycube.registry import build
from polycube.report.numbers.results import clear_results
from polycube.structure.lattice import describe
from polycube.structure.parametrization import pull_back
from polycube.structure.recognition import read_structure
from polycube.surface import measures as topology
from polycube.types import Candidate, HexMesh, Polycube, Ranked

logger = logging.getLogger(__name__)

READ_MARGIN = 0.05  # log-likelihood per point; 22 of 24 held-out pairs are read as what they are
CERTIFY = ("corners", "everywhere")  # where a mesh's Jacobian must be positive
PLACED = ("surface", "polycube", "rough_map", "parametrization")  # what meshing starts from


class Run:
    """State, clock and folder of one part; the stages are built, and checked, at the start."""

    BEFORE = ("read", "structure")  # the meshing stages

    def __init__(self, cfg: Mapping[str, object]) -> None:
        check_settings(cfg)
        check_intake(cfg)
        self.cfg = cfg
        self.clock = Watch()
        self.state: State = {}
        self.folder: Path | None = None  # set when the input is known to be good
        self.cad = Cad(**cfg["cad"], units=cfg["analysis"].get("units"))
        self.meshing = self._meshing()
        if self._backend.get("certify", CERTIFY[0]) not in CERTIFY:
            raise InputError(
                f"meshing.certify must be {' or '.join(CERTIFY)}; got {self._backend['certify']!r}"
            )
        self.solving = build_stages([k for k in ("spline", "analysis") if k in cfg["order"]], cfg)
        self.regularize = build("regularize", cfg["regularize"])
        self.primitives = voxels(cfg["primitives"]["use"])
        self.exports = [build("export", config) for config in cfg.get("export", {}).values()]
        self.names = [*self.BEFORE, *(s.kind for s in self.meshing + self.solving)]
        if cfg["resume"] and cfg["from"] not in self.names:
            raise InputError(
                f"resume needs the first stage to run again, from=STAGE; got {cfg['from']}, "
                f"have {', '.join(self.names)}"
            )

    @property
    def _backend(self) -> Mapping[str, object]:
        return self.cfg["meshing"]

    def _meshing(self) -> list[Stage]:
        return meshing_stages(self._backend, PLACED)

    def read(self) -> None:
        """The surface, checked; raises InputError."""
        if self._kept("read"):
            surface, path, warnings = load_stage(Path(self.cfg["resume"]), "read")
            self.state |= kept_repair(Path(self.cfg["resume"]))
        else:
            path = str(self.cfg["mesh"])
            reading = self.clock.run("read", lambda: read_part(self.cfg, self.cad))
            surface, warnings, repair = reading
            self.state |= {REPAIR: repair} if repair else {}
        for warning in warnings:
            logger.warning("warning: %s", warning)
        self.state |= {"surface": surface, "path": path, "warnings": list(warnings)}

    def structure(self) -> None:
        """Propose polycubes and rank them; raises InputError when none has the surface's genus."""
        if self._kept("structure"):
            ranked, chosen = load_stage(Path(self.cfg["resume"]), "structure")
        else:
            surface = self.state["surface"]
            candidates = propose(self.cfg, surface, self.primitives, self.clock)
            ranked = self.clock.run("ranking", lambda: rank(surface, candidates))
            chosen = 0
            if not ranked:
                raise InputError(no_structure(self.cfg, surface, len(candidates)))
        self.state |= {"ranked": ranked, "auto": not self.cfg["context"]}
        self._choose(chosen)

    def keep_input(self, folder: Path) -> None:
        """Start the results folder: from here on, what is made is kept.

        A run from the beginning removes the results that an earlier one left there.
        """
        self.folder = folder
        if self.cfg["resume"]:
            self._say_what_differs(Path(self.cfg["resume"]) / "config.json")
        else:
            clear_results(folder)
            clear_stages(folder)
        kept = [self.state["surface"], self.state["path"], self.state["warnings"]]
        save_stage(folder, "read", kept)
        keep_repair(folder, self.state)
        self._keep_structure(folder)

    def _say_what_differs(self, kept: Path) -> None:
        """Settings of the stages to come are those of this command line, not of the kept run."""
        again = self.names[self.names.index(self.cfg["from"]) :]
        before = json.loads(kept.read_text()) if kept.is_file() else self.cfg
        for sentence in unlike(self.cfg, before, again):
            logger.warning("warning: resumed with other settings: %s", sentence)

    def _keep_structure(self, folder: Path) -> None:
        save_stage(folder, "structure", [self.state["ranked"], self.state["chosen"]])

    def mesh(self) -> None:
        """Hexes on the best structure; where they are not accepted, the next is tried as well.

        When the time for it is up, or at Ctrl-C, the best valid mesh so far is the result.
        Raises MeshingError when the best mesh has a hex that is not valid; it is kept.
        """
        first = next((i for i, s in enumerate(self.meshing) if not self._kept(s.kind)), None)
        kept = self.meshing[:first]
        for stage in kept:
            value = load_stage(Path(self.cfg["resume"]), stage.kind)
            self.state[KINDS[stage.kind].gives] = value
            save_stage(self.folder, stage.kind, value)
        if first is not None:
            self._make_in_time(self.meshing[first:], kept)
        hexes = self.state["hexes"] = with_sets(self.state["hexes"], self.state["surface"])
        self._check(hexes)
        self._check_places(hexes)

    def _make_in_time(self, stages: list[Stage], kept: list[Stage]) -> None:
        seconds = self.cfg["seconds"]
        try:
            with self.clock.limited(seconds):
                self._make(stages, kept)
        except TimeIsUp:
            self._keep_best(f"meshing was stopped after {seconds:g} s, as asked")
        except KeyboardInterrupt:
            self._keep_best("meshing was interrupted")
            raise

    def _keep_best(self, why: str) -> None:
        """Make the best valid mesh so far the result, for later stages too, if there is any."""
        best = self.clock.best(lambda state: self._score(state["hexes"]))
        if best is None:
            return
        told = f"{why}; this is the best valid mesh until then"
        hexes = with_sets(best["hexes"], best["surface"])
        self.state = {**best, "hexes": hexes, "stopped": told}
        logger.warning("warning: %s", self.state["stopped"])
        if "ranked" in best:
            self._keep_structure(self.folder)
        for stage in self.meshing:
            save_stage(self.folder, stage.kind, best.get(KINDS[stage.kind].gives, best["hexes"]))

    def _make(self, stages: list[Stage], kept: list[Stage]) -> None:
        ranked = self.state["ranked"]
        choices = [self.state["chosen"]] if kept else worth_a_try(ranked, self.cfg["tries"])
        self._mesh_choices(choices, stages)

    def _check(self, hexes: HexMesh) -> None:
        """Raise MeshingError unless the hexes are good enough, and positive where asked."""
        worst = scaled_jacobian(hexes.vertices, hexes.hexes).min()
        least = self.cfg["least_jacobian"]
        if worst <= 0 or worst < least:
            needed = f"{least:g} or more, as asked" if worst > 0 else "above 0"
            raise MeshingError(
                f"stage {self.meshing[-1].kind} left a mesh that is not valid: "
                f"smallest scaled Jacobian {worst:.3f}, must be {needed}"
            )
        open_ones = self._not_certified(hexes)
        if len(open_ones):
            middle = hexes.vertices[hexes.hexes[open_ones[0]]].mean(axis=0)
            where = topology.place(self.state["surface"], middle)
            raise MeshingError(
                f"{len(open_ones)} of {len(hexes.hexes)} hexes are not positive everywhere "
                f"(certify=everywhere), the first is number {open_ones[0]} at {where}"
            )

    def _check_places(self, hexes: HexMesh) -> None:
        """Raise InputError for a place that an analysis needs and the boundary has not."""
        for stage in self.solving:
            try:
                check_names(getattr(stage.plugin, "places", ()), hexes.sets)
            except InputError as error:
                raise InputError(
                    f"{stage.kind}: {error}; the mesh is kept, resume={self.folder} from=spline"
                ) from None

    def _not_certified(self, hexes: HexMesh) -> np.ndarray:
        """Hexes that are not positive everywhere, where that is asked for."""
        if self._backend.get("certify") != "everywhere":
            return np.zeros(0, np.int64)
        return np.flatnonzero(~certify(hexes.vertices, hexes.hexes).positive)

    def _score(self, hexes: HexMesh) -> float:
        """Larger is better; a mesh without the certificate asked for loses to any that has it."""
        lacking = len(self._not_certified(hexes)) > 0
        return score(hexes, self.state["surface"]) - INVALID * lacking

    def solve(self) -> None:
        """Spline on the hexes, then the analysis on the spline."""
        for stage in self.solving:
            gives = KINDS[stage.kind].gives
            if self._kept(stage.kind):
                self.state[gives] = load_stage(Path(self.cfg["resume"]), stage.kind)
            else:
                self.state[gives] = self.clock.run(stage.kind, lambda s=stage: s(self.state))
            if gives == "spline":
                spline, hexes = self.state["spline"], self.state["hexes"]
                self.state["spline"] = replace(spline, sets=sets_of_spline(spline, hexes))
            save_stage(self.folder, stage.kind, self.state[gives])

    def _kept(self, stage: str) -> bool:
        """Whether an earlier run's result of this stage is taken."""
        return bool(self.cfg["resume"]) and (
            self.names.index(stage) < self.names.index(self.cfg["from"])
        )

    def _choose(self, index: int) -> None:
        """Make the ranked structure `index` the one that is meshed."""
        entry: Ranked = self.state["ranked"][index]
        candidate = entry.candidate
        self.state |= {
            "chosen": index,
            "polycube": candidate.polycube,
            "rough_map": candidate.rough_map,
            "parametrization": pull_back(self.state["surface"], entry.hexes, entry.positions),
            **self._denoised(candidate.key),
        }

    def _denoised(self, key: str) -> State:
        """Where the diffusion model moved points for this structure, and these made regular."""
        for candidate in (entry.candidate for entry in self.state["ranked"]):
            if candidate.key == key and candidate.trajectory is not None:
                points = self.clock.run(
                    "regularize", lambda c=candidate: self.regularize(c, c.trajectory[-1])
                )
                return {
                    "trajectory": candidate.trajectory,
                    "steps": candidate.steps,
                    "points": points,
                    "read": self._read(candidate),
                }
        return {"trajectory": None, "steps": (), "points": None, "read": None}

    def _read(self, candidate: Candidate) -> Polycube | None:
        """The structure that denoised points lie on by themselves, where it is another."""
        points, supposed = candidate.trajectory[-1], candidate.polycube
        read = read_structure(points, supposed, self.primitives, READ_MARGIN)
        if read is supposed:
            return None
        logger.info(
            "regularize: denoised as %s, the points lie on %s", supposed.context, read.context
        )
        return read

    def _mesh_choices(self, choices: list[int], stages: list[Stage]) -> None:
        surface, ranked = self.state["surface"], self.state["ranked"]

        def starts() -> Iterator[Portfolio]:
            for index in choices:
                if index != self.state["chosen"]:
                    self._choose(index)
                logger.info("meshing structure %d: %s", index, describe(self.state["polycube"]))
                yield Portfolio(
                    stages,
                    self._backend["portfolio"],
                    dict(self.state),
                    self.clock.on(self.state),
                    lambda end: self._score(end["hexes"]),
                    self._backend.get("trial"),
                )

        def is_settled(tried: Portfolio) -> bool:
            if not np.isfinite(tried.best):
                return False
            return tried.best >= enough(ranked, choices, tried.state["chosen"]) and accept(
                tried.end["hexes"], surface
            )

        rival = enough(ranked, choices, choices[0]) > GOOD_SCORE
        found = search(starts(), ENOUGH, is_settled, rival)
        meet(found, self._backend.get("deviation"))
        self.state, path = found.result()
        save_stage(self.folder, "structure", [ranked, self.state["chosen"]])
        for stage, result in zip(stages, path, strict=True):
            save_stage(self.folder, stage.kind, result)


def meshing_stages(meshing: Mapping[str, object], have: tuple[str, ...]) -> list[Stage]:
    """Stages of the backend in its order, the chain from what is there checked."""
    check_chain([*meshing["order"], "spline"], have)
    short = {kind: meshing[kind.removeprefix("meshing/")] for kind in meshing["order"]}
    return build_stages(meshing["order"], short)
