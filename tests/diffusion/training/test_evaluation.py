"""Measures of networks with known outputs, exactly."""

from collections.abc import Callable

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from polycube.diffusion.conditions import GridContexts
from polycube.diffusion.denoiser import Denoiser, DenoiserOptions
from polycube.diffusion.pairs.pairs import Pair, Pairs
from polycube.diffusion.pairs.templates import turned_contexts
from polycube.diffusion.point_network import ContextClassifier
from polycube.diffusion.training.data_module import Batch, PairImages
from polycube.diffusion.training.evaluation import (
    Columns,
    by_context,
    evaluate,
    point_columns,
    summary,
)
from polycube.diffusion.training.module import ROTATIONS
from polycube.registry import build
from polycube.structure.lattice import lattice

PRIMITIVES = ("cube", "hole_z", "hole_x", "hole_y")
GRID = (2, 1, 1)
N = 24  # pairs: one of each context


class Lookup(nn.Module):
    """Returns the stored image of the closest stored geometry, for any x_t and t."""

    def __init__(self, geometry: Tensor, images: Tensor) -> None:
        super().__init__()
        self.geometry, self.images = geometry, images

    def forward(self, x: Tensor, time: Tensor, context: Tensor) -> Tensor:
        apart = [(self.geometry - channels[3:6]).abs().mean(dim=(1, 2, 3)) for channels in x]
        return self.images[torch.stack(apart).argmin(dim=1)]


class Constant(ContextClassifier):
    """Returns the same logits for every geometry."""

    def __init__(self, logits: list[list[float]]) -> None:
        nn.Module.__init__(self)
        self.logits = torch.tensor(logits)

    def forward(self, geometry: Tensor) -> tuple[Tensor, Tensor]:
        return self.logits.expand(len(geometry), -1, -1), torch.zeros(len(geometry))


class LookupContext(ContextClassifier):
    """Returns the stored cells of the closest stored geometry, in each orientation."""

    def __init__(self, geometry: Tensor, turned: Tensor) -> None:
        nn.Module.__init__(self)
        every = torch.einsum("rij,njhw->nrihw", ROTATIONS, geometry)
        self.moments = third_moments(every.flatten(0, 1))
        self.cells = turned.flatten(0, 1)  # (N 24, cells)

    def forward(self, geometry: Tensor) -> tuple[Tensor, Tensor]:
        moments = third_moments(geometry[:, :3])
        cells = self.cells[torch.cdist(moments, self.moments).argmin(dim=1)]
        logits = 9.0 * nn.functional.one_hot(cells, len(PRIMITIVES) + 1)
        return logits, torch.zeros(len(geometry))


def third_moments(geometry: Tensor) -> Tensor:
    """(B, 27) of points (B, 3, h, w): different for geometries, equal for any order of points."""
    points = geometry.flatten(2).double()
    return torch.einsum("bin,bjn,bkn->bijk", points, points, points).flatten(1)


@pytest.fixture(scope="module")
def images(pairs: Pairs) -> Batch:
    made = [PairImages(pairs, GridContexts(GRID, PRIMITIVES))[i] for i in range(N)]
    return Batch(*(torch.stack(images) for images in zip(*made, strict=True)))


@pytest.fixture(scope="module")
def measured(pairs: Pairs, primitives: dict, images: Batch) -> Callable:
    """(outputs (N, 3 [+ 10], 32, 32), sampler, options) -> pairs and their columns."""

    def measure(
        outputs: Tensor, sampler: str = "ddim", **options: bool
    ) -> tuple[list[Pair], list[Columns]]:
        options = DenoiserOptions(**{"classifier": False, "normals": False, **options})
        network = Lookup(images.geometry[:, :3], outputs)
        alpha_bar = build("schedule", {"plugin": "linear", "steps": 20})()
        denoiser = Denoiser(lambda *_: network, alpha_bar, GridContexts(GRID, PRIMITIVES), options)
        chosen = build("sampler", {"plugin": sampler})
        return evaluate(denoiser, pairs, N, primitives, chosen, batch_size=10)

    return measure


@pytest.fixture(scope="module")
def right(images: Batch) -> Tensor:
    """The truth, and logits of its labels: (N, 13, 32, 32)."""
    one_hot = [
        nn.functional.one_hot(images.labels[:, i], size).movedim(-1, 1)
        for i, size in enumerate((6, 2, 2))
    ]
    return torch.cat([images.polycube, *(30.0 * labels for labels in one_hot)], dim=1)


@pytest.mark.slow
def test_a_network_with_perfect_outputs_has_no_errors(measured: Callable, right: Tensor) -> None:
    found = summary(measured(right)[1])
    for name in ("error", "error_p95", "error_one_step", "off_polycube"):
        assert found[name] == pytest.approx(0, abs=1e-6), name
    for prefix in ("", "labelled_"):
        for kind in ("patch", "cell", "wall"):
            assert found[prefix + kind] == 1, prefix + kind
    assert found["seconds"] > 0 and found["samples_per_second"] > 0


@pytest.mark.slow
def test_a_shift_is_measured_in_cells(measured: Callable, right: Tensor) -> None:
    """0.1 cell along x, by a network without labels."""
    shift = torch.tensor([0.1, 0, 0])[:, None, None]
    made, columns = measured(right[:, :3] + shift, labels=False)
    found = summary(columns)
    for name in ("error", "error_p95", "error_one_step"):
        assert found[name] == pytest.approx(0.1, abs=1e-6), name
    across = np.mean([(pair.labels[:, 0] < 2).mean() for pair in made])
    assert across - 0.05 < found["off_polycube"] / 0.1 < across + 0.05
    assert not [name for name in found if name.startswith(("labelled", "context", "turned"))]


@pytest.mark.slow
def test_untouched_is_the_distance_of_the_geometry(measured: Callable, right: Tensor) -> None:
    made, columns = measured(right)
    apart = [np.linalg.norm(pair.geometry - pair.polycube, axis=1).mean() for pair in made]
    assert summary(columns)["error_untouched"] == pytest.approx(np.mean(apart), abs=1e-12)


@pytest.mark.slow
def test_one_step_and_the_sampler_are_measured_apart(measured: Callable, right: Tensor) -> None:
    """DDPM draws x_0; the first prediction of the network is still perfect."""
    found = summary(measured(right, sampler="ddpm")[1])
    assert found["error_one_step"] == pytest.approx(0, abs=1e-6)
    assert found["error"] == pytest.approx(0, abs=1e-6)  # its last step is without noise


def test_labels_alone_change_the_closest_face(pairs: Pairs, primitives: dict) -> None:
    """Every point at the middle of the solid half of cube + hole_z: positions give no hint."""
    pair = pairs(pairs.contexts.index(("cube", "hole_z")))
    polycube = lattice(GRID, pair.context, primitives)
    middle = np.full((len(pair.labels), 3), 0.5)
    certain = [
        np.where(np.arange(size) == pair.labels[:, i, None], 0.0, -1e3)
        for i, size in enumerate((6, 2, 2))
    ]
    without = point_columns(pair, polycube, middle, middle, ())
    labelled = point_columns(pair, polycube, middle, middle, certain)
    assert without["wall"].mean() == pytest.approx((pair.labels[:, 2] == 0).mean())
    assert without["cell"].mean() == pytest.approx((pair.labels[:, 1] == 0).mean())
    for kind in ("patch", "cell", "wall"):
        assert (labelled[kind] == without[kind]).all()
        assert labelled[f"labelled_{kind}"].all(), kind


@pytest.mark.slow
def test_the_same_points_are_counted_whatever_the_batches(
    measured: Callable, right: Tensor, pairs: Pairs
) -> None:
    """Groups share out the pairs, and their means make up the mean."""
    noise = torch.randn(right.shape, generator=torch.Generator().manual_seed(0))
    made, columns = measured(right + 0.2 * noise)
    total = summary(columns)["error"]
    contexts = by_context(made, columns)
    assert set(contexts) == set(pairs.contexts)
    assert np.mean([group["error"] for group in contexts.values()]) == pytest.approx(total)


@pytest.mark.slow
def test_a_classifier_with_constant_output(pairs: Pairs, primitives: dict, images: Batch) -> None:
    """Counted by hand: box, or of genus 1 a cube and hole_z, or of genus 2 hole_z twice."""
    constant = Constant([[9.0, 1, 0.5, 0.2, 0.1], [9.0, 1.3, 0.5, 0.2, 0.1]])
    found = classified(pairs, primitives, images, constant)
    assert found["context_top1_any_genus"] == 3 / 24
    assert found["context_top1"] == (3 + 4 + 1) / 24
    # all of genus 0; a cell with hole_z, or with hole_y, or hole_x next to hole_z; all but hole_y's
    assert found["context_top3"] == (5 + 9 + 3) / 24


@pytest.mark.slow
def test_a_perfect_classifier_is_correct_in_all_orientations(
    pairs: Pairs, primitives: dict, images: Batch
) -> None:
    turned = torch.from_numpy(turned_contexts(pairs.contexts, GRID, primitives))
    found = classified(pairs, primitives, images, LookupContext(images.geometry[:, :3], turned))
    for name in ("context", "turned"):
        for column in ("top1", "top3", "top1_any_genus"):
            assert found[f"{name}_{column}"] == 1, (name, column)


def classified(
    pairs: Pairs, primitives: dict, images: Batch, classifier: nn.Module
) -> dict[str, float]:
    alpha_bar = build("schedule", {"plugin": "linear", "steps": 20})()
    network = Lookup(images.geometry[:, :3], images.polycube)
    options = DenoiserOptions(normals=False, labels=False)
    denoiser = Denoiser(lambda *_: network, alpha_bar, GridContexts(GRID, PRIMITIVES), options)
    denoiser.classifier = classifier
    sampler = build("sampler", {"plugin": "ddim"})
    return summary(evaluate(denoiser, pairs, N, primitives, sampler, batch_size=16)[1])
