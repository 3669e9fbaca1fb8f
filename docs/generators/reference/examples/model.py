from dataclasses import dataclass
from typing import Any

from polycube.registry import register


@register("model", "pointwise")
@dataclass(frozen=True)
class Pointwise:
    """A perceptron for each point, with the time and the context as further inputs.

    Parameters
    ----------
    width : number of features
    """

    width: int = 64
    any_size = True

    def __call__(self, channels: int, outputs: int, context_length: int, image: Any) -> Any:
        import torch
        from torch import nn

        class Network(nn.Module):
            def __init__(self, width: int) -> None:
                super().__init__()
                size = channels + 1 + context_length
                layers = nn.Conv2d(size, width, 1), nn.SiLU(), nn.Conv2d(width, outputs, 1)
                self.layers = nn.Sequential(*layers)

            def forward(self, x: Any, time: Any, context: Any) -> Any:
                given = torch.cat([time[:, None], context], dim=1)[..., None, None]
                return self.layers(torch.cat([x, given.expand(-1, -1, *x.shape[2:])], dim=1))

        return Network(self.width)
