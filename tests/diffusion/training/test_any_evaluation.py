"""Measures of networks with known outputs."""

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from polycube.diffusion.conditions import AnyStructure
from polycube.diffusion.denoiser import Denoiser, DenoiserOptions
from polycube.diffusion.pairs.any_structure import LatticePairs
from polycube.diffusion.training.any_evaluation import evaluate_any
from polycube.diffusion.training.evaluation import summary
from polycube.registry import build
from polycube.structure.lattice import nearest_axis

PAIRS = LatticePairs(0, 256)
OPTIONS = {"classifier": False}


class Normals(nn.Module):
    """Leaves points where they are; the axis nearest to the normal, always the first knot."""

    def forward(self, x: Tensor, t: Tensor, context: Tensor) -> Tensor:
        signed = torch.stack([x[:, 6:], -x[:, 6:]], dim=2).flatten(1, 2)  # +x -x +y -y +z -z
        knots = nn.functional.one_hot(torch.zeros(len(x), *x.shape[2:]).long(), 7).movedim(-1, 1)
        return torch.cat([x[:, 3:6], signed, knots], dim=1)


def measured(**options: bool) -> dict[str, float]:
    alpha_bar = build("schedule", {"plugin": "linear", "steps": 20})()
    denoiser = Denoiser(
        lambda *_: Normals(), alpha_bar, AnyStructure(), DenoiserOptions(**OPTIONS, **options)
    )
    sampler = build("sampler", {"plugin": "ddim"})
    return summary(evaluate_any(denoiser, PAIRS, 6, sampler, batch_size=4))


def test_columns_of_a_network_that_uses_normals() -> None:
    found, pairs = measured(), [PAIRS(i) for i in range(6)]
    moved = [np.linalg.norm(pair.geometry - pair.polycube, axis=1) for pair in pairs]
    for name in ("error", "error_one_step", "error_untouched"):
        assert found[name] == pytest.approx(np.mean(moved), abs=1e-5)
    assert found["labelled_axis"] == pytest.approx(found["nearest_axis"], abs=1e-3)
    assert found["labelled_knot"] == np.mean([pair.labels[:, 1] == 0 for pair in pairs])
    assert "labelled_axis" not in measured(labels=False)


def test_the_nearest_axis_of_a_normal() -> None:
    normals = np.array([[0.9, 0.1, 0], [-0.8, 0.5, 0.1], [0, 0.6, -0.5], [0.1, 0.2, -0.9]])
    assert nearest_axis(normals).tolist() == [0, 1, 2, 5]
