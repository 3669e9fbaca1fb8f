"""Every network takes what the denoiser gives it."""

import pytest
import torch

from polycube.registry import build, names


@pytest.mark.parametrize("name", names("model"))
@pytest.mark.parametrize("channels", [3, 9])
def test_every_model_maps_images_to_images(name: str, channels: int) -> None:
    network = build("model", {"plugin": name})(channels, 13, 29, (16, 32)).eval()
    x = torch.zeros(2, channels, 16, 32)
    assert network(x, torch.tensor([0.0, 1.0]), torch.zeros(2, 29)).shape == (2, 13, 16, 32)


def test_tiny_is_small() -> None:
    unet, tiny = (build("model", {"plugin": n})(6, 3, 29, (32, 32)) for n in ("unet", "tiny"))
    sizes = [sum(p.numel() for p in network.parameters()) for network in (unet, tiny)]
    assert sizes[0] == 2282307 and sizes[1] < sizes[0] / 20
