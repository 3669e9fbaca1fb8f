"""Data types exchanged by the stages; imports numpy and scipy only.

All types are frozen dataclasses. Their arrays are checked, copied and made read-only; they are
float64 or int64. Equal letters in shapes mean equal lengths. Coordinates are in the user's units
and placement, except on the polycube, where a grid cell has edges of length 1.
"""

from polycube.types.checks import Json, check_values
from polycube.types.goal import Goal
from polycube.types.hexmesh import Candidate, HexMesh, Ranked, Tier, Verdict
from polycube.types.polycube import AXES, Labels, Parametrization, PerAxis, Polycube, RoughMap
from polycube.types.solution import Deformation, Modes, Peak, Potential, Solution
from polycube.types.spline import ElementFunctions, Spline
from polycube.types.surface import Frame, TriMesh
