"""Samplers with predictions whose result is known."""

import pytest
import torch

from polycube.diffusion.process import DiffusionProcess
from polycube.errors import InputError
from polycube.registry import build, names

X_0 = torch.randn(2, 3, 4, 4, generator=torch.Generator().manual_seed(1))
X_T = torch.randn(2, 3, 4, 4, generator=torch.Generator().manual_seed(2))


def _process(steps: int = 500, noise_scale: float = 0.25) -> DiffusionProcess:
    schedule = build("schedule", {"plugin": "linear", "steps": steps})
    return DiffusionProcess(schedule(), noise_scale)


@pytest.mark.parametrize("name", names("sampler"))
@pytest.mark.parametrize("steps", [3, 500])
def test_the_right_prediction_is_reached_from_the_geometry(name: str, steps: int) -> None:
    process, times = _process(steps), []

    def predict(x_t: torch.Tensor, t: int) -> torch.Tensor:
        times.append(t)
        return X_0

    options = {"steps": 4} if name == "ddim" else {}
    sampler = build("sampler", {"plugin": name, **options})
    x_0, states = sampler(predict, X_T, process, torch.Generator().manual_seed(0))
    assert torch.allclose(x_0, X_0, atol=1e-4)
    assert torch.equal(states[0], X_T) and torch.equal(states[-1], x_0)
    assert len(states) == (5 if steps == 500 else 3)
    n_calls = {"ddpm": steps, "ddim": min(steps, 4), "mean": steps}[name]
    assert times[0] == steps and times[:n_calls] == sorted(times[:n_calls], reverse=True)
    assert times == times[:n_calls] * (8 if name == "mean" else 1)


def test_ddpm_draws_and_its_seed_decides() -> None:
    def run(seed: int) -> torch.Tensor:
        sampler = build("sampler", {"plugin": "ddpm"})
        return sampler(lambda x, t: x / 2, X_T, _process(50), torch.Generator().manual_seed(seed))[
            1
        ][1]

    assert torch.equal(run(0), run(0))
    assert not torch.equal(run(0), run(1))


def test_ddim_with_noise_takes_the_steps_of_ddpm() -> None:
    """Over all T steps, with the same noise, its states are those of the posterior's variance."""
    process, ends = _process(50), []
    for options in ({"plugin": "ddpm", "variance": "posterior"}, {"plugin": "ddim", "noise": 1.0}):
        steps = {"steps": 50} if options["plugin"] == "ddim" else {}
        sampler = build("sampler", {**options, **steps})
        draw = torch.Generator().manual_seed(0)
        ends.append(sampler(lambda x, t: x / 2, X_T.double(), process, draw)[1])
    assert torch.allclose(*ends, atol=1e-5)
    with pytest.raises(InputError, match="noise must be a number, 0 to 1; got 2"):
        build("sampler", {"plugin": "ddim", "noise": 2})


def test_ddpm_adds_the_noise_of_algorithm_2() -> None:
    """One step from x_T: the spread over draws is s sqrt(beta_T)."""
    process = _process(noise_scale=0.5)
    x_T = torch.zeros(1, 3, 64, 64)
    sampler = build("sampler", {"plugin": "ddpm"})
    states = sampler(lambda x, t: x, x_T, process, torch.Generator().manual_seed(0))[1]
    assert states[1].std() == pytest.approx(0.5 * 0.02**0.5, rel=0.02)  # x_{T - 1}


@pytest.mark.parametrize("variance", ["beta", "posterior"])
def test_marginals_of_ddpm_when_x_0_is_known(variance: str) -> None:
    """12,288 equal pixels from x_T to x_t: mean and variance within three standard errors.

    With the posterior variance they are those of the forward process between x_0 and x_T; with
    beta the mean is the same, the variance what the steps add up to, which shows near t = 0 only.
    """
    process, states = _process(noise_scale=0.5), {}
    alpha_bar, c, s = process.alpha_bar.numpy(), process.drift.numpy(), process.noise_scale
    origin, end, n = 0.7, -0.4, 3 * 64 * 64

    def predict(x_t: torch.Tensor, t: int) -> torch.Tensor:
        states[t] = x_t
        return torch.full_like(x_t, origin)

    x_T = torch.full((1, 3, 64, 64), end, dtype=torch.float64)
    sampler = build("sampler", {"plugin": "ddpm", "variance": variance})
    sampler(predict, x_T, process, torch.Generator().manual_seed(0))

    spread = 0.0  # variance the steps add up to
    for t in range(500, 1, -1):
        gain = (1 - process.beta[t]) ** 0.5 * (1 - alpha_bar[t - 1]) / (1 - alpha_bar[t])
        spread = float(gain**2 * spread + s**2 * process.beta[t])
        if t - 1 not in (450, 250, 3):
            continue
        a, left = alpha_bar[t - 1], alpha_bar[500] / alpha_bar[t - 1]
        weight = left**0.5 * (1 - a) / (1 - alpha_bar[500])  # weight of x_T in the mean of x_t
        mean = (a**0.5 - weight * alpha_bar[500] ** 0.5) * origin + c[t - 1] * end / c[500]
        bridge = s**2 * (1 - a) * (1 - left) / (1 - alpha_bar[500])
        assert 1 < spread / bridge < 1.01 if t > 4 else spread / bridge > 1.3
        expected = bridge if variance == "posterior" else spread
        assert abs(states[t - 1].mean() - mean) < 3 * (expected / n) ** 0.5
        assert abs(states[t - 1].var() - expected) < 3 * expected * (2 / n) ** 0.5


def test_an_unknown_variance_is_refused() -> None:
    with pytest.raises(ValueError, match="variance must be one of beta, posterior; got 'none'"):
        build("sampler", {"plugin": "ddpm", "variance": "none"})


def test_without_noise_ddpm_and_ddim_do_not_need_a_generator_seed() -> None:
    for config in ({"plugin": "ddpm", "noise": 0.0}, {"plugin": "ddim"}):
        a, b = (
            build("sampler", config)(
                lambda x, t: x / 3, X_T, _process(60), torch.Generator().manual_seed(seed)
            )[0]
            for seed in (0, 1)
        )
        assert torch.equal(a, b)


@pytest.mark.parametrize("steps", [1, 4, 7, 60, 100])
def test_ddim_evaluates_the_network_once_per_step(steps: int) -> None:
    times = []

    def predict(x_t: torch.Tensor, t: int) -> torch.Tensor:
        times.append(t)
        return x_t / 2

    sampler = build("sampler", {"plugin": "ddim", "steps": steps})
    sampler(predict, X_T, _process(60), torch.Generator())
    assert len(times) == min(steps, 60)
    assert torch.tensor(times).diff().unique().numel() <= 2  # evenly


def test_states_between_two_steps_of_ddim_are_of_one_noise() -> None:
    """One step: x_0 as predicted from x_T, the other states from it and the noise it implies."""
    process = _process()
    x_0, states = build("sampler", {"plugin": "ddim", "steps": 1})(
        lambda x, t: x / 3, X_T, process, torch.Generator()
    )
    q = process.adjustment(X_T)
    z = process.noise(X_T, X_T / 3, q, torch.tensor([500, 500]))
    assert torch.allclose(x_0, X_T / 3, atol=1e-6)
    for t, state in zip((500, 499, 479, 19, 0), states, strict=True):
        assert torch.allclose(state, process.forward(x_0, z, q, torch.tensor([t, t])), atol=1e-5)


def test_ddim_needs_a_step() -> None:
    with pytest.raises(ValueError, match="steps must be a whole number, 1 or more; got 0"):
        build("sampler", {"plugin": "ddim", "steps": 0})
