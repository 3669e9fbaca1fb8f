"""An estimate of what the published recipe can reach, without a training.

    python docs/notes/recipe_limit.py OUTPUT [PAIRS]

The loss of `experiment=paper` is the squared error of the predicted noise z.  Its minimum over all
networks is the conditional mean E[z | x_t, t, context].  The training pairs of a context are one
polycube with little noise, sorted by x, so the mean for one pixel is a sum over points p of the
polycube:

    x_t = m(p) + sigma z + c_t / c_T eta,   m(p) = sqrt(alpha_bar_t) p + c_t / c_T g(p)

g(p) is the point of the geometry and eta its noise.  Each p stands for the points around it in its
face, by a normal distribution as wide as the points are apart.  The prior of pixel i of N is the
density of the i-th of N sorted values at the rank of p.  Other pixels are not taken into account,
so the loss is an upper bound of the smallest one.  The sums take the place of the U-Net in the
documented evaluation: held-out pairs, DDPM with 500 steps.  For contexts that are not among the
nine published types, they are those of a network that would have been trained on them.

OUTPUT is a JSON file with the loss and the columns of `polycube.evaluate`.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import torch
from scipy.spatial import cKDTree
from scipy.stats import beta
from torch import Tensor

from polycube.cli.train import HELD_OUT
from polycube.config import compose
from polycube.diffusion.conditions import GridContexts
from polycube.diffusion.denoiser import Denoiser, DenoiserOptions
from polycube.diffusion.encoding import to_pixels, x_order
from polycube.diffusion.pairs.pairs import Pairs
from polycube.diffusion.pairs.templates import Context
from polycube.diffusion.process import Predict
from polycube.diffusion.training.evaluation import evaluate, summary
from polycube.pipeline.primitives import voxels
from polycube.plugins.data import published
from polycube.registry import build

SAMPLES = 4  # training pairs whose points stand for the polycube
LOSS_PAIRS = 900  # training pairs whose loss is measured
WIDTH = 4.0  # standard deviations of a rank that the sums reach
GRID = (2, 1, 1)


class Places:
    """Points that may be at each pixel of a context, with their probability.

    p : (N, K, 3) points of the polycube; g : (N, K, 3) the same points of the geometry; along :
        (N, K, 3) 1 in the directions of the face; log_prior : (N, K); scale : of the geometry;
        width : distance of the points
    """

    def __init__(self, pairs: Pairs, context: Context) -> None:
        contexts = len(pairs.contexts)
        first = pairs.contexts.index(context)
        made = [pairs(first + contexts * i) for i in range(SAMPLES)]
        n_points = len(made[0].geometry)
        joined = {
            name: np.concatenate([getattr(m, name) for m in made])
            for name in ("geometry", "polycube", "labels")
        }
        extents = [np.ptp(joined[name], axis=0).max() for name in ("geometry", "polycube")]
        self.scale = float(extents[0] / extents[1])
        apart = cKDTree(joined["polycube"]).query(joined["polycube"], k=2)[0][:, 1]
        self.width = 2 * float(np.median(apart))  # 1 / sqrt(density) of random points
        order = np.argsort(joined["geometry"][:, 0], kind="stable")
        rank = (np.arange(len(order)) + 0.5) / len(order)
        i = np.arange(n_points)
        mean = (i + 1) / (n_points + 1)
        half = int(WIDTH * 0.5 / n_points**0.5 * len(order))
        window = np.arange(-half, half + 1)
        near = np.rint(mean * len(order)).astype(int)[:, None] + window
        inside = (near >= 0) & (near < len(order))
        near = near.clip(0, len(order) - 1)
        density = beta.logpdf(rank[near], (i + 1)[:, None], (n_points - i)[:, None])
        self.log_prior = torch.from_numpy(np.where(inside, density, -np.inf)).float()
        self.p, self.g = (
            torch.from_numpy(joined[name][order][near]).float() for name in ("polycube", "geometry")
        )
        self.along = 1 - torch.eye(3)[joined["labels"][order, 0][near] // 2]


class PointwiseMean(Denoiser):
    """The sums over the points of a polycube as a denoiser."""

    def __init__(self, pairs: Pairs, primitives: Sequence[str], jitter: float) -> None:
        cfg = compose("train", ["experiment=paper"])
        options = DenoiserOptions(**cfg["denoiser"], pads=True)
        schedule = build("schedule", cfg["schedule"])
        model = build("model", {"plugin": "tiny"})
        super().__init__(model, schedule(), GridContexts(GRID, tuple(primitives)), options)
        self.places = cache(lambda context: Places(pairs, context))
        self.variance = jitter**2 / 3  # of the noise of the geometry
        self.contexts = pairs.contexts

    def predict(self, geometry: Tensor, context: Tensor) -> Predict:
        known = {tuple(self.condition.vector(c).tolist()): c for c in self.contexts}
        places = [self.places(known[tuple(each.tolist())]) for each in context]
        q = self.process.adjustment(geometry[:, :3])

        def x_0(x_t: Tensor, t: int) -> Tensor:
            said = torch.stack([self.noise(x, t, of) for x, of in zip(x_t, places, strict=True)])
            return self.process.origin(x_t, said, q, torch.full((len(x_t),), t))

        return x_0

    def noise(self, x_t: Tensor, t: int, of: Places) -> Tensor:
        """E[z | x_t] of an image (3, height, width); zeros, as the padding, have no point."""
        process = self.process
        share = float(process.drift[t] / process.drift[-1])
        signal, spread = float(process.alpha_bar[t]) ** 0.5, float(1 - process.alpha_bar[t])
        slope = signal + share * of.scale
        variance = spread + share**2 * self.variance + (slope * of.width) ** 2 * of.along
        n_points = len(of.p)
        x = x_t.reshape(3, -1).T
        wanted = signal * of.p + share * of.g  # (N, K, 3)
        off = x[:n_points, None] - wanted
        off /= variance
        weight = (of.log_prior - (off.square() * variance).sum(dim=2) / 2).softmax(dim=1)
        mean = torch.einsum("nk,nkd->nd", weight, off)
        z = x / spread**0.5  # of padding, whose x_0 and geometry are zero
        z[:n_points] = mean * spread**0.5
        return z.T.reshape(x_t.shape)


def loss(denoiser: PointwiseMean, pairs: Pairs, n_pairs: int) -> float:
    """Mean squared error of the predicted noise of training pairs."""
    process, condition = denoiser.process, denoiser.condition
    generator, errors = torch.Generator().manual_seed(0), []
    for number in range(n_pairs):
        pair = pairs(number + SAMPLES * len(pairs.contexts))  # none of those of the sums
        order = x_order(pair.geometry)
        geometry, x_0 = (
            torch.from_numpy(to_pixels(points, order, condition.image))[None]
            for points in (pair.geometry, pair.polycube)
        )
        t = torch.randint(1, process.steps + 1, (1,), generator=generator)
        z = torch.randn(x_0.shape, generator=generator)
        x_t = process.forward(x_0, z, process.adjustment(geometry), t)
        said = denoiser.noise(x_t[0], int(t), denoiser.places(pair.context))
        errors.append((said - z[0]).square().mean())
    return float(torch.stack(errors).mean())


def main(output: Path, n_pairs: int) -> None:
    """Evaluate the sums and write the columns."""
    torch.set_num_threads(1)
    cfg = compose("evaluate")
    primitives = voxels(compose("train")["primitives"]["use"])
    held_out = build("data", cfg["data"])(GRID, primitives, cfg["seed"] + HELD_OUT)
    held_out.pads = True
    recipe, nine = build("data", {"plugin": "paper"}), published(GRID, primitives)
    trained = recipe(GRID, primitives, cfg["seed"])
    trained.contexts = held_out.contexts
    denoiser = PointwiseMean(trained, list(primitives), recipe.jitter)
    sampler = build("sampler", {"plugin": "ddpm"})
    made, columns = evaluate(denoiser, held_out, n_pairs, primitives, sampler, batch_size=8)
    own = recipe(GRID, primitives, cfg["seed"])  # the nine types
    found = {"pairs": n_pairs, "loss": loss(denoiser, own, LOSS_PAIRS)}
    for name, kept in (("nine types", True), ("others", False)):
        chosen = [
            c for pair, c in zip(made, columns, strict=True) if (pair.context in nine) == kept
        ]
        found[name] = {"pairs": len(chosen), **summary(chosen)}
    found["all"] = summary(columns)
    output.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 240)
