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
    width : number of features at full resolution, a multiple of 8; the lower levels have twice as
        many
    """

    width: int = 64

    any_size = False  # for images of one size

    def __call__(
        self, channels: int, outputs: int, context_length: int, image: tuple[int, int]
    ) -> nn.Module:
        """Untrained network for images of the given (height, width)."""
        from polycube.diffusion.unet import UNet  # torch takes long to import

        return UNet(channels, outputs, context_length, self.width, image)


@register("model", "tiny")
@dataclass(frozen=True)
class Tiny(PublishedUNet):
    """The same U-Net with few features, for tests and short trials."""

    width: int = 8


@register("model", "points")
@dataclass(frozen=True)
class Points:
    """Network on a set of points: a shared perceptron that also receives a summary of the set.

    The result does not depend on the order of the points.

    Parameters
    ----------
    width : number of features of each point
    blocks : number of blocks, each with a new summary and a perceptron
    slots : number of vectors of the summary; they attend to the points, and the points to them
    neighbours : number of nearest points that are an additional input of each point; needs
        `denoiser.geometry_channels` and `denoiser.normals`; 0: none
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
    """Network on a set of points with attention between all pairs of points.

    The result does not depend on the order of the points.

    Parameters
    ----------
    width : number of features of each point, an even number for each head
    blocks : number of blocks of attention and perceptron
    heads : number of attention heads
    neighbours : number of nearest points that are an additional input of each point; needs
        `denoiser.geometry_channels` and `denoiser.normals`; 0: none
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
