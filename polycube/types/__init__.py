"""Data types that the stages exchange, one module per subject; imports numpy and scipy only.

All are frozen dataclasses whose arrays are checked, copied and locked.  Arrays are float64 and
int64; equal letters in the shapes mean equal lengths.  Lengths are in the user's units and
placement, except on the polycube, whose cell edge is 1.
"""

from polycube.types.checks import freeze
from polycube.types.hexmesh import Candidate, HexMesh, Ranked, Verdict
from polycube.types.plain import Json
from polycube.types.polycube import (
    AXES,
    DRAWN,
    OVERLAY,
    SPARE,
    SWEEP,
    Labels,
    Parametrization,
    PerAxis,
    Polycube,
    RoughMap,
)
from polycube.types.solution import Deformation, Modes, Peak, Potential, Solution
from polycube.types.spline import ElementFunctions, Spline
from polycube.types.surface import Frame, PointImage, TriMesh

__all__ = [
    "AXES",
    "DRAWN",
    "OVERLAY",
    "SPARE",
    "SWEEP",
    "Candidate",
    "Deformation",
    "ElementFunctions",
    "Frame",
    "HexMesh",
    "Json",
    "Labels",
    "Modes",
    "Parametrization",
    "Peak",
    "PerAxis",
    "PointImage",
    "Polycube",
    "Potential",
    "Ranked",
    "RoughMap",
    "Solution",
    "Spline",
    "TriMesh",
    "Verdict",
    "freeze",
]
