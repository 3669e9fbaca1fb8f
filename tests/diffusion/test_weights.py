"""Weights on disk: loading returns the same network, or an error with the reason."""

import json
from pathlib import Path

import pytest
import torch
import yaml

from polycube.diffusion.denoiser import Denoiser
from polycube.diffusion.weights import (
    SHIPPED,
    begin_from,
    load_denoiser,
    make_denoiser,
    save_denoiser,
    shipped,
    shipped_grids,
)
from polycube.errors import InputError
from polycube.registry import build


def _answer(denoiser: Denoiser) -> torch.Tensor:
    image = torch.randn(1, 6, 32, 32, generator=torch.Generator().manual_seed(0))
    with torch.no_grad():
        predict = denoiser.eval().predict(image, denoiser.vectors([("cube", "hole_z")]))
        return predict(image[:, :3], 40)


def test_loading_gives_the_saved_network(denoiser: Denoiser, config: dict, tmp_path: Path) -> None:
    """To the half precision of the file; from the folder as from the file."""
    path = save_denoiser(denoiser, config, {"error": 0.5}, tmp_path / "weights")
    for given in (path, path.parent):
        loaded = load_denoiser(build, given)
        assert torch.allclose(_answer(loaded), _answer(denoiser), atol=5e-3)
        assert not loaded.training
        assert loaded.condition.primitives == denoiser.condition.primitives
        assert loaded.condition.grid == (2, 1, 1)
    assert json.loads(path.with_suffix(".json").read_text()) == {"error": 0.5}
    assert yaml.safe_load(path.with_suffix(".yaml").read_text()) == config


@pytest.mark.parametrize("grid", shipped_grids())
def test_shipped_weights_know_their_grid_and_are_small(grid: tuple[int, ...]) -> None:
    denoiser = load_denoiser(build, grid=grid)
    assert denoiser.condition.grid == grid
    assert {"cube", "hole_z", "hole_x", "hole_y"} <= set(denoiser.condition.primitives)
    assert (shipped(grid) / "weights.safetensors").stat().st_size < 20e6


def test_the_papers_grid_ships_and_is_the_default() -> None:
    assert (2, 1, 1) in shipped_grids()
    assert shipped() == shipped((2, 1, 1)) == SHIPPED / "2x1"
    assert load_denoiser(build).condition.primitives == ("cube", "hole_z", "hole_x", "hole_y")


def test_a_grid_without_weights_is_refused_with_those_that_have_some() -> None:
    with pytest.raises(InputError, match=r"for grid 7x1, only for .*2x1.*; train.py grid=7x1"):
        load_denoiser(build, grid=(7, 1, 1))
    with pytest.raises(InputError, match="for grid 7x2x3, only"):
        shipped((7, 2, 3))


def test_grids_are_read_off_the_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("polycube.diffusion.weights.SHIPPED", tmp_path)
    for name in ("3x2", "2x1", "2x2x2", "1x1", "without"):
        (tmp_path / name).mkdir()
        if name != "without":
            (tmp_path / name / "weights.safetensors").touch()
    assert shipped_grids() == [(1, 1, 1), (2, 1, 1), (3, 2, 1), (2, 2, 2)]
    assert shipped((2, 2, 2)) == tmp_path / "2x2x2"


def test_files_that_are_not_there_or_do_not_fit_are_refused(
    denoiser: Denoiser, config: dict, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=r"no weights at .*nothing"):
        load_denoiser(build, tmp_path / "nothing.safetensors")
    path = save_denoiser(denoiser, config, {}, tmp_path)
    other = config | {"model": {"plugin": "tiny", "width": 16}}
    path.with_suffix(".yaml").write_text(yaml.safe_dump(other))
    with pytest.raises(InputError, match="does not contain the network of its config"):
        load_denoiser(build, path)
    path.with_suffix(".yaml").write_text(
        yaml.safe_dump(config | {"model": {"plugin": "elsewhere"}})
    )
    with pytest.raises(InputError, match="no model plugin named 'elsewhere'"):
        load_denoiser(build, path)
    path.with_suffix(".yaml").write_text(yaml.safe_dump(config))
    path.write_bytes(b"no tensors")
    with pytest.raises(InputError, match="does not contain the network of its config"):
        load_denoiser(build, path)


def test_begin_from_copies_tensors_of_equal_shape(denoiser: Denoiser, config: dict) -> None:
    """From 2x1 to 3x1: all except layers whose size depends on the context or the labels."""
    larger = make_denoiser(config | {"grid": [3, 1, 1]}, build)
    before = {name: tensor.clone() for name, tensor in larger.state_dict().items()}
    taken = begin_from(larger, denoiser)
    after, given = larger.state_dict(), denoiser.state_dict()
    fits = {name for name in given if given[name].shape == after[name].shape}
    assert taken == len(fits) < len(after)
    assert all(torch.equal(after[name], given[name]) for name in fits)
    assert all(torch.equal(after[name], before[name]) for name in set(after) - fits)
    assert set(after) - fits >= {"classifier.leave.2.weight", "network.leave.3.weight"}


def test_a_checkpoint_of_a_training_is_read_as_well(
    denoiser: Denoiser, config: dict, tmp_path: Path
) -> None:
    """As Lightning writes it, with other entries."""
    state = {f"denoiser.{name}": tensor for name, tensor in denoiser.state_dict().items()}
    path = tmp_path / "last.ckpt"
    made = {"state_dict": state | {"other": torch.ones(1)}, "hyper_parameters": {"config": config}}
    torch.save(made, path)
    loaded = load_denoiser(build, path).state_dict()
    assert all(torch.equal(loaded[name], tensor) for name, tensor in denoiser.state_dict().items())
    torch.save(made | {"hyper_parameters": {}}, path)
    with pytest.raises(InputError, match=r"last.ckpt does not contain the network of its config"):
        load_denoiser(build, path)
    with pytest.raises(InputError, match=r"no weights at .*first.ckpt"):
        load_denoiser(build, tmp_path / "first.ckpt")


def test_weights_that_name_the_order_of_points_still_load(config: dict) -> None:
    """Files of earlier versions, including the shipped ones, contain `order: x`."""
    make_denoiser(config | {"options": config["options"] | {"order": "x"}}, build)
    with pytest.raises(InputError, match="ordered by hilbert are no longer supported, only by x"):
        make_denoiser(config | {"options": config["options"] | {"order": "hilbert"}}, build)


def test_values_that_are_not_finite_are_refused(
    denoiser: Denoiser, config: dict, tmp_path: Path
) -> None:
    with torch.no_grad():
        next(denoiser.parameters()).flatten()[0] = torch.nan
    path = save_denoiser(denoiser, config, {}, tmp_path)
    with pytest.raises(InputError, match="values that are not finite"):
        load_denoiser(build, path)


def test_a_recipe_of_a_huge_network_takes_no_memory(
    denoiser: Denoiser, config: dict, tmp_path: Path
) -> None:
    path = save_denoiser(denoiser, config, {}, tmp_path)
    huge = {**config, "model": {"plugin": "unet", "width": 2**14}}
    path.with_suffix(".yaml").write_text(yaml.safe_dump(huge))
    with pytest.raises(InputError, match="other names or shapes"):
        load_denoiser(build, path)
