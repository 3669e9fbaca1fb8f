"""Denoising with networks whose answer is known."""

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from polycube.diffusion.denoiser import Denoiser, DenoiserOptions
from polycube.diffusion.encoding import x_order
from polycube.registry import build

ALPHA_BAR = build("schedule", {"plugin": "linear", "steps": 30})()


class Halved(nn.Module):
    """Knows the polycube of its geometry: half of it."""

    def __init__(self, channels: int, context_length: int, image: tuple[int, int]) -> None:
        super().__init__()
        assert (channels, context_length, image) == (6, 29, (32, 32))

    def forward(self, x: Tensor, t: Tensor, context: Tensor) -> Tensor:
        return x[:, 3:] / 2


def known(target: str) -> Denoiser:
    return Denoiser(
        Halved, ALPHA_BAR, (2, 1, 1), ("cube", "a", "b", "c"), DenoiserOptions(target=target)
    )


@pytest.mark.parametrize("sampler", ["ddpm", "ddim"])
def test_points_keep_their_order_and_get_the_grids_origin(sampler: str) -> None:
    points = np.random.default_rng(0).uniform(-1, 1, (2, 1024, 3))
    contexts = [("cube", None), ("cube", "cube")]
    x_0, trajectory = known("x0").denoise(
        points, contexts, build("sampler", {"plugin": sampler}), 0
    )
    origin = np.array([1, 0.5, 0.5])
    assert x_0 == pytest.approx(points / 2 + origin, abs=1e-5)
    assert trajectory.shape == (5, 2, 1024, 3)
    assert trajectory[0] == pytest.approx(points + origin, abs=1e-6)
    assert np.array_equal(trajectory[-1], x_0)


def test_predicted_noise_means_the_same_as_predicted_x_0() -> None:
    """x_0 from noise z: (x_t - sqrt(1 - alpha_bar) s z - c_t q) / sqrt(alpha_bar)."""
    denoiser = known("noise")
    geometry = torch.randn(1, 3, 32, 32, generator=torch.Generator().manual_seed(0))
    x_0 = torch.zeros_like(geometry)
    q, t = denoiser.process.adjustment(geometry), torch.tensor([12])
    x_t = denoiser.process.forward(x_0, geometry / 2, q, t)  # its noise is what Halved says
    predicted = denoiser.predict(geometry, torch.zeros(1, 29))(x_t, 12)
    assert torch.allclose(predicted, x_0, atol=1e-5)


def test_without_geometry_channels_the_network_sees_x_t_only() -> None:
    seen = []

    class Spy(nn.Module):
        def __init__(self, channels: int, context_length: int, image: tuple[int, int]) -> None:
            super().__init__()
            seen.append(channels)

        def forward(self, x: Tensor, t: Tensor, context: Tensor) -> Tensor:
            seen.append(x.shape[1])
            return x

    options = DenoiserOptions(geometry_channels=False)
    denoiser = Denoiser(Spy, ALPHA_BAR, (2, 1, 1), ("cube",), options)
    image = torch.zeros(1, 3, 32, 32)
    denoiser.predict(image, torch.zeros(1, 5))(image, 30)
    assert seen == [3, 3]


def test_sample_points_of_a_context(denoiser: Denoiser) -> None:
    assert denoiser.n_points(("cube", None)) == 1024
    published = Denoiser(Halved, ALPHA_BAR, (2, 1, 1), ("c", *"xyz"), DenoiserOptions(pads=True))
    assert published.n_points(("c", None)) == 512
    assert published.n_points(("c", "c")) == 1024


def test_padded_images_are_denoised_too(denoiser: Denoiser) -> None:
    points = np.random.default_rng(0).uniform(-1, 1, (1, 512, 3))
    sampler = build("sampler", {"plugin": "ddim", "steps": 2})
    x_0, trajectory = denoiser.denoise(points, [("cube", None)], sampler, 0)
    assert x_0.shape == (1, 512, 3)
    order = x_order(trajectory[0])
    assert np.array_equal(order, x_order(points.astype(np.float32)))


def test_wrong_options_and_contexts_are_refused(denoiser: Denoiser) -> None:
    with pytest.raises(ValueError, match="target must be x0 or noise; got 'mean'"):
        DenoiserOptions(target="mean")
    with pytest.raises(LookupError, match="no primitive named 'cone'"):
        denoiser.vectors([("cone", None)])
