from dataclasses import dataclass
from typing import Any

from polycube.registry import register


@register("sampler", "direct")
@dataclass(frozen=True)
class Direct:
    """One prediction of x_0 from x_T."""

    def __call__(self, predict: Any, x_T: Any, process: Any, generator: Any) -> tuple[Any, Any]:
        import torch

        x_0 = predict(x_T, process.steps)
        return x_0, torch.stack([x_T, x_0])
