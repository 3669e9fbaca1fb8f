"""The process against the paper's equations."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from polycube.diffusion.process import DiffusionProcess, kept_steps

BETA = np.linspace(1e-4, 0.02, 500)
ALPHA_BAR = np.append(1.0, np.cumprod(1 - BETA))


@pytest.fixture(scope="module")
def process() -> DiffusionProcess:
    return DiffusionProcess(ALPHA_BAR, noise_scale=0.5)


@pytest.fixture
def images() -> torch.Tensor:
    """x_0, z, q: (3, 2, 3, 4, 4) double precision."""
    return torch.randn(3, 2, 3, 4, 4, generator=torch.Generator().manual_seed(0)).double()


def test_endpoint_of_the_published_schedule(process: DiffusionProcess) -> None:
    assert float(process.drift[-1]) == pytest.approx(14.89, abs=0.005)
    assert float(process.alpha_bar[-1]) == pytest.approx(0.00635, abs=1e-5)
    assert process.beta[1:].numpy() == pytest.approx(BETA, rel=1e-9)


def test_drift_is_the_sum_of_equation_2(process: DiffusionProcess) -> None:
    t, alpha = 40, 1 - BETA
    terms = [np.sqrt(1 - alpha[k]) * np.sqrt(np.prod(alpha[k + 1 : t])) for k in range(t)]
    assert float(process.drift[t]) == pytest.approx(sum(terms), rel=1e-12)


def test_closed_form_equals_stepping_equation_1(
    process: DiffusionProcess, images: torch.Tensor
) -> None:
    """With the same noise: the steps' noises add up to sqrt(1 - alpha_bar_t) z."""
    x_0, _, q = images
    generator = torch.Generator().manual_seed(1)
    x_t, total = x_0, torch.zeros_like(x_0)
    for t in range(1, 501):
        a = process.alpha[t]
        z = torch.randn(x_0.shape, generator=generator).double()
        x_t = a.sqrt() * x_t + (1 - a).sqrt() * (0.5 * z + q)
        total = a.sqrt() * total + (1 - a).sqrt() * z
        if t in (1, 20, 500):
            z_bar = total / (1 - process.alpha_bar[t]).sqrt()
            steps = torch.full((2,), t)
            assert torch.allclose(x_t, process.forward(x_0, z_bar, q, steps), atol=1e-10)


def test_adjustment_ends_at_the_geometry(process: DiffusionProcess, images: torch.Tensor) -> None:
    geometry = images[0]
    q = process.adjustment(geometry)
    zero, end = torch.zeros_like(q), torch.full((2,), 500)
    assert torch.allclose(process.forward(zero, zero, q, end), geometry, atol=1e-12)


def test_noise_and_origin_undo_forward(process: DiffusionProcess, images: torch.Tensor) -> None:
    x_0, z, q = images
    t = torch.tensor([3, 480])
    x_t = process.forward(x_0, z, q, t)
    assert torch.allclose(process.noise(x_t, x_0, q, t), z, atol=1e-9)
    assert torch.allclose(process.origin(x_t, z, q, t), x_0, atol=1e-9)


@settings(derandomize=True, max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), t=st.integers(1, 500), s=st.floats(0.01, 10))
def test_velocity_leads_back_to_x_0_and_the_noise(seed: int, t: int, s: float) -> None:
    """At every step, for every noise scale: x'_t and v_t are x_0 and s z, turned."""
    process, steps = DiffusionProcess(ALPHA_BAR, s), torch.tensor([t, 500])
    draw = torch.Generator().manual_seed(seed)
    x_0, z, q = torch.randn(3, 2, 3, 4, 4, generator=draw, dtype=torch.float64)
    v, x_t = process.velocity(x_0, z, steps), process.forward(x_0, z, q, steps)
    origin = process.origin_of_velocity(x_t, v, q, steps)
    assert torch.allclose(origin, x_0, atol=1e-11)
    assert torch.allclose(process.noise(x_t, origin, q, steps), z, atol=1e-8)
    free = process.forward(x_0, z, torch.zeros_like(q), steps)  # x'_t
    assert torch.allclose(free**2 + v**2, x_0**2 + (s * z) ** 2, atol=1e-9)


def test_velocity_is_the_derivative_by_the_angle(images: torch.Tensor) -> None:
    """A schedule with alpha_bar = cos^2 at equal angles: central differences of x'_t."""
    h = 1e-4
    angles = torch.tensor([0, 0.7 - h, 0.7, 0.7 + h], dtype=torch.float64)
    process = DiffusionProcess(angles.cos().square().numpy(), noise_scale=0.5)
    x_0, z, q = images
    before, here, after = (torch.full((2,), t) for t in (1, 2, 3))
    free = [process.forward(x_0, z, torch.zeros_like(q), t) for t in (before, after)]
    assert torch.allclose((free[1] - free[0]) / (2 * h), process.velocity(x_0, z, here), atol=1e-7)


def test_velocity_starts_as_the_noise_and_ends_as_minus_x_0(images: torch.Tensor) -> None:
    x_0, z, _ = images
    process = DiffusionProcess(np.array([1, 0.5, 1e-12]), noise_scale=0.5)
    start, end = torch.tensor([0, 0]), torch.tensor([2, 2])
    assert torch.equal(process.velocity(x_0, z, start), 0.5 * z)
    assert torch.allclose(process.velocity(x_0, z, end), -x_0, atol=1e-5)


def test_first_reverse_step_gives_x_0_exactly(
    process: DiffusionProcess, images: torch.Tensor
) -> None:
    x_0, z, q = images
    x_1 = process.forward(x_0, z, q, torch.tensor([1, 1]))
    assert torch.allclose(process.reverse_mean(x_1, z, q, 1), x_0, atol=1e-12)


def test_reverse_mean_takes_back_the_drift_of_one_step(
    process: DiffusionProcess, images: torch.Tensor
) -> None:
    """Without noise the reverse mean is the state one step before, at every t."""
    x_0, _, q = images
    zero = torch.zeros_like(x_0)
    for t in (2, 37, 500):
        x_t = process.forward(x_0, zero, q, torch.full((2,), t))
        before = process.forward(x_0, zero, q, torch.full((2,), t - 1))
        assert torch.allclose(process.reverse_mean(x_t, zero, q, t), before, atol=1e-11)


def test_reverse_mean_is_the_posterior_mean(
    process: DiffusionProcess, images: torch.Tensor
) -> None:
    """E[x_{t-1} | x_t, x_0] from the two Gaussians of eq. 4, computed directly."""
    x_0, z, q = images
    t = 123
    x_t = process.forward(x_0, z, q, torch.full((2,), t))
    a, before = process.alpha[t], process.alpha_bar[t - 1]
    prior = before.sqrt() * x_0 + process.drift[t - 1] * q  # of x_{t-1} given x_0
    variance, step = 1 - before, 1 - a
    gain = variance * a.sqrt() / (a * variance + step)
    mean = prior + gain * (x_t - a.sqrt() * prior - step.sqrt() * q)
    assert torch.allclose(process.reverse_mean(x_t, z, q, t), mean, atol=1e-10)
    spread = float(variance * step / (a * variance + step))
    assert process.posterior_variance(t) == pytest.approx(0.5**2 * spread, rel=1e-12)


def test_the_posterior_leads_from_each_marginal_to_the_one_before(
    process: DiffusionProcess, images: torch.Tensor
) -> None:
    """A Gaussian of eq. 2 at t, a step back, is that at t - 1: mean and variance, at every t."""
    x_0, z, q = images[:, :1]
    zero = torch.zeros_like(x_0)
    for t in range(1, 501):
        here = torch.tensor([t])

        def back(x_t: torch.Tensor, here: torch.Tensor = here) -> torch.Tensor:
            noise = process.noise(x_t, x_0, q, here)
            return process.reverse_mean(x_t, noise, q, int(here))

        mean = back(process.forward(x_0, zero, q, here))
        assert torch.allclose(mean, process.forward(x_0, zero, q, here - 1), atol=1e-10)
        gain = float(((back(mean + z) - back(mean)) / z).mean())
        variance = gain**2 * 0.25 * (1 - process.alpha_bar[t]) + process.posterior_variance(t)
        assert float(variance) == pytest.approx(0.25 * (1 - float(process.alpha_bar[t - 1])))


def test_kept_steps_are_those_of_the_figure() -> None:
    assert kept_steps(500) == [500, 499, 479, 19, 0]
    assert kept_steps(4) == [4, 3, 0]


@pytest.mark.parametrize(
    ("alpha_bar", "message"),
    [
        ([0.9, 0.5], "start at 1 and be positive"),
        ([1.0, 0.5, 0.0], "start at 1 and be positive"),
        ([1.0, 0.5, 0.6], "must decrease"),
        ([1.0, 0.5, np.nan], "must decrease"),
    ],
)
def test_wrong_schedules_are_refused(alpha_bar: list, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        DiffusionProcess(np.array(alpha_bar))
