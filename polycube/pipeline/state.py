"""What a run has made so far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

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
    """The data that flows from step to step; a step returns a new state.

    What was not made yet is None, or empty.  Stages take and give the fields that
    `polycube.kinds.KINDS` names.

    Parameters
    ----------
    surface : the part, checked and repaired where that was asked for
    path, warnings : where the surface came from, and what the reader has to say of it
    repair : numbers of the repair
    points : numbers of the reconstruction from a point cloud
    given, hex_path : a hex mesh to improve, and its file
    ranked, chosen : proposed structures, best first, and the number of the one that is meshed
    polycube, rough_map, parametrization : of that structure
    blocks : hexes of that structure, where it has its own
    trajectory, steps : (S, N, 3) states of the denoising and (S,) their steps
    denoised_on : the polycube that the denoised points lie on, where it is another one
    labels : of the surface, by the faces of the polycube
    hexes, spline, solution : the results
    verdict : of the acceptance, on the hexes
    unfitted : why the hexes are fitted only in part, and how far they are off
    failure : why there is no valid result
    stopped : why meshing ended early, with the best valid mesh until then
    interrupted : whether a user ended the run
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
