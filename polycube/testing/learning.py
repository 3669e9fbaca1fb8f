"""Requirements for primitive, schedule, model, sampler and data plugins."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.ndimage import label

from polycube.structure.lattice import is_manifold, lattice
from polycube.testing.solids import PRIMITIVES, claim, claim_array

CONTEXT = 13  # length for a 1x1 grid with two primitives
OUTPUTS = 5
IMAGE = (32, 32)


def check_primitive(plugin: Callable) -> None:
    """Voxels (3, 3, 3) bool: one solid without voids, with a manifold boundary."""
    voxels = plugin()
    claim_array(voxels, (3, 3, 3), "a primitive")
    claim(voxels.dtype == bool, "a primitive is bool", voxels.dtype)
    claim(label(voxels)[1] == 1, "the voxels are one solid, joined by faces")
    claim(label(~np.pad(voxels, 1), np.ones((3, 3, 3)))[1] == 1, "the solid has no voids")
    claim(is_manifold(lattice((1, 1, 1), ("it",), {"it": voxels})), "the boundary is manifold")
    claim(np.array_equal(voxels, plugin()), "a primitive is the same every time")


def check_schedule(plugin: Callable) -> None:
    """alpha_bar (T + 1,): starts at 1, decreases strictly, positive at the end."""
    alpha_bar = plugin()
    claim_array(alpha_bar, (None,), "alpha_bar")
    claim(len(alpha_bar) >= 2, "alpha_bar has T + 1 >= 2 entries", len(alpha_bar))
    claim(alpha_bar[0] == 1, "alpha_bar starts at 1", alpha_bar[0])
    claim(alpha_bar[-1] > 0, "alpha_bar stays above 0", alpha_bar[-1])
    rises = np.flatnonzero(np.diff(alpha_bar) >= 0)
    claim(len(rises) == 0, "alpha_bar falls at every step", f"no fall at {rises[:3].tolist()}")
    steps = getattr(plugin, "steps", len(alpha_bar) - 1)
    claim(len(alpha_bar) == steps + 1, "alpha_bar has steps + 1 entries", len(alpha_bar))


def check_model(plugin: Callable) -> None:
    """(x (B, channels, h, w), t (B,), context (B, K)) -> (B, outputs, h, w), all trainable."""
    import torch

    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(0)
        network = plugin(channels=6, outputs=OUTPUTS, context_length=CONTEXT, image=IMAGE)
        x = torch.randn(4, 6, *IMAGE, requires_grad=True)
        context = torch.rand(4, CONTEXT, requires_grad=True)
        time = torch.rand(4)
    y = network(x, time, context)
    shape = (4, OUTPUTS, *IMAGE)
    claim(tuple(y.shape) == shape, f"the output has shape {shape}", tuple(y.shape))
    claim(bool(torch.isfinite(y).all()), "the output is finite")
    y.square().mean().backward()
    unused = [name for name, p in network.named_parameters() if p.requires_grad and p.grad is None]
    claim(not unused, "the gradient reaches every parameter", f"none at {', '.join(unused[:3])}")
    for name, given in (("image", x), ("context", context)):
        is_used = given.grad is not None and bool(given.grad.abs().max() > 0)
        claim(is_used, f"the output depends on the {name}")
    network.eval()
    with torch.no_grad():
        is_same = torch.equal(network(x, time, context), network(x, time, context))
        ignores_time = torch.equal(network(x, time, context), network(x, 1 - time, context))
        if getattr(plugin, "any_size", False):
            smaller = tuple(network(x[..., ::2, ::4], time, context).shape)
            claim(smaller == (4, OUTPUTS, 16, 8), "images of any size are accepted", smaller)
    claim(is_same, "the same input gives the same output")
    claim(not ignores_time, "the output depends on t")


def check_sampler(plugin: Callable) -> None:
    """x_T -> (x_0, states); with an exact network, the exact x_0."""
    import torch

    from polycube.diffusion.process import DiffusionProcess

    process = DiffusionProcess(np.linspace(1, 0.05, 41), noise_scale=0.3)
    draw = torch.Generator().manual_seed(0)
    x_T, exact = (torch.randn(2, 3, 8, 8, generator=draw, dtype=torch.float64) for _ in "ab")

    def sample() -> tuple[torch.Tensor, torch.Tensor]:
        return plugin(lambda x, t: exact, x_T, process, torch.Generator().manual_seed(1))

    x_0, states = sample()
    claim(x_0.shape == x_T.shape, f"x_0 has shape {tuple(x_T.shape)}", tuple(x_0.shape))
    fits = states.ndim == 5 and states.shape[1:] == x_T.shape
    claim(fits, "the states have shape (S, B, 3, h, w)", tuple(states.shape))
    claim(torch.equal(states[0], x_T), "the first state is x_T")
    claim(torch.equal(states[-1], x_0), "the last state is x_0")
    off = float((x_0 - exact).abs().max())
    claim(off < 1e-6, "a network that predicts x_0 exactly gives x_0", f"an error of {off:.2g}")
    claim(torch.equal(sample()[0], x_0), "the same generator gives the same sample")


def check_data(plugin: Callable) -> None:
    """An endless sequence of pairs, each determined by the seed and its number."""
    gridless = getattr(plugin, "gridless", False)
    grid = None if gridless else (2, 1, 1)
    pairs, same, other = (plugin(grid, PRIMITIVES, seed) for seed in (0, 0, 1))
    same(3)
    for index in (0, 10**6):
        pair = pairs(index)
        claim_array(pair.geometry, (None, 3), "the geometry")
        for name in ("normals", "polycube"):
            claim_array(getattr(pair, name), (len(pair.geometry), 3), f"the {name}")
        lengths = np.linalg.norm(pair.normals, axis=1)
        claim(np.allclose(lengths, 1), "the normals have unit length", lengths.max())
        (_check_gridless if gridless else _check_on_grid)(pair)
        claim(np.array_equal(pair.geometry, same(index).geometry), "pair i depends on i and seed")
        is_equal = np.array_equal(pair.geometry, other(index).geometry)
        claim(is_equal == getattr(plugin, "fixed", False), "another seed, another pair")


def _check_on_grid(pair: Any) -> None:
    """Labels and context of a pair on the grid (2, 1, 1)."""
    claim_array(pair.labels, (len(pair.geometry), 3), "the labels")
    low, high = pair.labels.min(axis=0), pair.labels.max(axis=0)
    claim((low >= 0).all() and (high < [6, 2, 2]).all(), "labels: axis, cell, wall", high)
    claim(len(pair.context) == 2, "the context names every cell", pair.context)
    known = {*PRIMITIVES, None}
    claim(set(pair.context) <= known, "the context is of known primitives", pair.context)


def _check_gridless(pair: Any) -> None:
    """Labels and polycube of a pair of an arbitrary structure."""
    claim_array(pair.labels, (len(pair.geometry), 2), "the labels")
    axis, knot = pair.labels.T
    claim(axis.min() >= 0 and axis.max() < 6, "labels: axis, knot", axis.max())
    claim(is_manifold(pair.solid), "the polycube is one solid")
    for a, knots in enumerate(pair.solid.knots):
        own = axis // 2 == a
        claim(knot[own].max() < len(knots), "labels number the knots of the polycube", knot.max())
        off = np.abs(pair.polycube[own, a] - knots[knot[own]]).max()
        claim(off < 1e-6, "places lie on the planes of their labels", f"{off:.2g} off")


LEARNING = {
    "primitive": check_primitive, "schedule": check_schedule, "model": check_model,
    "sampler": check_sampler, "data": check_data,
}  # fmt: skip
