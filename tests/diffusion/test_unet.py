"""The network: size, shapes, and that every input matters."""

import pytest
import torch

from polycube.diffusion.unet import ResidualBlock, UNet


def test_published_size() -> None:
    """About 2.3 million parameters with three or six channels in."""
    sizes = [sum(p.numel() for p in UNet(channels, 3, 29).parameters()) for channels in (3, 6)]
    assert sizes == [2280387, 2282307]


@pytest.mark.parametrize("image", [(16, 32), (32, 32), (48, 64)])
def test_keeps_the_size_of_the_image(image: tuple[int, int]) -> None:
    network = UNet(6, 5, 29, width=8, image=image).eval()
    x = torch.zeros(2, 6, *image)
    assert network(x, torch.zeros(2), torch.zeros(2, 29)).shape == (2, 5, *image)


def test_time_and_context_change_the_result() -> None:
    torch.manual_seed(0)
    network = UNet(3, 3, 29, width=8).eval()
    x, t, context = torch.randn(1, 3, 32, 32), torch.zeros(1), torch.zeros(1, 29)
    plain = network(x, t, context)
    assert (network(x, t + 1, context) - plain).abs().max() > 1e-4
    assert (network(x, t, context + 1) - plain).abs().max() > 1e-4


def test_every_parameter_is_trained_and_shortcuts_are_parameters() -> None:
    network = UNet(3, 3, 29, width=8)
    x, t, context = torch.randn(2, 3, 32, 32), torch.rand(2), torch.rand(2, 29)
    network(x, t, context).square().mean().backward()
    assert all(p.grad is not None for p in network.parameters())
    assert any(name.endswith("shortcut.weight") for name, _ in network.named_parameters())


def test_block_without_convolutions_is_its_shortcut() -> None:
    block = ResidualBlock(4, 4).eval()
    for parameter in block.second.parameters():
        torch.nn.init.zeros_(parameter)
    x = torch.randn(1, 4, 8, 8)
    assert torch.allclose(block(x), x / 2**0.5)
