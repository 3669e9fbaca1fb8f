"""The U-Net of the paper (section 3.3): residual blocks, two levels down, two up.

Context and time are embedded by small fully connected layers and enter on the way up: features ->
context * features + time.
"""

import torch
from torch import Tensor, nn

from polycube.diffusion.point_network import perceptron


class ResidualBlock(nn.Module):
    """Two 3x3 convolutions with batch norm and GELU, plus a shortcut (1x1 if channels change)."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.first = _convolution(inputs, outputs)
        self.second = _convolution(outputs, outputs)
        self.shortcut = nn.Identity() if inputs == outputs else nn.Conv2d(inputs, outputs, 1)

    def forward(self, x: Tensor) -> Tensor:
        """(B, inputs, height, width) -> (B, outputs, height, width)."""
        return (self.shortcut(x) + self.second(self.first(x))) / 2**0.5


def _convolution(inputs: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 3, padding=1), nn.BatchNorm2d(outputs), nn.GELU()
    )


class Down(nn.Sequential):
    """Two residual blocks and max-pooling: half the height and width."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__(
            ResidualBlock(inputs, outputs), ResidualBlock(outputs, outputs), nn.MaxPool2d(2)
        )


class Up(nn.Module):
    """Transposed convolution with ReLU, the skip connection, and two residual blocks."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.blocks = nn.Sequential(
            nn.ConvTranspose2d(inputs, outputs, 2, stride=2),
            nn.ReLU(),
            ResidualBlock(outputs, outputs),
            ResidualBlock(outputs, outputs),
        )

    def forward(self, x: Tensor, skip: Tensor) -> Tensor:
        """Doubles the height and width of x and skip, which are equal."""
        return self.blocks(torch.cat([x, skip], dim=1))


def _embedding(inputs: int, outputs: int) -> nn.Sequential:
    """(B, inputs) -> (B, outputs, 1, 1): a vector as one number per channel."""
    return nn.Sequential(*perceptron(inputs, outputs, outputs), nn.Unflatten(1, (-1, 1, 1)))


class UNet(nn.Module):
    """(x (B, channels, h, w), t in [0, 1] (B,), context (B, K)) -> (B, outputs, h, w).

    Height and width are multiples of 4; `width` is the number of features at full resolution.
    """

    def __init__(
        self,
        channels: int,
        outputs: int,
        context_length: int,
        width: int = 64,
        image: tuple[int, int] = (32, 32),
    ) -> None:
        super().__init__()
        bottom = (image[0] // 4, image[1] // 4)
        self.enter = ResidualBlock(channels, width)
        self.down1 = Down(width, width)
        self.down2 = Down(width, 2 * width)
        self.summary = nn.Sequential(nn.AdaptiveAvgPool2d(1), nn.GELU())
        self.up0 = nn.Sequential(
            nn.ConvTranspose2d(2 * width, 2 * width, bottom), nn.GroupNorm(8, 2 * width), nn.ReLU()
        )
        self.time1, self.time2 = _embedding(1, 2 * width), _embedding(1, width)
        self.context1 = _embedding(context_length, 2 * width)
        self.context2 = _embedding(context_length, width)
        self.up1 = Up(4 * width, width)
        self.up2 = Up(2 * width, width)
        self.leave = nn.Sequential(
            nn.Conv2d(2 * width, width, 3, padding=1),
            nn.GroupNorm(8, width),
            nn.ReLU(),
            nn.Conv2d(width, outputs, 3, padding=1),
        )

    def forward(self, x: Tensor, t: Tensor, context: Tensor) -> Tensor:
        """The trained outputs, per pixel."""
        t = t[:, None].to(x)
        entered = self.enter(x)  # (B, width, h, w)
        down1 = self.down1(entered)  # (B, width, h / 2, w / 2)
        down2 = self.down2(down1)  # (B, 2 width, h / 4, w / 4)
        up = self.up0(self.summary(down2))  # (B, 2 width, h / 4, w / 4)
        up = self.up1(self.context1(context) * up + self.time1(t), down2)
        up = self.up2(self.context2(context) * up + self.time2(t), down1)
        return self.leave(torch.cat([up, entered], dim=1))
