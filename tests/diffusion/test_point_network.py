"""The network on the set of points."""

import torch

from polycube.diffusion.point_network import PointNetwork


def test_order_of_points_does_not_matter() -> None:
    """Moving the points about in the image moves the answers with them."""
    torch.manual_seed(0)
    network = PointNetwork(6, 5, 29, width=16, blocks=2, slots=4).eval()
    x, t, context = torch.randn(2, 6, 8, 8), torch.rand(2), torch.rand(2, 29)
    order = torch.randperm(64)
    shuffled = x.flatten(2)[:, :, order].reshape(x.shape)
    expected = network(x, t, context).flatten(2)[:, :, order]
    assert torch.allclose(network(shuffled, t, context).flatten(2), expected, atol=1e-5)


def test_other_points_time_and_context_change_the_answer_for_a_point() -> None:
    torch.manual_seed(0)
    network = PointNetwork(3, 5, 29, width=16, blocks=2, slots=4).eval()
    x, t, context = torch.randn(1, 3, 4, 4), torch.zeros(1), torch.zeros(1, 29)
    plain = network(x, t, context)[0, :, 0, 0]
    moved = x.clone()
    moved[..., 1:] += 1
    for args in ((moved, t, context), (x, t + 1, context), (x, t, context + 1)):
        assert (network(*args)[0, :, 0, 0] - plain).abs().max() > 1e-4


def test_every_parameter_is_trained() -> None:
    network = PointNetwork(3, 5, 29, width=16, blocks=2, slots=4)
    network(torch.randn(2, 3, 4, 4), torch.rand(2), torch.rand(2, 29)).square().mean().backward()
    assert all(p.grad is not None for p in network.parameters())
