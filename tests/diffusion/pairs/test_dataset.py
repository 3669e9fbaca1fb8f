"""Pairs as batches: the content of an image, and that no pair is used twice."""

import numpy as np
import pytest
import torch

from polycube.diffusion.conditions import GridContexts
from polycube.diffusion.encoding import by_x, to_points
from polycube.diffusion.pairs.dataset import (
    Batch,
    ConsecutiveNumbers,
    HeldOut,
    PairImages,
    training_loader,
    validation_loader,
)
from polycube.diffusion.pairs.pairs import Pairs
from polycube.registry import build


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
    processes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No pair twice, none left out; together the batches are those of a single process."""
    numbers, held_out = [], []
    for rank in range(processes):
        monkeypatch.setattr(
            "polycube.diffusion.pairs.dataset.rank_and_processes", lambda r=rank: (r, processes)
        )
        epochs = [ConsecutiveNumbers(6, lambda done=done: done) for done in (0, 6 * processes)]
        numbers.append([number for epoch in epochs for number in epoch])
        assert len(numbers[-1]) == 2 * len(epochs[0]) == 12
        held_out.append(list(HeldOut(12)))
        assert len(held_out[-1]) == len(HeldOut(12)) == 12 // processes
    assert np.array_equal(np.sort(np.ravel(held_out)), np.arange(12))
    assert np.array_equal(np.sort(np.ravel(numbers)), np.arange(12 * processes))
    for start in range(0, 12, 3):  # batches of three each
        together = np.sort(np.array(numbers)[:, start : start + 3].ravel())
        assert np.array_equal(together, np.arange(start * processes, (start + 3) * processes))


def test_batches_do_not_depend_on_the_number_of_workers(pairs: Pairs, primitives: dict) -> None:
    dataset = PairImages(pairs, GridContexts(pairs.grid, tuple(primitives)))
    alone, helped = (list(training_loader(dataset, 4, 3, n, lambda: 5)) for n in (0, 1))
    assert alone[0].number.tolist() == [5, 6, 7, 8]
    assert len(alone) == 3
    for a, b in zip(alone, helped, strict=True):
        assert all(torch.equal(x, y) for x, y in zip(a, b, strict=True))


def test_held_out_pairs_are_the_first_of_their_stream(pairs: Pairs, primitives: dict) -> None:
    dataset = PairImages(pairs, GridContexts(pairs.grid, tuple(primitives)))
    batches = list(validation_loader(dataset, 5, 2))
    assert [batch.number.tolist() for batch in batches] == [[0, 1], [2, 3], [4]]
    assert torch.equal(batches[2].geometry[0], dataset[4].geometry)


def test_held_out_pairs_are_made_once(pairs: Pairs, primitives: dict) -> None:
    made = []

    class Counted(PairImages):
        def __getitem__(self, index: int) -> Batch:
            made.append(index)
            return super().__getitem__(index)

    loader = validation_loader(Counted(pairs, GridContexts(pairs.grid, tuple(primitives))), 3, 2)
    first, second = list(loader), list(loader)
    assert made == [0, 1, 2]
    assert all(torch.equal(a.geometry, b.geometry) for a, b in zip(first, second, strict=True))
