"""Primitives are built by name or with options, and checked before anything is done with them."""

from dataclasses import dataclass

import numpy as np
import pytest

from polycube import registry
from polycube.config import compose
from polycube.diffusion.weights import load_denoiser, make_denoiser, save_denoiser
from polycube.errors import InputError
from polycube.pipeline.primitives import voxels


def test_the_primitives_of_the_paper():
    made = voxels(["cube", "hole_x"])
    assert list(made) == ["cube", "hole_x"]
    assert made["cube"].all() and not made["hole_x"][:, 1, 1].any()


@dataclass(frozen=True)
class Notch:
    depth: int = 1

    def __call__(self) -> np.ndarray:
        voxels = np.ones((3, 3, 3), bool)
        voxels[3 - self.depth :, :, 2] = False
        return voxels


@pytest.fixture
def notch(own_registry):
    registry.register("primitive", "notch")(Notch)


def test_options_of_a_primitive_are_used(notch):
    items = compose("infer", ["primitives.use=[cube,notch,{plugin:notch,depth:2}]"])["primitives"]
    made = voxels(items["use"])
    assert list(made) == ["cube", "notch", "notch_depth_2"]
    assert [(~made[name][:, 0, 2]).sum() for name in made] == [0, 1, 2]


@pytest.mark.parametrize(
    ("items", "sentence"),
    [
        ([{"plugin": "notch", "deep": 2}], "primitive=notch: .*'deep'; it takes .*depth"),
        ([{"plugin": "notch", "depth": "x"}], "depth must be a whole number; got 'x'"),
        ([{"depth": 2}], "a primitive is a name or {plugin: name"),
        (["notch", {"plugin": "notch"}], "primitives.use contains notch twice"),
    ],
)
def test_options_that_make_no_sense_are_refused(items, sentence, notch):
    with pytest.raises(InputError, match=sentence):
        voxels(items)


def test_weights_keep_the_options_of_primitives(notch, tmp_path):
    items = ["cube", {"plugin": "notch", "depth": 2}]
    config = {
        "grid": [1, 1, 1],
        "primitives": items,
        "schedule": {"plugin": "linear", "steps": 2},
        "model": {"plugin": "tiny"},
        "options": {},
    }
    folder = tmp_path / "weights"
    save_denoiser(make_denoiser(config, registry.build), config, {}, folder)
    trained = load_denoiser(registry.build, folder)
    assert trained.condition.primitives == ("cube", "notch_depth_2")
    assert not voxels(trained.condition.cells)["notch_depth_2"][1:, 0, 2].any()


@pytest.mark.parametrize("made", [np.ones((4, 4, 4), bool), np.ones((3, 3, 3)), [True]])
def test_other_voxels_are_refused(made, own_registry):
    @registry.register("primitive", "mine")
    @dataclass(frozen=True)
    class Mine:
        def __call__(self) -> object:
            return made

    with pytest.raises(InputError, match=r"primitive mine must be 3 x 3 x 3 voxels"):
        voxels(["mine"])
