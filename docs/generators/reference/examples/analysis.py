from dataclasses import dataclass

from polycube.kinds import Analysis
from polycube.registry import register
from polycube.types import Modes, Spline


@register("analysis", "free_modes")
@dataclass(frozen=True)
class FreeModes(Analysis):
    """Vibration modes of the free steel solid.

    Parameters
    ----------
    number : number of modes, with the six rigid ones
    """

    number: int = 10

    def __call__(self, spline: Spline) -> Modes:
        from polycube.analysis.modal import free_modes
        from polycube.analysis.problem import MATERIALS

        return free_modes(spline, MATERIALS["steel"], self.number)
