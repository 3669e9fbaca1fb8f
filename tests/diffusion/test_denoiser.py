"""Denoising with networks whose outputs are known."""

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from polycube.diffusion.conditions import GridContexts
from polycube.diffusion.denoiser import CLASSIFIER_BATCH, Denoiser, DenoiserOptions
from polycube.diffusion.encoding import by_x
from polycube.diffusion.weights import load_denoiser
from polycube.registry import build

ALPHA_BAR = build("schedule", {"plugin": "linear", "steps": 30})()
FOUR = ("cube", "a", "b", "c")


class Halved(nn.Module):
    """Returns half the geometry as polycube, and labels computed from the normals."""

    def __init__(
        self, channels: int, outputs: int, context_length: int, image: tuple[int, int]
    ) -> None:
        super().__init__()
        assert (channels, outputs, context_length, image) == (9, 3 + 6 + 2 + 2, 29, (32, 32))

    def forward(self, x: Tensor, t: Tensor, context: Tensor) -> Tensor:
        points, normals = x[:, 3:6], x[:, 6:]
        return torch.cat([points / 2, normals, -normals, points[:, :2], 0 * points[:, :2]], dim=1)


def halving(**options: object) -> Denoiser:
    return Denoiser(Halved, ALPHA_BAR, GridContexts((2, 1, 1), FOUR), DenoiserOptions(**options))


def cloud(n: int = 1024, batch: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Random points, and vectors that pass for normals."""
    rng = np.random.default_rng(0)
    return rng.uniform(-1, 1, (batch, n, 3)), rng.uniform(-1, 1, (batch, n, 3))


@pytest.mark.parametrize("sampler", ["ddpm", "ddim"])
def test_points_keep_their_order_and_get_the_grids_origin(sampler: str) -> None:
    points, normals = cloud()
    contexts = [("cube", None), ("cube", "cube")]
    sampler = build("sampler", {"plugin": sampler})
    denoised = halving().denoise(points, normals, contexts, sampler, 0)
    origin = np.array([1, 0.5, 0.5])
    assert denoised.points == pytest.approx(points / 2 + origin, abs=1e-5)
    assert denoised.trajectory.shape == (5, 2, 1024, 3)
    assert denoised.trajectory[0] == pytest.approx(points + origin, abs=1e-6)
    assert np.array_equal(denoised.trajectory[-1], denoised.points)


def test_labels_are_those_of_each_point() -> None:
    """Log-softmax of the outputs for axis, cell and wall, in the order of the points."""
    points, normals = cloud()
    sampler = build("sampler", {"plugin": "ddim", "steps": 1})
    denoiser = halving()
    axis, cell, wall = denoiser.denoise(points, normals, [FOUR[:2]] * 2, sampler, 0).log_labels
    logits = np.concatenate([normals, -normals], axis=2)
    assert axis == pytest.approx(logits - np.log(np.exp(logits).sum(2, keepdims=True)), abs=1e-5)
    assert np.array_equal(cell.argmax(axis=2), points[:, :, :2].argmax(axis=2))
    assert wall == pytest.approx(np.full((2, 1024, 2), np.log(0.5)))


@pytest.mark.parametrize(("options", "calls"), [({"steps": 1}, 1), ({"steps": 3}, 3)])
def test_labels_need_no_further_call_of_the_network(options: dict, calls: int) -> None:
    denoiser, calls_made = halving(), []
    denoiser.network.register_forward_hook(lambda *_: calls_made.append(1))
    sampler = build("sampler", {"plugin": "ddim", **options})
    denoiser.denoise(*cloud(), [FOUR[:2]] * 2, sampler, 0)
    assert len(calls_made) == calls


def test_images_classified_in_groups_have_the_same_probabilities(denoiser: Denoiser) -> None:
    points, normals = cloud(batch=2 * CLASSIFIER_BATCH + 3)
    in_groups = denoiser.log_cells(points, normals)
    one_by_one = [
        denoiser.log_cells(points[i : i + 1], normals[i : i + 1]) for i in range(len(points))
    ]
    for found, single in zip(in_groups, zip(*one_by_one, strict=True), strict=True):
        assert found == pytest.approx(np.concatenate(single), abs=1e-5)


@pytest.mark.parametrize("target", ["noise", "v", "move"])
def test_predicted_noise_velocity_or_move_means_the_same_as_predicted_x_0(target: str) -> None:
    """From the noise, velocity or move that belongs to x_t, the x_0 of x_t is computed."""
    geometry, x_0, z = torch.randn(3, 1, 6, 32, 32, generator=torch.Generator().manual_seed(0))
    x_0, z = x_0[:, :3], z[:, :3]
    denoiser, t = halving(target=target), torch.tensor([12])
    process = denoiser.process
    x_t = process.forward(x_0, z, process.adjustment(geometry[:, :3]), t)
    velocity, move = process.velocity(x_0, z, t), x_0 - geometry[:, :3]
    output = {"noise": z, "v": velocity, "move": move}[target]
    denoiser.network.register_forward_hook(lambda *_: output)
    predicted = denoiser.predict(geometry, torch.zeros(1, 29))(x_t, 12)
    assert torch.allclose(predicted, x_0, atol=1e-5)


@pytest.mark.parametrize("points", [False, True])
@pytest.mark.parametrize("normals", [False, True])
def test_the_network_receives_the_selected_inputs(points: bool, normals: bool) -> None:
    n_channels, inputs = [], []

    class Recorder(nn.Module):
        def __init__(
            self, channels: int, outputs: int, context_length: int, image: tuple[int, int]
        ) -> None:
            super().__init__()
            n_channels.append(channels)

        def forward(self, x: Tensor, t: Tensor, context: Tensor) -> Tensor:
            inputs.append(x)
            return x

    options = DenoiserOptions(geometry_channels=points, normals=normals)
    denoiser = Denoiser(Recorder, ALPHA_BAR, GridContexts((2, 1, 1), ("cube",)), options)
    x_t, geometry = torch.full((1, 3, 32, 32), 7.0), torch.arange(6.0)[:, None, None]
    geometry = geometry.expand(1, 6, 32, 32)
    denoiser.predict(geometry, torch.zeros(1, 5))(x_t, 30)
    expected = [7, 7, 7] + [0, 1, 2] * points + [3, 4, 5] * normals
    assert n_channels == [len(expected)]
    assert inputs[0][0, :, 0, 0].tolist() == expected


def test_pixels_and_frame_of_a_context(denoiser: Denoiser) -> None:
    """As published, a part fills the box of its cells, and each cell has 512 pixels of its own."""
    box, upright = np.array([[2.0, 3, 4], [6, 5, 6]]), np.eye(3)
    assert len(denoiser.pixels(("cube", None))) == 1024
    assert np.allclose(denoiser.frame(box, upright, ("cube", None)).apply(box)[:, 0], [-1, 1])
    published = halving(pads=True)
    assert published.pixels((None, "c")).tolist() == [*range(512, 1024)]
    assert len(published.pixels(("c", "c"))) == 1024
    for context, ends in {("c", None): [-1, 0], (None, "c"): [0, 1], ("c", "c"): [-1, 1]}.items():
        placed = published.frame(box, upright, context).apply(box)
        assert np.allclose(placed[:, 0], ends) and np.allclose(placed[:, 1:].mean(axis=0), 0)


def test_padded_images_are_denoised_too(denoiser: Denoiser) -> None:
    points, normals = cloud(512, 1)
    sampler = build("sampler", {"plugin": "ddim", "steps": 2})
    denoised = denoiser.denoise(points, normals, [("cube", None)], sampler, 0)
    assert denoised.points.shape == (1, 512, 3)
    assert [log_p.shape for log_p in denoised.log_labels] == [(1, 512, n) for n in (6, 2, 2)]
    at = by_x(denoised.trajectory[0])
    assert np.array_equal(at, by_x(points.astype(np.float32)))


def test_log_probabilities_of_cells_are_the_classifiers(denoiser: Denoiser) -> None:
    """The last class is empty; without a classifier there is no such module."""
    points, normals = cloud()
    found = denoiser.log_cells(points, normals)
    assert found[0].shape == (2, 2, 5)
    both = np.concatenate([points, normals], axis=2).astype(np.float32)
    geometry = torch.from_numpy(both).transpose(1, 2).reshape(2, 6, 32, 32)  # in any order
    for own, expected in zip(found, denoiser.classifier.log_cells(geometry), strict=True):
        assert own == pytest.approx(expected.detach().numpy(), abs=1e-5)
    assert not hasattr(halving(classifier=False), "classifier")


def test_wrong_options_and_contexts_are_refused(denoiser: Denoiser) -> None:
    with pytest.raises(
        ValueError, match=r"denoiser\.target must be one of x0, noise, v, move; got 'mean'"
    ):
        DenoiserOptions(target="mean")
    with pytest.raises(ValueError, match="noise_scale must be a number, above 0"):
        DenoiserOptions(noise_scale=0.0)
    with pytest.raises(LookupError, match="no primitive named 'cone'"):
        denoiser.vectors([("cone", None)])


@pytest.mark.slow
@pytest.mark.parametrize("n_threads", [2, 3])
def test_results_do_not_depend_on_the_number_of_threads(n_threads: int) -> None:
    """To the last bit: a difference of a millionth leads to a different mesh."""
    denoiser = load_denoiser(build)
    points, normals = cloud(batch=3)
    sampler, contexts = build("sampler", {"plugin": "ddim", "steps": 5}), [("cube", "cube")] * 3

    def results() -> list[np.ndarray]:
        denoised = denoiser.denoise(points, normals, contexts, sampler, 0)
        return [denoised.points, *denoised.log_labels, *denoiser.log_cells(points, normals)]

    before = torch.get_num_threads()
    try:
        torch.set_num_threads(1)
        one = results()
        torch.set_num_threads(n_threads)
        for expected, found in zip(one, results(), strict=True):
            np.testing.assert_array_equal(found, expected)
        assert torch.get_num_threads() == n_threads
    finally:
        torch.set_num_threads(before)
