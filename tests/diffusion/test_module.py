"""Training: the loss is the paper's, and a network can bring it down."""

import numpy as np
import pytest
import torch

from polycube.diffusion.dataset import PairImages
from polycube.diffusion.denoiser import Denoiser
from polycube.diffusion.module import DDPMPolycube, Learning, rate_factors
from polycube.diffusion.pairs import Pairs
from polycube.diffusion.pictures import scatter
from polycube.diffusion.weights import make_denoiser
from polycube.registry import build

Batch = tuple[torch.Tensor, torch.Tensor, torch.Tensor]


@pytest.fixture(scope="module")
def batch(pairs: Pairs, primitives: dict) -> Batch:
    rows = [PairImages(pairs, tuple(primitives))[i] for i in range(8)]
    return tuple(torch.stack(column) for column in zip(*rows, strict=True))


def _module(denoiser: Denoiser, **learning: object) -> DDPMPolycube:
    sampler = build("sampler", {"plugin": "ddim", "steps": 2})
    return DDPMPolycube(denoiser, Learning(**learning), sampler, {})


def _answering(module: DDPMPolycube, answer: torch.Tensor) -> list[tuple]:
    """Let the module's network say `answer`; returns what it was asked."""
    asked = []
    module.denoiser.network.register_forward_hook(lambda _, args, __: asked.append(args) or answer)
    return asked


def test_loss_of_the_right_answer_is_zero(denoiser: Denoiser, batch: Batch) -> None:
    module = _module(denoiser)
    _answering(module, batch[1])
    assert module.loss(batch, torch.Generator().manual_seed(0)) == 0
    _answering(module, batch[1] + 0.5)
    assert module.loss(batch, torch.Generator().manual_seed(0)) == pytest.approx(0.25, rel=1e-5)


def test_noise_is_the_target_of_the_paper(config: dict, batch: Batch) -> None:
    """A network that says z = 0 has the loss of unit noise: one."""
    options = config["options"] | {"target": "noise"}
    module = _module(make_denoiser(config | {"options": options}, build), endpoint=0.0)
    _answering(module, torch.zeros_like(batch[1]))
    assert module.loss(batch, torch.Generator().manual_seed(0)) == pytest.approx(1, abs=0.03)


def test_endpoint_share_is_trained_where_sampling_starts(denoiser: Denoiser, batch: Batch) -> None:
    module = _module(denoiser, endpoint=1.0)
    asked = _answering(module, batch[1])
    module.loss(batch, torch.Generator().manual_seed(0))
    x, t, context = asked[0]
    assert torch.equal(x[:, :3], batch[0]) and torch.equal(x[:, 3:], batch[0])
    assert (t == 1).all() and torch.equal(context, batch[2])


def test_a_few_steps_bring_the_loss_of_one_batch_down(denoiser: Denoiser, batch: Batch) -> None:
    module = _module(denoiser)
    adam = torch.optim.Adam(module.parameters(), lr=3e-3)
    losses = []
    for step in range(40):
        loss = module.loss(batch, torch.Generator().manual_seed(step))
        adam.zero_grad()
        loss.backward()
        adam.step()
        losses.append(loss.item())
    assert np.mean(losses[-5:]) < 0.5 * np.mean(losses[:5])


def test_learning_rates_of_the_paper() -> None:
    """eta_k = eta_{k-1} (1 - k / K) ends at zero, as linear decay does."""
    assert rate_factors("paper", 4) == pytest.approx([1, 3 / 4, 3 / 8, 3 / 32, 0])
    assert rate_factors("linear", 4) == pytest.approx([1, 0.75, 0.5, 0.25, 0])
    assert rate_factors("constant", 2) == [1, 1, 1]


def test_wrong_options_are_refused() -> None:
    with pytest.raises(ValueError, match="must be one of constant, linear, paper; got steep"):
        Learning(decay="steep")
    with pytest.raises(ValueError, match=r"thin must be at least 1; got 0"):
        Learning(thin=0)
    with pytest.raises(ValueError, match=r"endpoint must lie in \[0, 1\]; got 2"):
        Learning(endpoint=2)


def test_picture_shows_the_pairs(batch: Batch) -> None:
    images = [np.asarray(image[:2]) for image in (batch[0], batch[1], batch[1])]
    picture = scatter(*images)
    assert picture.dtype == np.uint8 and picture.shape == (360, 540, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 100
