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
    """The paper's U-Net: two levels down and two up, 2.3 million parameters at width 64.

    Parameters
    ----------
    width : features at full resolution, a multiple of 8; twice as many further down
    """

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
    """The same U-Net with few features, for tests and short trials."""

    width: int = 8


@register("model", "points")
@dataclass(frozen=True)
class Points:
    """Network on the set of points: shared perceptrons, steered by a summary of all points.

    The order of the points is not used.

    Parameters
    ----------
    width : features of each point
    blocks : perceptrons, each of which follows a new summary
    slots : parts of the summary, which gather from the points and give back to them
    neighbours : points around each that it sees by themselves; needs `denoiser.geometry_channels`
        and `denoiser.normals`; 0: none
    """

    width: int = 128
    blocks: int = 6
    slots: int = 32
    neighbours: int = 0

    any_size = True

    def __call__(
        self, channels: int, outputs: int, context_length: int, image: tuple[int, int]
    ) -> nn.Module:
        """Untrained network; images of any size."""
        from polycube.diffusion.point_network import PointNetwork

        sizes = self.width, self.blocks, self.slots, self.neighbours
        return PointNetwork(channels, outputs, context_length, *sizes)


@register("model", "transformer")
@dataclass(frozen=True)
class Transformer:
    """Network on the set of points in which every point attends to every other.

    The order of the points is not used.

    Parameters
    ----------
    width : features of each point, an even number for each head
    blocks : of attention and a perceptron
    heads : of the attention
    neighbours : points around each that it sees by themselves; needs `denoiser.geometry_channels`
        and `denoiser.normals`; 0: none
    """

    width: int = 96
    blocks: int = 6
    heads: int = 3
    neighbours: int = 0

    any_size = True

    def __call__(
        self, channels: int, outputs: int, context_length: int, image: tuple[int, int]
    ) -> nn.Module:
        """Untrained network; images of any size."""
        from polycube.diffusion.point_transformer import PointTransformer

        sizes = self.width, self.blocks, self.heads, self.neighbours
        return PointTransformer(channels, outputs, context_length, *sizes)
