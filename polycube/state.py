"""The state of a run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from polycube import types


@dataclass(frozen=True, eq=False)
class RunState:
    """The data passed from step to step; a step returns a new state.

    Fields that are not computed yet are None or empty. Stages have the fields given in
    `polycube.kinds.KINDS` as input and output.
    """

    surface: types.TriMesh  # the part, checked and repaired on request
    path: str = ""  # origin of the surface
    warnings: tuple[str, ...] = ()  # warnings of the reader
    repair: Mapping[str, object] | None = None  # numbers of the repair
    points: Mapping[str, object] | None = None  # numbers of the reconstruction from a point cloud
    given: types.HexMesh | None = None  # a hex mesh to improve
    hex_path: str = ""  # its file
    ranked: Sequence[types.Ranked] = ()  # proposed structures, best first
    chosen: int = 0  # number of the meshed one
    polycube: types.Polycube | None = None  # of the chosen structure, as the next three
    rough_map: types.RoughMap | None = None
    parametrization: types.Parametrization | None = None
    blocks: types.HexMesh | None = None  # its hexes, if it has its own
    trajectory: np.ndarray | None = None  # (S, N, 3) states of the denoising
    steps: tuple[int, ...] = ()  # (S,) their steps
    denoised_on: types.Polycube | None = None  # that of the denoised points, if it is another
    labels: types.Labels | None = None  # labels of the surface, the faces of the polycube
    hexes: types.HexMesh | None = None
    spline: types.Spline | None = None
    solution: types.Solution | None = None
    verdict: types.Verdict | None = None  # result of the acceptance for the hexes
    unfitted: str | None = None  # why the hexes are only partly fitted, and their deviation
    failure: str | None = None  # reason why there is no valid result
    stopped: str | None = None  # reason why meshing ended early with the best valid mesh
    interrupted: bool = False  # whether the user ended the run
    moves: tuple[Any, ...] = ()  # what the search tried, see `polycube.search.history.Tried`
