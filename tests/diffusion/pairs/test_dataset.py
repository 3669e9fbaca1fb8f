"""Pairs as batches: the content of an image, and that no pair is used twice."""

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from polycube.diffusion.conditions import GridContexts
from polycube.diffusion.encoding import by_x, to_points
from polycube.diffusion.pairs.pairs import Pair, Pairs
from polycube.diffusion.training.data_module import ConsecutiveNumbers, PairData, PairImages
from polycube.registry import build


def data_of(pairs: Callable, primitives: dict, held_out: int = 0, workers: int = 0) -> PairData:
    """Batches of a training that has used five pairs, and held-out pairs."""
    condition = GridContexts((2, 1, 1), tuple(primitives))
    loading = {"batch_size": 4, "batches_per_epoch": 3, "workers": workers}
    data = PairData(pairs, lambda seed: pairs, condition, 0, (held_out, 0), **loading)
    data.trainer = SimpleNamespace(lightning_module=SimpleNamespace(pairs_done=5))
    return data


def test_images_show_the_pair_in_order(pairs: Pairs, primitives: dict) -> None:
    pair = pairs(7)
    shown = PairImages(pairs, GridContexts(pairs.grid, tuple(primitives)))[7]
    assert shown.geometry.dtype == shown.polycube.dtype == shown.context.dtype == torch.float32
    along = by_x(pair.geometry)
    both = np.hstack([pair.geometry, pair.normals])
    assert np.allclose(to_points(shown.geometry.numpy(), along), both, atol=1e-6)
    assert np.allclose(to_points(shown.polycube.numpy(), along), pair.polycube, atol=1e-6)
    assert np.array_equal(to_points(shown.labels.numpy(), along), pair.labels)
    assert shown.context.sum() == sum(name is not None for name in pair.context)
    assert shown.number == 7


def test_the_papers_order_is_by_x(pairs: Pairs, primitives: dict) -> None:
    shown = PairImages(pairs, GridContexts(pairs.grid, tuple(primitives)))[7]
    assert (np.diff(shown.geometry[0].ravel()) >= 0).all()


@pytest.mark.parametrize(("number", "empty"), [(0, slice(512, None)), (1, slice(512))])
def test_half_of_a_published_image_is_a_cell(number: int, empty: slice, primitives: dict) -> None:
    """The pixels of the empty cell are zero, before or behind the others, and have no label."""
    published = build("data", {"plugin": "paper"})((2, 1, 1), primitives, seed=0)
    shown = PairImages(published, GridContexts(published.grid, tuple(primitives)))[number]
    padded = torch.zeros(1024, dtype=torch.bool)
    padded[empty] = True
    padded = padded.reshape(32, 32)
    assert (shown.geometry[:, padded] == 0).all() and (shown.polycube[:, padded] == 0).all()
    assert (shown.labels[:, padded] == -1).all() and (shown.labels[:, ~padded] >= 0).all()
    assert (np.diff(shown.geometry[0].ravel()) >= 0).all()


def test_epochs_follow_one_another() -> None:
    done = 0
    sampler = ConsecutiveNumbers(6, lambda: done)
    first = list(sampler)
    done = 6
    assert first + list(sampler) == list(range(12))
    assert len(sampler) == 6


@pytest.mark.parametrize("processes", [2, 3])
def test_processes_share_the_numbers_and_their_batches_are_one(
    processes: int, pairs: Pairs, primitives: dict, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No pair twice, none left out; together the batches are those of a single process."""
    numbers, held_out = [], []
    for rank in range(processes):
        name = "polycube.diffusion.training.data_module.rank_and_processes"
        monkeypatch.setattr(name, lambda r=rank: (r, processes))
        epochs = [ConsecutiveNumbers(6, lambda done=done: done) for done in (0, 6 * processes)]
        numbers.append([number for epoch in epochs for number in epoch])
        assert len(numbers[-1]) == 2 * len(epochs[0]) == 12
        batches = data_of(pairs, primitives, held_out=12).val_dataloader()
        held_out.append([number for batch in batches for number in batch.number.tolist()])
        assert len(held_out[-1]) == 12 // processes
    assert np.array_equal(np.sort(np.ravel(held_out)), np.arange(12))
    assert np.array_equal(np.sort(np.ravel(numbers)), np.arange(12 * processes))
    for start in range(0, 12, 3):  # batches of three each
        together = np.sort(np.array(numbers)[:, start : start + 3].ravel())
        assert np.array_equal(together, np.arange(start * processes, (start + 3) * processes))


def test_batches_do_not_depend_on_the_number_of_workers(pairs: Pairs, primitives: dict) -> None:
    alone, helped = (list(data_of(pairs, primitives, workers=n).train_dataloader()) for n in (0, 1))
    assert alone[0].number.tolist() == [5, 6, 7, 8]
    assert len(alone) == 3
    for a, b in zip(alone, helped, strict=True):
        assert all(torch.equal(x, y) for x, y in zip(a, b, strict=True))


def test_held_out_pairs_are_the_first_of_their_stream(pairs: Pairs, primitives: dict) -> None:
    dataset = PairImages(pairs, GridContexts(pairs.grid, tuple(primitives)))
    batches = list(data_of(pairs, primitives, held_out=5).val_dataloader())
    assert [batch.number.tolist() for batch in batches] == [[0, 1, 2, 3], [4]]
    assert torch.equal(batches[1].geometry[0], dataset[4].geometry)


def test_held_out_pairs_are_made_once(pairs: Pairs, primitives: dict) -> None:
    made = []

    def counted(index: int) -> Pair:
        made.append(index)
        return pairs(index)

    loader = data_of(counted, primitives, held_out=3).val_dataloader()
    first, second = list(loader), list(loader)
    assert made == [0, 1, 2]
    assert all(torch.equal(a.geometry, b.geometry) for a, b in zip(first, second, strict=True))
