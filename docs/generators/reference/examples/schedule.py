from dataclasses import dataclass

import numpy as np

from polycube.registry import register


@register("schedule", "quartic")
@dataclass(frozen=True)
class Quartic:
    """alpha_bar falls with the fourth power of the time.

    Parameters
    ----------
    steps : T, the number of diffusion steps
    last : alpha_bar at the end
    """

    steps: int = 500
    last: float = 0.01

    def __call__(self) -> np.ndarray:
        return 1 - (1 - self.last) * np.linspace(0, 1, self.steps + 1) ** 4
