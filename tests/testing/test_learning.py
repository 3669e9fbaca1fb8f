"""Every violated requirement of a learning plugin is reported."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from polycube.diffusion.pairs.any_structure import LatticePair, LatticePairs
from polycube.testing import check
from tests.testing.broken import assert_refused, broken, voxels


@pytest.mark.parametrize(
    ("alpha_bar", "message"),
    [
        ([1.0, 0.5], "numpy array; got list"),
        (np.ones((2, 2)), r"shape \(any\); got \(2, 2\)"),
        (np.array([1.0, np.nan]), "finite"),
        (np.array([1.0]), "T . 1 >= 2 entries; got 1"),
        (np.array([0.9, 0.5]), "starts at 1; got 0.9"),
        (np.array([1.0, 0.5, 0.0]), "stays above 0"),
        (np.array([1.0, 0.5, 0.5]), r"falls at every step; got no fall at \[1\]"),
    ],
)
def test_schedule(alpha_bar, message: str) -> None:
    assert_refused("schedule", lambda: alpha_bar, message)


def test_schedule_has_as_many_entries_as_steps() -> None:
    @dataclass(frozen=True)
    class Short:
        steps: int = 5

        def __call__(self) -> np.ndarray:
            return np.array([1.0, 0.5])

    with pytest.raises(AssertionError, match=r"steps \+ 1 entries; got 2"):
        check("schedule", Short())


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        (np.ones((3, 3), bool), "shape"),
        (np.ones((3, 3, 3)), "bool; got float64"),
        (np.zeros((3, 3, 3), bool), "one solid"),
        (voxels(*[(1, j, k) for j in range(3) for k in range(3)]), "one solid"),
        (voxels((1, 1, 1)), "no voids"),
        (voxels(*[(i, j, k) for k in range(3) for i, j in ((0, 0), (1, 1))]), "manifold"),
    ],
)
def test_primitive(shape: np.ndarray, message: str) -> None:
    assert_refused("primitive", lambda: shape, message)


def test_primitive_that_changes() -> None:
    shapes = iter([voxels(), voxels((0, 0, 0))])
    assert_refused("primitive", lambda: next(shapes), "the same every time")


def test_model() -> None:
    torch = pytest.importorskip("torch")

    class Network(torch.nn.Module):
        def __init__(self, channels: int, outputs: int, context_length: int) -> None:
            super().__init__()
            self.mix = torch.nn.Conv2d(channels, outputs, 1)
            self.bend = torch.nn.Linear(context_length, outputs)

        def forward(self, x, t, context):
            side = self.bend(context) + t[:, None]
            return self.mix(x) + side[..., None, None]

    class Narrow(Network):
        def forward(self, x, t, context):
            return super().forward(x, t, context)[:, :2]

    class Infinite(Network):
        def forward(self, x, t, context):
            return super().forward(x, t, context) / 0

    class Idle(Network):
        def forward(self, x, t, context):
            return self.mix(x) + t[:, None, None, None]

    class Blind(Network):
        def forward(self, x, t, context):
            outputs = super().forward(torch.zeros_like(x), t, context)
            return outputs + 0 * x[:, :1]

    class Random(Network):
        def forward(self, x, t, context):
            return super().forward(x, t, context) + torch.rand(())

    class Timeless(Network):
        def forward(self, x, t, context):
            return super().forward(x, 0 * t, context)

    def plugin(network: type) -> object:
        return broken(
            lambda channels, outputs, context_length, image: network(
                channels, outputs, context_length
            )
        )

    check("model", plugin(Network))

    class Whole(Network):
        def forward(self, x, t, context):
            return super().forward(x, t, context)[..., :32, :32].reshape(len(x), -1, 32, 32)

    made_for_one = plugin(Whole)
    check("model", made_for_one)
    object.__setattr__(made_for_one, "any_size", True)
    with pytest.raises(RuntimeError, match="invalid for input of size"):
        check("model", made_for_one)

    for network, message in [
        (Narrow, r"shape \(4, 5, 32, 32\); got \(4, 2, 32, 32\)"),
        (Infinite, "output is finite"),
        (Idle, "every parameter; got none at bend.weight"),
        (Blind, "depends on the image"),
        (Random, "same input gives the same output"),
        (Timeless, "depends on t"),
    ]:
        with pytest.raises(AssertionError, match=message):
            check("model", plugin(network))


def test_sampler() -> None:
    torch = pytest.importorskip("torch")

    def jump(predict, x_T, process, generator):
        x_0 = predict(x_T, process.steps)
        return x_0, torch.stack([x_T, x_0])

    check("sampler", broken(jump))
    assert_refused("sampler", lambda p, x, *_: (x[:1], torch.stack([x, x])), r"x_0 has shape")
    assert_refused("sampler", lambda p, x, *_: (x, x), "states have shape")
    assert_refused(
        "sampler", lambda p, x, *_: (p(x, 1), torch.stack([p(x, 1)] * 2)), "first state is x_T"
    )
    assert_refused("sampler", lambda p, x, *_: (p(x, 1), torch.stack([x, x])), "last state is x_0")
    assert_refused("sampler", lambda p, x, *_: (x, torch.stack([x, x])), "predicts x_0 exactly")

    def careless(predict, x_T, process, generator):
        x_0 = predict(x_T, 1) + 1e-9 * torch.rand(x_T.shape)
        return x_0, torch.stack([x_T, x_0])

    assert_refused("sampler", careless, "same generator")


@dataclass(frozen=True)
class Pair:
    geometry: np.ndarray
    normals: np.ndarray
    polycube: np.ndarray
    labels: np.ndarray
    context: tuple


NORMALS = np.tile([0.0, 0.6, 0.8], (8, 1))


def test_data() -> None:
    def stream(
        polycube=(8, 3),
        context=("cube", None),
        seeded=True,
        lucky=False,
        normals=NORMALS,
        labels=(5, 1, 1),
    ):
        def start(grid, primitives, seed):
            state = np.random.default_rng(seed)

            def pair(index: int) -> Pair:
                rng = state if lucky else np.random.default_rng([seed * seeded, index])
                geometry, of_points = rng.normal(size=(8, 3)), np.tile(labels, (8, 1))
                return Pair(geometry, normals, np.zeros(polycube), of_points, context)

            return pair

        return start

    check("data", broken(stream()))
    assert_refused("data", stream(polycube=(7, 3)), r"polycube has shape \(8, 3\); got \(7, 3\)")
    assert_refused("data", stream(normals=NORMALS[:7]), r"normals has shape \(8, 3\); got \(7, 3\)")
    assert_refused("data", stream(normals=2 * NORMALS), "normals have unit length; got 2")
    assert_refused("data", stream(labels=(6, 0, 0)), r"labels: axis, cell, wall; got \[6 0 0\]")
    assert_refused("data", stream(labels=(0, 2, 0)), "labels: axis, cell, wall")
    assert_refused("data", stream(labels=(0, 0, -1)), "labels: axis, cell, wall")
    assert_refused("data", stream(context=("cube",)), "names every cell")
    assert_refused("data", stream(context=("cube", "ball")), "known primitives")
    assert_refused("data", stream(seeded=False), "another seed")
    assert_refused("data", stream(lucky=True), "depends on i and seed")


def lattices(change: Callable[[LatticePair], dict[str, object]]) -> object:
    """A plugin of pairs without a grid, with some fields changed."""

    def start(grid: None, primitives: dict, seed: int) -> Callable[[int], LatticePair]:
        pairs = LatticePairs(seed, 64)

        def pair(index: int) -> LatticePair:
            found = pairs(index)
            return replace(found, **change(found))

        return pair

    plugin = broken(start)
    type(plugin).gridless = True
    return plugin


def test_data_without_a_grid() -> None:
    check("data", lattices(lambda pair: {}))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda pair: {"labels": pair.labels[:, :1]}, r"labels has shape \(64, 2\)"),
        (lambda pair: {"labels": np.add(pair.labels, [6, 0])}, "labels: axis, knot"),
        (lambda pair: {"labels": np.add(pair.labels, [0, 9])}, "labels number the knots"),
        (lambda pair: {"polycube": pair.polycube + 0.01}, "planes of their labels"),
        (
            lambda pair: {"solid": replace(pair.solid, occupancy=pair.solid.occupancy & False)},
            "one solid",
        ),
    ],
)
def test_data_without_a_grid_is_refused(change: Callable, message: str) -> None:
    with pytest.raises(AssertionError, match=message):
        check("data", lattices(change))
