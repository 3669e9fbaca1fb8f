"""The kinds of plugin, and how the stages chain.  Read this page first.

kind = Hydra group = folder = test name.  A plugin is a frozen dataclass of its options with one
typed method, `__call__`.  The `Protocol` of its kind says what the method takes and returns, and
which other members the program uses; a plugin that inherits from it gets their defaults.  A stage
kind also says which fields of the run state it takes and which one it gives.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np

from polycube.analysis.problem import Problem
from polycube.errors import InputError
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
    TriMesh,
    Verdict,
)


class Primitive(Protocol):
    """Voxels of a unit cell."""

    def __call__(self) -> np.ndarray:
        """(3, 3, 3) bool, True where the cell is full."""


class Schedule(Protocol):
    """Noise schedule."""

    def __call__(self) -> np.ndarray:
        """(T + 1,) alpha_bar, from 1 down."""


class Model(Protocol):
    """Network: (channels, outputs, context length, image) -> torch module."""

    any_size: ClassVar[bool] = False  # whether it takes images of any size

    def __call__(self, channels: int, outputs: int, context: int, image: tuple[int, int]) -> object:
        """A torch module (x (B, channels, h, w), t (B,), context) -> (B, outputs, h, w)."""


class Sampler(Protocol):
    """Reverse diffusion: x_T -> x_0, with the states in between for the trajectory."""

    def __call__(self, *args: object, **options: object) -> object:
        """See `polycube.testing.learning` for what is promised."""


class Data(Protocol):
    """Training pairs: an endless, seeded stream of geometry, polycube, labels and context."""

    pads: bool  # single cells have 512 points and zeros, as published
    gridless: ClassVar[bool] = False  # its pairs are of any structure, for grid=any alone

    def __call__(self, *args: object, **options: object) -> object:
        """See `polycube.testing.learning` for what is promised."""

    def held_out(self, *args: object, **options: object) -> object:
        """The pairs by which a training is measured; by default others of the same kind."""
        return self(*args, **options)


class Structure(Protocol):
    """Propose polycubes for a surface."""

    any_grid: ClassVar[bool] = False  # proposals do not depend on the grid
    needs_network: ClassVar[bool] = False  # proposes with trained weights

    def __call__(self, surface: TriMesh, candidates: tuple[Candidate, ...]) -> Sequence[Candidate]:
        """New candidates; `candidates` are those of the plugins before."""


class Ranking(Protocol):
    """Order proposed structures by how well they fit the surface."""

    def __call__(self, surface: TriMesh, candidates: Iterable[Candidate]) -> list[Ranked]:
        """Candidates of the surface's genus, best first."""


class Acceptance(Protocol):
    """Judge a hex mesh against the surface that it was made for."""

    good: float  # scaled Jacobian that ends the search, in a mesh that misses nothing
    acceptable: float  # with which no other structure is tried, where there is no warning
    excellent: float  # with which not even a structure that ranks as well is tried
    poor_jacobian: float  # a mesh with a smaller one has a warning

    def __call__(self, hexes: HexMesh, surface: TriMesh) -> Verdict:
        """Whether the mesh is valid, what a user should look at, and a key to choose by."""


class Segment(Protocol):
    """Label the surface with the faces of the polycube."""

    def __call__(
        self, surface: TriMesh, polycube: Polycube, parametrization: Parametrization
    ) -> Labels:
        """One label per triangle."""


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
        """A map whose boundary lies on the surface."""


@runtime_checkable
class Subdivide(Protocol):
    """Cut the polycube into hexes and place them."""

    def finer_options(self, times: float) -> Mapping[str, object] | None:
        """Options that make the hexes so many times smaller; None where their number is fixed."""

    def __call__(
        self, surface: TriMesh, polycube: Polycube, rough_map: RoughMap, blocks: HexMesh | None
    ) -> HexMesh:
        """Conforming hexes, not yet on the surface: of the blocks where the structure has such."""


@runtime_checkable
class CountsHexes(Protocol):
    """A subdivision that takes numbers of hexes at faces of the part, `at`."""

    at: Sequence[object]

    def count_options(self, missing: Sequence[int]) -> Mapping[str, object] | None:
        """Options for so many hexes more, or fewer where negative, at each entry of `at`; None
        where their number is fixed.
        """


@runtime_checkable
class FollowsCreases(Protocol):
    """A subdivision that makes finer hexes along the sharp edges of the surface."""

    def crease_options(self, distance: float) -> Mapping[str, object] | None:
        """Options for mesh edges within this share of the diagonal of the sharp edges; None where
        the number of hexes is fixed.
        """


class Improve(Protocol):
    """Change a hex mesh: smooth, pillow, optimize or refine it."""

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> HexMesh:
        """The new mesh, or the same object where nothing was to be done."""


class SplineSpace(Protocol):
    """Build a volumetric spline on the hexes."""

    def __call__(self, surface: TriMesh, hexes: HexMesh) -> Spline:
        """A spline whose boundary follows the surface."""


class Analysis(Protocol):
    """Solve a problem on the spline."""

    @property
    def places(self) -> Sequence[object]:
        """Parts of the boundary that the options name."""
        return ()

    def __call__(self, spline: Spline) -> Solution:
        """The solution."""


@runtime_checkable
class StatesProblem(Protocol):
    """An analysis that says what it solves, for the decks of other programs."""

    @property
    def problem(self) -> Problem:
        """Material, supports and loads."""


class Export(Protocol):
    """Write the hex mesh in the format of another program.

    A plugin may have the fields `spline` and `problem`, declared by
    `field(default=None, metadata=polycube.registry.BY_RUN)`: a run fills in what it has.
    """

    suffix: ClassVar[str]  # of its files, such as ".inp"

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        """The file that was written: `path` with the suffix of the format."""


@dataclass(frozen=True)
class Kind:
    """A kind of plugin; for a stage also what it takes and gives.

    Parameters
    ----------
    protocol : what a plugin of the kind can do
    takes, gives : fields of `polycube.pipeline.state.RunState`
    once : run at the end of the chain only, on the best mesh of the search
    fits : the hexes that it gives lie on the surface
    """

    protocol: type
    takes: tuple[str, ...] = ()
    gives: str = ""
    once: bool = False
    fits: bool = True

    @property
    def does(self) -> str:
        """The kind in one line."""
        return (self.protocol.__doc__ or "").partition("\n")[0].rstrip(".")


_MESH = ("surface", "hexes")

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
    # the stages of a run, in their natural order
    "meshing/segment": Kind(Segment, ("surface", "polycube", "parametrization"), "labels"),
    "meshing/map": Kind(
        Map, ("surface", "polycube", "labels", "parametrization", "rough_map"), "rough_map"
    ),
    "meshing/subdivide": Kind(
        Subdivide, ("surface", "polycube", "rough_map", "blocks"), "hexes", fits=False
    ),
    "meshing/smooth": Kind(Improve, _MESH, "hexes"),
    "meshing/pillow": Kind(Improve, _MESH, "hexes"),
    "meshing/optimize": Kind(Improve, _MESH, "hexes"),
    "meshing/cure": Kind(Improve, _MESH, "hexes"),
    "meshing/refine": Kind(Improve, _MESH, "hexes", once=True),
    "spline": Kind(SplineSpace, _MESH, "spline"),
    "analysis": Kind(Analysis, ("spline",), "solution"),
    # what comes out
    "export": Kind(Export),
}

STAGES = tuple(name for name, kind in KINDS.items() if kind.gives)
RESULTS = ("hexes", "spline", "solution")  # outputs that need no later stage to be of use


def check_chain(order: Sequence[str], have: Iterable[str]) -> None:
    """Check that every stage has its inputs and that every output is used.

    Parameters
    ----------
    order : kinds of stages, in the order in which they run
    have : fields of the run state that are there before the first

    Raises
    ------
    InputError
        Naming the first stage that is unknown, lacks an input or makes what nobody takes.
    """
    present = set(have)
    for number, stage in enumerate(order):
        if stage not in STAGES:
            raise InputError(f"{stage!r} is not a stage; the stages are {', '.join(STAGES)}")
        kind = KINDS[stage]
        missing = [name for name in kind.takes if name not in present]
        if missing:
            raise InputError(
                f"stage {stage!r} needs {', '.join(missing)}, which no earlier stage makes"
                f"{_hint(missing)}"
            )
        rest = [KINDS[each] for each in order[number + 1 :] if each in KINDS]
        if kind.gives not in {*RESULTS, *(name for each in rest for name in each.takes)}:
            raise InputError(
                f"stage {stage!r} makes {kind.gives}, which no later stage uses; remove it"
            )
        present.add(kind.gives)


def _hint(missing: Sequence[str]) -> str:
    """Which stages to put before one that lacks something."""
    makers = [
        name for name in STAGES if KINDS[name].gives in missing and not _passes_on(KINDS[name])
    ]
    return f"; put {' or '.join(makers)} before it" if makers else ""


def _passes_on(kind: Kind) -> bool:
    return kind.gives in kind.takes
