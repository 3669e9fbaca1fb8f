"""The kinds of plugin and the chain of stages. Read this module first.

The name of a kind is also that of a Hydra group, a folder and a test. A plugin is a frozen
dataclass of its options with one typed method, `__call__`. The `Protocol` of its kind defines the
arguments and the result of this method, and other members that the program uses; a plugin that
inherits from the protocol has their defaults. The kind of a stage also defines which fields of the
run state are its inputs, and which one is its output.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from inspect import signature
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from polycube.analysis.problem import Problem
from polycube.diffusion.protocols import Data, Model, Sampler, Schedule
from polycube.types import (
    Candidate,
    HexMesh,
    Labels,
    Parametrization,
    Polycube,
    Ranked,
    RoughMap,
    Solution,
    Spline,
    Tier,
    TriMesh,
    Verdict,
)


class Primitive(Protocol):
    """Voxels of a unit cell."""

    def __call__(self) -> np.ndarray:
        """(3, 3, 3) bool voxels of the cell, True where it is full."""


class Structure(Protocol):
    """Propose polycubes for a surface."""

    any_grid: ClassVar[bool] = False  # proposals do not depend on the grid
    needs_network: ClassVar[bool] = False  # the plugin needs trained weights
    tier: ClassVar[Tier] = Tier.COARSE  # structures of a lower tier are proposed earlier

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> Sequence[Candidate]:
        """New candidates; `candidates` are those of the previous plugins."""


class Ranking(Protocol):
    """Order proposed structures by how well they fit the surface."""

    def __call__(self, surface: TriMesh, candidates: Iterable[Candidate]) -> list[Ranked]:
        """Candidates with the genus of the surface, best first."""


class Acceptance(Protocol):
    """Decide whether a hex mesh of a surface is valid, and which of two meshes is better."""

    def __call__(self, hexes: HexMesh, surface: TriMesh) -> Verdict:
        """Failures, warnings, the distance from the goal, and a key for the comparison."""


class Expected(NamedTuple):
    """What is expected of a move of the search."""

    gain: float  # expected reduction of the shortfall of the best mesh (`polycube.types.Verdict`)
    work: float  # expected effort, about the seconds that it takes on one core


class Estimate(Protocol):
    """Estimate what a move of the search gains, and what it costs."""

    def __call__(self, move: Any, history: Any) -> Expected:
        """Expected gain and work of a `Move`; both are classes of `polycube.search.history`."""


class Policy(Protocol):
    """Choose the next move of the search for a mesh."""

    def __call__(
        self, history: Any, possible: Callable[[], Sequence[Any]]
    ) -> Iterator[tuple[Any, Expected]]:
        """Moves, one after another, until none is worth its cost.

        Parameters
        ----------
        history : what is known, a `polycube.search.history.History` that every move extends
        possible : the moves that can be made now
        """


class Segment(Protocol):
    """Label the surface with the faces of the polycube."""

    def __call__(
        self, surface: TriMesh, polycube: Polycube, parametrization: Parametrization
    ) -> Labels:
        """One label for each triangle."""


class Map(Protocol):
    """Map the polycube onto the surface, chart by chart."""

    def __call__(
        self,
        surface: TriMesh,
        polycube: Polycube,
        labels: Labels,
        parametrization: Parametrization,
        rough_map: RoughMap,
    ) -> RoughMap:
        """A map with its boundary on the surface."""


class Subdivide(Protocol):
    """Cut the polycube into hexes and place them.

    The search repeats a mesh with the options that other methods return. They return None, and need
    not be defined, if the plugin does not support this.
    """

    def finer_options(self, times: float) -> Mapping[str, object] | None:
        """Options that make the hexes `times` smaller."""
        return None

    def count_options(self, missing: Sequence[int]) -> Mapping[str, object] | None:
        """Options for `missing` additional hexes (fewer if negative) at each entry of its option
        `at`: numbers of hexes at faces of the part.
        """
        return None

    def crease_options(self, distance: float) -> Mapping[str, object] | None:
        """Options for a distance between mesh edges and sharp edges, as a share of the diagonal."""
        return None

    def __call__(
        self, surface: TriMesh, polycube: Polycube, rough_map: RoughMap, blocks: HexMesh | None
    ) -> HexMesh:
        """Conforming hexes that are not on the surface yet; made from `blocks` if there are any."""


class Improve(Protocol):
    """Change a hex mesh: smooth, pillow, optimize or refine it."""

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        """The new mesh, or the same object if there is nothing to do."""


class SplineSpace(Protocol):
    """Build a volumetric spline on the hexes.

    A plugin may have a field `analysis`, declared like those of an `Export`: a run with an analysis
    sets it to the function that solves it on a spline with named boundary sets.
    """

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> Spline | tuple[Spline, Solution]:
        """A spline whose boundary follows the surface; and its solution, if it was computed."""


class Analysis(Protocol):
    """Solve a problem on the spline."""

    @property
    def problem(self) -> Problem | None:
        """Material, supports and loads, for input files of other solvers; None if not known."""
        return None

    @property
    def places(self) -> Sequence[object]:
        """Boundary sets that the options refer to."""
        return self.problem.places if self.problem else ()

    def __call__(self, spline: Spline) -> Solution:
        """The solution."""


class Export(Protocol):
    """Write the hex mesh in the format of another program.

    A plugin may have the fields `spline` and `problem`, declared by `field(default=None,
    metadata=polycube.registry.BY_RUN)`: a run sets them if it has a spline or a problem. That
    of an assembly is only for plugins whose attribute `states_assemblies` is true.
    """

    suffix: ClassVar[str]  # suffix of the files, such as ".inp"

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """The path of the written file: `path` with the suffix of the format."""


@dataclass(frozen=True)
class Kind:
    """A kind of plugin; for a stage also its inputs and its output."""

    protocol: type  # interface of the plugins
    gives: str = ""  # output of a stage, a field of `polycube.state.RunState`
    # whether the stage, and those after it, run only on meshes that are expected to lead then
    cures: bool = False
    once: bool = False  # whether the stage runs only once, on the best mesh of the search
    fits: bool = True  # whether the boundary of the resulting hexes is on the surface

    @cached_property
    def takes(self) -> tuple[str, ...]:
        """Inputs of a stage, fields of the run state: the arguments of its plugins."""
        _, *names = signature(self.protocol.__call__).parameters
        return tuple(names) if self.gives else ()


KINDS = {
    # the learning half
    "primitive": Kind(Primitive),
    "schedule": Kind(Schedule),
    "model": Kind(Model),
    "sampler": Kind(Sampler),
    "data": Kind(Data),
    # what the search calls
    "structure": Kind(Structure),
    "ranking": Kind(Ranking),
    "acceptance": Kind(Acceptance),
    "estimate": Kind(Estimate),
    "policy": Kind(Policy),
    # the stages of a run, in their natural order
    "meshing/segment": Kind(Segment, "labels"),
    "meshing/map": Kind(Map, "rough_map"),
    "meshing/subdivide": Kind(Subdivide, "hexes", fits=False),
    "meshing/smooth": Kind(Improve, "hexes"),
    "meshing/pillow": Kind(Improve, "hexes"),
    "meshing/optimize": Kind(Improve, "hexes"),
    "meshing/cure": Kind(Improve, "hexes", cures=True),
    "meshing/refine": Kind(Improve, "hexes", once=True),
    "spline": Kind(SplineSpace, "spline"),
    "analysis": Kind(Analysis, "solution"),
    # what comes out
    "export": Kind(Export),
}

STAGES = tuple(name for name, kind in KINDS.items() if kind.gives)
