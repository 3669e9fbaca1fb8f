"""Networks: torch modules (x (B, channels, h, w), t in [0, 1], context) -> (B, outputs, h, w)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from polycube.registry import register

if TYPE_CHECKING:
    from torch import nn


@register("model", "unet")
@dataclass(frozen=True)
class PublishedUNet:
    """The paper's U-Net: 64 -> 128 features, two levels down and two up."""

    width: int = 64

    any_size = False  # of images: it is made for one

    def __call__(
        self, channels: int, outputs: int, context_length: int, image: tuple[int, int]
    ) -> nn.Module:
        """Untrained network for images of the given (height, width)."""
        from polycube.diffusion.unet import UNet  # torch is heavy

        return UNet(channels, outputs, context_length, self.width, image)


@register("model", "tiny")
@dataclass(frozen=True)
class Tiny(PublishedUNet):
    """The same network with few features, for trying things out."""

    width: int = 8


@register("model", "points")
@dataclass(frozen=True)
class Points:
    """A network on the set of points: perceptrons shared by all, steered by a summary of all."""

    width: int = 128
    blocks: int = 6
    slots: int = 32

    any_size = True

    def __call__(
        self, channels: int, outputs: int, context_length: int, image: tuple[int, int]
    ) -> nn.Module:
        """Untrained network; images of any size."""
        from polycube.diffusion.point_network import PointNetwork

        return PointNetwork(channels, outputs, context_length, self.width, self.blocks, self.slots)
