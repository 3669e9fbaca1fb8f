"""Pairs as batches: what an image holds, and that nothing is seen twice."""

import numpy as np
import torch

from polycube.diffusion.dataset import Onwards, PairImages, training_loader, validation_loader
from polycube.diffusion.encoding import to_points, x_order
from polycube.diffusion.pairs import Pairs


def test_images_show_the_pair_sorted_by_the_geometrys_x(pairs: Pairs, primitives: dict) -> None:
    pair = pairs(7)
    geometry, polycube, context = PairImages(pairs, tuple(primitives))[7]
    assert geometry.dtype == polycube.dtype == context.dtype == torch.float32
    order = x_order(pair.geometry)
    assert np.allclose(to_points(geometry.numpy(), order), pair.geometry, atol=1e-6)
    assert np.allclose(to_points(polycube.numpy(), order), pair.polycube, atol=1e-6)
    assert (np.diff(geometry[0].ravel()) >= 0).all()
    assert context.sum() == sum(name is not None for name in pair.context)


def test_epochs_follow_one_another() -> None:
    sampler = Onwards(6)
    first = list(sampler)
    sampler.set_epoch(1)
    assert first + list(sampler) == list(range(12))
    assert len(sampler) == 6


def test_batches_do_not_depend_on_the_number_of_workers(pairs: Pairs, primitives: dict) -> None:
    dataset = PairImages(pairs, tuple(primitives))
    alone, helped = (list(training_loader(dataset, 4, 3, workers)) for workers in (0, 1))
    assert len(alone) == 3
    for a, b in zip(alone, helped, strict=True):
        assert all(torch.equal(x, y) for x, y in zip(a, b, strict=True))


def test_held_out_pairs_are_the_first_of_their_stream(pairs: Pairs, primitives: dict) -> None:
    dataset = PairImages(pairs, tuple(primitives))
    batches = list(validation_loader(dataset, 5, 2))
    assert [len(b[0]) for b in batches] == [2, 2, 1]
    assert torch.equal(batches[2][0][0], dataset[4][0])
