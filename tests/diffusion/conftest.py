"""Small denoisers and the paper's primitives."""

import numpy as np
import pytest

from polycube.diffusion.denoiser import Denoiser, DenoiserOptions
from polycube.diffusion.pairs.pairs import Pairs
from polycube.diffusion.weights import make_denoiser
from polycube.registry import build

PRIMITIVES = ("cube", "hole_z", "hole_x", "hole_y")
CONFIG = {
    "grid": [2, 1, 1],
    "primitives": list(PRIMITIVES),
    "schedule": {"plugin": "linear", "steps": 50},
    "model": {"plugin": "tiny"},
    "options": {"target": "x0", "noise_scale": 0.25, "pads": False},
}


@pytest.fixture(scope="session")
def primitives() -> dict[str, np.ndarray]:
    return {name: build("primitive", {"plugin": name})() for name in PRIMITIVES}


@pytest.fixture(scope="session")
def pairs(primitives: dict[str, np.ndarray]) -> Pairs:
    return build("data", {"plugin": "paired"})((2, 1, 1), primitives, seed=0)


@pytest.fixture
def config() -> dict[str, object]:
    return CONFIG


@pytest.fixture
def denoiser(config: dict[str, object]) -> Denoiser:
    made = make_denoiser(config, build)
    assert made.options == DenoiserOptions()
    return made
