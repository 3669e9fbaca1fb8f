"""The networks on the set of points."""

from collections.abc import Callable

import pytest
import torch
from torch import Tensor, nn

from polycube.diffusion.point_network import PointNetwork
from polycube.diffusion.point_transformer import Attention, PointTransformer, turned

NETWORKS = {
    "points": lambda channels: PointNetwork(channels, 5, 29, width=16, blocks=2, slots=4),
    "transformer": lambda channels: PointTransformer(channels, 5, 29, 24, blocks=2, heads=2),
}
Make = Callable[[int], nn.Module]


@pytest.fixture(params=NETWORKS)
def make(request: pytest.FixtureRequest) -> Make:
    torch.manual_seed(0)
    return NETWORKS[request.param]


def test_order_of_points_does_not_matter(make: Make) -> None:
    """A permutation of the points permutes the outputs."""
    network = make(6).eval()
    x, t, context = torch.randn(2, 6, 8, 8), torch.rand(2), torch.rand(2, 29)
    order = torch.randperm(64)
    shuffled = x.flatten(2)[:, :, order].reshape(x.shape)
    expected = network(x, t, context).flatten(2)[:, :, order]
    assert torch.allclose(network(shuffled, t, context).flatten(2), expected, atol=1e-5)


def test_other_points_time_and_context_change_the_outputs_of_a_point(make: Make) -> None:
    network = make(3).eval()
    x, t, context = torch.randn(1, 3, 4, 4), torch.zeros(1), torch.zeros(1, 29)
    plain = network(x, t, context)[0, :, 0, 0]
    moved = x.clone()
    moved[..., 1:] += 1
    for args in ((moved, t, context), (x, t + 1, context), (x, t, context + 1)):
        assert (network(*args)[0, :, 0, 0] - plain).abs().max() > 1e-4


def test_every_parameter_is_trained(make: Make) -> None:
    network = make(3)
    network(torch.randn(2, 3, 4, 4), torch.rand(2), torch.rand(2, 29)).square().mean().backward()
    assert all(p.grad is not None for p in network.parameters())


def angles(places: Tensor) -> Tensor:
    angle = (places[..., None] * torch.tensor([1.0, 2.0])).flatten(2)
    return torch.stack([angle.cos(), angle.sin()])[:, :, None]


def test_attention_depends_on_relative_positions_only() -> None:
    torch.manual_seed(0)
    attention, x, places = Attention(24, heads=2), torch.randn(2, 7, 24), torch.randn(2, 7, 3)
    expected = attention(x, angles(places))
    moved = places + torch.tensor([0.3, -1.0, 2.0])
    assert torch.allclose(attention(x, angles(moved)), expected, atol=1e-5)
    assert not torch.allclose(attention(x, angles(2 * places)), expected, atol=1e-3)


def test_turning_keeps_lengths() -> None:
    torch.manual_seed(0)
    x, turn = torch.randn(1, 2, 7, 12), angles(torch.randn(1, 7, 3))
    assert torch.allclose(turned(x, turn).norm(dim=-1), x.norm(dim=-1), atol=1e-5)


def test_width_of_a_transformer_is_even_for_each_head() -> None:
    with pytest.raises(ValueError, match="must be a multiple of 8; got 36"):
        PointTransformer(9, 16, 5, 36, blocks=1, heads=4)
