"""The state of a run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from polycube.types import (
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


@dataclass(frozen=True, eq=False)
class RunState:
    """The data passed from step to step; a step returns a new state.

    Fields that are not computed yet are None or empty. Stages have the fields given in
    `polycube.kinds.KINDS` as input and output.

    Parameters
    ----------
    surface : the part, checked and repaired on request
    path, warnings : origin of the surface, and warnings of the reader
    repair : numbers of the repair
    points : numbers of the reconstruction from a point cloud
    given, hex_path : a hex mesh to improve, and its file
    ranked, chosen : proposed structures, best first, and the number of the meshed one
    polycube, rough_map, parametrization : of that structure
    blocks : hexes of that structure, if it has its own
    trajectory, steps : (S, N, 3) states of the denoising and (S,) their steps
    denoised_on : polycube of the denoised points, if it is another one
    labels : labels of the surface, the faces of the polycube
    hexes, spline, solution : the results
    verdict : result of the acceptance for the hexes
    unfitted : why the hexes are only partly fitted, and their deviation
    failure : reason why there is no valid result
    stopped : reason why meshing ended early with the best valid mesh
    interrupted : whether the user ended the run
    moves : what the search tried, see `polycube.search.history.Tried`
    """

    surface: TriMesh
    path: str = ""
    warnings: tuple[str, ...] = ()
    repair: Mapping[str, object] | None = None
    points: Mapping[str, object] | None = None
    given: HexMesh | None = None
    hex_path: str = ""
    ranked: Sequence[Ranked] = ()
    chosen: int = 0
    polycube: Polycube | None = None
    rough_map: RoughMap | None = None
    parametrization: Parametrization | None = None
    blocks: HexMesh | None = None
    trajectory: np.ndarray | None = None
    steps: tuple[int, ...] = ()
    denoised_on: Polycube | None = None
    labels: Labels | None = None
    hexes: HexMesh | None = None
    spline: Spline | None = None
    solution: Solution | None = None
    verdict: Verdict | None = None
    unfitted: str | None = None
    failure: str | None = None
    stopped: str | None = None
    interrupted: bool = False
    moves: tuple[Any, ...] = ()
