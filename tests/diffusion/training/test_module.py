"""Training: the terms of the loss have their documented values, and training reduces them."""

import lightning.pytorch as L
import numpy as np
import pytest
import torch
from torch.utils.data import DataLoader

from polycube.diffusion.conditions import GridContexts
from polycube.diffusion.pairs.pairs import Pairs
from polycube.diffusion.pairs.templates import IDENTITY, contexts, turned_contexts
from polycube.diffusion.training.data_module import Batch, PairImages
from polycube.diffusion.training.learning import Learning
from polycube.diffusion.training.module import ROTATIONS, SOFT, DDPMPolycube
from polycube.diffusion.training.pictures import scatter
from polycube.diffusion.weights import make_denoiser
from polycube.registry import build

GRID = (2, 1, 1)


QUARTER = torch.tensor([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])  # about z: x to y


def _batch(pairs: Pairs, numbers: range) -> Batch:
    images = PairImages(pairs, GridContexts(GRID, ("cube", "hole_z", "hole_x", "hole_y")))
    rows = [images[i] for i in numbers]
    return Batch(*(torch.stack(column) for column in zip(*rows, strict=True)))


@pytest.fixture(scope="module")
def batch(pairs: Pairs) -> Batch:
    return _batch(pairs, range(8))


@pytest.fixture(scope="module")
def turned(primitives: dict) -> np.ndarray:
    return turned_contexts(contexts(GRID, primitives), GRID, primitives)


def _module(
    config: dict, turned: np.ndarray | None = None, learning: dict | None = None, **options: object
) -> DDPMPolycube:
    options = config["options"] | {"classifier": turned is not None} | options
    torch.manual_seed(0)
    denoiser = make_denoiser(config | {"options": options}, build)
    sampler = build("sampler", {"plugin": "ddim", "steps": 2})
    return DDPMPolycube(denoiser, Learning(**(learning or {})), sampler, {}, turned)


def _make_perfect(module: DDPMPolycube, batch: Batch) -> None:
    """Replace the outputs of the module's network by its target, computed from its inputs."""
    process, x_0 = module.denoiser.process, batch.polycube
    q = process.adjustment(batch.geometry[:, :3])

    def perfect(_: object, inputs: tuple, outputs: torch.Tensor) -> torch.Tensor:
        x_t, t = inputs[0][:, :3], (inputs[1] * process.steps).round().long()
        z = process.noise(x_t, x_0, q, t)
        velocity, move = process.velocity(x_0, z, t), x_0 - batch.geometry[:, :3]
        target = {"x0": x_0, "noise": z, "v": velocity, "move": move}
        return torch.cat([target[module.denoiser.options.target], outputs[:, 3:]], dim=1)

    module.denoiser.network.register_forward_hook(perfect)


def _replace_output(module: DDPMPolycube, output: torch.Tensor) -> list[tuple]:
    """Let the module's network return `output`; returns a list that collects its inputs."""
    inputs = []
    module.denoiser.network.register_forward_hook(lambda _, args, __: inputs.append(args) or output)
    return inputs


@pytest.mark.parametrize("loss", ["distance", "mse"])
@pytest.mark.parametrize("target", ["x0", "noise", "v", "move"])
def test_loss_of_the_target_is_zero(target: str, loss: str, config: dict, batch: Batch) -> None:
    module = _module(config, target=target, learning={"loss": loss})
    _make_perfect(module, batch)
    assert module.loss(batch)["points"].item() == pytest.approx(0, abs=1e-9)


def test_loss_of_a_wrong_output_is_its_distance_or_its_square(config: dict, batch: Batch) -> None:
    off = batch.polycube + torch.tensor([0.3, 0, 0.4])[:, None, None]
    expected = {"distance": (0.5**2 + SOFT**2) ** 0.5 - SOFT, "mse": (0.3**2 + 0.4**2) / 3}
    for loss, value in expected.items():
        module = _module(config, labels=False, learning={"loss": loss})
        _replace_output(module, off)
        assert module.loss(batch)["points"].item() == pytest.approx(value, rel=1e-5)


def test_noise_is_the_target_of_the_paper(config: dict, batch: Batch) -> None:
    """A network that predicts z = 0 has the squared error of unit noise: one."""
    module = _module(
        config, target="noise", labels=False, learning={"endpoint": 0.0, "loss": "mse"}
    )
    _replace_output(module, torch.zeros_like(batch.polycube))
    terms = module.loss(batch)
    assert terms.keys() == {"points"}
    assert terms["points"].item() == pytest.approx(1, abs=0.03)


def test_padded_pixels_do_not_count_as_distance_or_label(
    config: dict, batch: Batch, primitives: dict
) -> None:
    published = build("data", {"plugin": "paper"})(GRID, primitives, seed=0)
    padded = _batch(published, range(4))
    noise = torch.where(padded.labels[:, :1] < 0, 7.0, 0.0)
    module = _module(config)
    _replace_output(
        module, torch.cat([padded.polycube + noise, noise.expand(-1, 10, -1, -1)], dim=1)
    )
    terms = module.loss(padded)
    assert terms["points"].item() == pytest.approx(0, abs=1e-6)
    assert terms["labels"].item() == pytest.approx(0.1 * np.log(6 * 2 * 2), rel=1e-5)
    mse = _module(config, labels=False, learning={"loss": "mse"})  # as published, all count
    _replace_output(mse, padded.polycube + noise)
    assert mse.loss(padded)["points"].item() == pytest.approx(7**2 / 2, rel=1e-5)


def test_loss_of_labels_is_their_cross_entropies(config: dict, batch: Batch) -> None:
    """Certain labels have loss 0; the correct cell with odds of 3 to 1 has log(4 / 3)."""
    one_hot = [
        torch.nn.functional.one_hot(batch.labels[:, i], n).movedim(-1, 1).float()
        for i, n in enumerate((6, 2, 2))
    ]
    for certainty, expected in (
        ((99, 99, 99), 0),
        ((0, 99, 99), np.log(6)),
        ((99, np.log(3), 0), np.log(4 / 3) + np.log(2)),
    ):
        module = _module(config, learning={"labels": 0.7})
        logits = [s * right for s, right in zip(certainty, one_hot, strict=True)]
        _replace_output(module, torch.cat([batch.polycube, *logits], dim=1))
        assert module.loss(batch)["labels"].item() == pytest.approx(0.7 * expected, abs=1e-5)


def _replace_classes(
    module: DDPMPolycube, cells: torch.Tensor, alignment: torch.Tensor
) -> list[torch.Tensor]:
    """Let the module's classifier return the logits; returns a list that collects its inputs."""
    inputs = []
    module.denoiser.classifier.register_forward_hook(
        lambda _, args, __: inputs.append(args[0]) or (cells, alignment)
    )
    return inputs


def test_loss_of_the_correct_context_is_zero(
    config: dict, turned: np.ndarray, pairs: Pairs
) -> None:
    batch = _batch(pairs, range(24))
    module = _module(config, turned)
    wanted = torch.from_numpy(turned)[batch.number, module.draws(batch.number, (32, 32)).turn]
    along = (wanted[:, 0] >= 0).float()
    assert 0 < along.mean() < 1
    right = 99 * torch.nn.functional.one_hot(wanted.clamp(0), 5).float()
    _replace_classes(module, right, 99 * (2 * along - 1))
    assert module.loss(batch)["context"].item() == pytest.approx(0, abs=1e-6)
    _replace_classes(module, 0 * right, 0 * along)  # log 5 per cell of aligned ones
    expected = along.mean() * np.log(5) + np.log(2)
    assert module.loss(batch)["context"].item() == pytest.approx(expected.item(), rel=1e-5)


def test_a_turned_geometry_has_its_turned_context(
    config: dict, turned: np.ndarray, pairs: Pairs, primitives: dict
) -> None:
    """One cell with a hole along x, turned about z, has its hole along y, and so its points."""
    number = pairs.contexts.index(("hole_x", None))
    turn = int((ROTATIONS - QUARTER).abs().sum(dim=(1, 2)).argmin())
    batch = _batch(pairs, range(number, number + 1))
    module = _module(config, turned)
    draws = module.draws(batch.number, (32, 32))._replace(turn=torch.tensor([turn]))
    module.draws = lambda *_: draws
    right = torch.tensor([[0, 3]])  # cube and hole_y: the shape's canonical name
    certain = 99 * torch.nn.functional.one_hot(right, 5).float()
    inputs = _replace_classes(module, certain, torch.tensor([99.0]))
    assert module.loss(batch)["context"].item() == pytest.approx(0, abs=1e-6)
    x, y, z, *normal = batch.geometry[0]
    rotated = torch.stack([-y, x, z, -normal[1], normal[0], normal[2]])
    assert torch.allclose(inputs[0][0], rotated, atol=1e-6)


def test_endpoint_share_is_trained_where_sampling_starts(config: dict, batch: Batch) -> None:
    module = _module(config, labels=False, learning={"endpoint": 1.0})
    inputs = _replace_output(module, batch.polycube)
    module.loss(batch)
    x, t, context = inputs[0]
    assert torch.equal(x[:, :3], batch.geometry[:, :3]) and torch.equal(x[:, 3:], batch.geometry)
    assert (t == 1).all() and torch.equal(context, batch.context)


def test_draws_depend_on_the_pair_and_not_on_its_batch(config: dict) -> None:
    module = _module(config)
    numbers = torch.tensor([5, 10**9, 7])
    together, alone = module.draws(numbers, (4, 8)), module.draws(numbers[1:2], (4, 8))
    assert all(torch.equal(a[1:2], b) for a, b in zip(together, alone, strict=True))
    other = _module(config, learning={"seed": 1}).draws(numbers, (4, 8))
    assert not torch.equal(together.z, other.z)


@pytest.mark.parametrize("seed", [0, 7, 2**32 - 1])
def test_draws_are_random(seed: int, config: dict) -> None:
    """Steps uniform, noise normal, of consecutive pairs uncorrelated; half of the pairs turned."""
    draws = _module(config, learning={"seed": seed}).draws(torch.arange(4000), (4, 4))
    assert torch.bincount(draws.t, minlength=51)[1:].float() / 4000 == pytest.approx(
        np.full(50, 1 / 50), abs=0.008
    )
    assert draws.t.min() == 1 and draws.t.max() == 50
    assert draws.first.float().mean() == pytest.approx(0.8, abs=0.02)
    assert torch.bincount(draws.turn, minlength=24).min() > 0.5 * 4000 / 48
    unrotated = (draws.turn == IDENTITY).float().mean()
    assert unrotated == pytest.approx(0.5 + 0.5 / 24, abs=0.025)
    z = draws.z.flatten(1)
    assert z.mean().item() == pytest.approx(0, abs=0.01)
    assert z.std().item() == pytest.approx(1, abs=0.01)
    assert (z[1:] * z[:-1]).mean().item() == pytest.approx(0, abs=0.01)


def test_thin_images_are_every_nth_row_and_column(config: dict, batch: Batch) -> None:
    module = _module(config | {"model": {"plugin": "points"}}, learning={"thin": 4, "endpoint": 1})
    inputs = []
    module.denoiser.network.register_forward_hook(lambda _, args, __: inputs.append(args[0]))
    module.loss(batch)
    assert torch.equal(inputs[0][:, 3:], batch.geometry[..., ::4, ::4])


@pytest.mark.slow
def test_a_few_steps_on_one_batch_bring_each_term_down(
    config: dict, batch: Batch, turned: np.ndarray
) -> None:
    """Points, labels and context, with new noise and orientations at every step."""
    module = _module(config, turned)
    adam = torch.optim.Adam(module.parameters(), lr=3e-3)
    losses = []
    for step in range(40):
        terms = module.loss(batch._replace(number=batch.number + 24 * step))
        adam.zero_grad()
        sum(terms.values()).backward()
        adam.step()
        losses.append([term.item() for term in terms.values()])
    points, labels, context = np.mean(losses[-5:], axis=0) / np.mean(losses[:5], axis=0)
    assert points < 0.6 and labels < 0.8 and context < 0.8


@pytest.mark.slow
def test_picture_shows_the_pairs(batch: Batch) -> None:
    images = [np.asarray(image[:2, :3]) for image in (batch.geometry, *[batch.polycube] * 2)]
    picture = scatter(*images)
    assert picture.dtype == np.uint8 and picture.shape == (360, 540, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 100


def test_seeds_have_no_draws_in_common(config: dict) -> None:
    """Seed 1 repeated the draws of seed 0, one pair later."""
    first, second = (_module(config, learning={"seed": seed}) for seed in (0, 1))
    numbers = torch.arange(200)
    draws = [module.draws(numbers, (2, 2)).z.flatten(1) for module in (first, second)]
    assert torch.equal(draws[0], first.draws(numbers, (2, 2)).z.flatten(1))
    assert torch.cdist(*draws).min() > 1e-3


@pytest.mark.filterwarnings("ignore:.*LeafSpec.*:FutureWarning", "ignore:.*does not have many")
def test_the_rate_rises_over_the_first_batches_and_falls_with_the_epochs(
    config: dict, batch: Batch
) -> None:
    """Three batches an epoch, two of them to rise, a linear decay over two epochs."""
    module = _module(config, learning={"rate": 0.8, "warmup": 2})
    rates: list[float] = []
    module.on_train_batch_start = lambda *_: rates.append(
        module.trainer.optimizers[0].param_groups[0]["lr"]
    )
    trainer = L.Trainer(
        max_epochs=2,
        logger=False,
        enable_checkpointing=False,
        enable_progress_bar=False,
        enable_model_summary=False,
        accelerator="cpu",
    )
    loader = DataLoader([batch] * 3, batch_size=None)
    trainer.fit(module, loader)
    assert rates == pytest.approx([0.8 / 3, 1.6 / 3, 0.8, 0.4, 0.4, 0.4])
