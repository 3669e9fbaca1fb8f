"""Weights on disk: the same network again, or a sentence that says why not."""

import json
from pathlib import Path

import pytest
import torch
import yaml

from polycube.diffusion.denoiser import Denoiser
from polycube.diffusion.weights import SHIPPED, load_denoiser, save_denoiser
from polycube.errors import InputError
from polycube.registry import build


def _answer(denoiser: Denoiser) -> torch.Tensor:
    image = torch.randn(1, 3, 32, 32, generator=torch.Generator().manual_seed(0))
    with torch.no_grad():
        return denoiser.eval().predict(image, denoiser.vectors([("cube", "hole_z")]))(image, 40)


def test_loading_gives_the_saved_network(denoiser: Denoiser, config: dict, tmp_path: Path) -> None:
    """To the half precision of the file; from the folder as from the file."""
    path = save_denoiser(denoiser, config, {"error": 0.5}, tmp_path / "weights")
    for given in (path, path.parent):
        again = load_denoiser(build, given)
        assert torch.allclose(_answer(again), _answer(denoiser), atol=5e-3)
        assert not again.training
        assert again.primitives == denoiser.primitives and again.grid == (2, 1, 1)
    assert json.loads(path.with_suffix(".json").read_text()) == {"error": 0.5}
    assert yaml.safe_load(path.with_suffix(".yaml").read_text()) == config


def test_shipped_weights_know_the_papers_grid_and_are_small() -> None:
    denoiser = load_denoiser(build)
    assert denoiser.grid == (2, 1, 1)
    assert denoiser.primitives == ("cube", "hole_z", "hole_x", "hole_y")
    assert SHIPPED.stat().st_size < 20e6


def test_files_that_are_not_there_or_do_not_fit_are_refused(
    denoiser: Denoiser, config: dict, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=r"no weights at .*nothing"):
        load_denoiser(build, tmp_path / "nothing.safetensors")
    path = save_denoiser(denoiser, config, {}, tmp_path)
    other = config | {"model": {"plugin": "tiny", "width": 16}}
    path.with_suffix(".yaml").write_text(yaml.safe_dump(other))
    with pytest.raises(InputError, match="does not hold the network of its config"):
        load_denoiser(build, path)
    path.with_suffix(".yaml").write_text(
        yaml.safe_dump(config | {"model": {"plugin": "elsewhere"}})
    )
    with pytest.raises(InputError, match="no model plugin named 'elsewhere'"):
        load_denoiser(build, path)
    path.with_suffix(".yaml").write_text(yaml.safe_dump(config))
    path.write_bytes(b"no tensors")
    with pytest.raises(InputError, match="does not hold the network of its config"):
        load_denoiser(build, path)


def test_a_checkpoint_of_a_training_is_read_as_well(
    denoiser: Denoiser, config: dict, tmp_path: Path
) -> None:
    """As Lightning writes it, other entries beside."""
    state = {f"denoiser.{name}": tensor for name, tensor in denoiser.state_dict().items()}
    path = tmp_path / "last.ckpt"
    made = {"state_dict": state | {"other": torch.ones(1)}, "hyper_parameters": {"config": config}}
    torch.save(made, path)
    again = load_denoiser(build, path).state_dict()
    assert all(torch.equal(again[name], tensor) for name, tensor in denoiser.state_dict().items())
    torch.save(made | {"hyper_parameters": {}}, path)
    with pytest.raises(InputError, match=r"last.ckpt does not hold the network of its config"):
        load_denoiser(build, path)
    with pytest.raises(InputError, match=r"no weights at .*first.ckpt"):
        load_denoiser(build, tmp_path / "first.ckpt")
