"""Trained denoisers as safetensors files, with a YAML file that describes them.

`weights.safetensors` holds the tensors; `weights.yaml` the grid, primitives, schedule, model and
options that are needed to build the network; `weights.json` the measured errors. There is no
pickle.
"""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from pickle import UnpicklingError
from typing import Any, TypedDict

import torch
import yaml
from safetensors.torch import load_file, save
from torch import Tensor

from polycube import HOME
from polycube.diffusion.conditions import condition
from polycube.diffusion.denoiser import Denoiser, DenoiserOptions
from polycube.errors import InputError, brief
from polycube.io.atomic import atomic_write

SHIPPED = HOME / "plugins" / "weights"  # a folder for each grid, such as 2x1, and any
PAPERS = (2, 1, 1)  # grid of the paper

# (kind, config) -> plugin: `polycube.registry.build`, an argument because it is in a higher layer
Build = Callable[[str, Mapping[str, object]], Callable]


class Recipe(TypedDict):
    """Plain values, as in YAML, from which an untrained denoiser is built."""

    grid: list[int] | None  # none for arbitrary structures
    primitives: list[str]
    schedule: dict[str, object]
    model: dict[str, object]
    options: dict[str, Any]  # options of DenoiserOptions


def shipped_grids() -> list[tuple[int, ...]]:
    """Grids with included weights, smallest first."""
    names = [path.parent.name for path in SHIPPED.glob("*x*/weights.safetensors")]
    grids = [tuple(map(int, (name + "x1").split("x")[:3])) for name in names]
    return sorted(grids, key=lambda grid: (math.prod(grid), grid))


def shipped(grid: Sequence[int] = PAPERS) -> Path:
    """Folder of the weights for a grid, () for any structure; raises InputError."""
    folder = SHIPPED / _name(grid)
    if not (folder / "weights.safetensors").is_file():
        known = ", ".join(map(_name, shipped_grids())) or "none"
        what = f"no weights are included for grid {_name(grid)}, only for {known}"
        raise InputError(what, remedy=f"train.py grid={_name(grid)} trains them")
    return folder


def _name(grid: Sequence[int]) -> str:
    """2x1 for (2, 1, 1), 2x2x2 for (2, 2, 2), any for ()."""
    return "x".join(map(str, grid if grid[2] > 1 else grid[:2])) if grid else "any"


def make_denoiser(config: Recipe, build: Build) -> Denoiser:
    """Untrained denoiser of a recipe; raises InputError for an order of points other than by x."""
    options = dict(config["options"])
    order = options.pop("order", "x")  # written by earlier versions
    if order != "x":
        raise InputError(f"points ordered by {order} are no longer supported, only by x")
    network, alpha_bar = build("model", config["model"]), build("schedule", config["schedule"])()
    own = condition(config["grid"], config["primitives"])
    return Denoiser(network, alpha_bar, own, DenoiserOptions(**options))


def save_denoiser(
    denoiser: Denoiser, config: Recipe, metrics: Mapping[str, float], folder: Path
) -> Path:
    """Write the three files, single precision as half; returns the safetensors file."""
    folder.mkdir(parents=True, exist_ok=True)
    own = denoiser.state_dict().items()
    halved = {name: each.half() if each.is_floating_point() else each for name, each in own}
    tensors = {name: each.contiguous().cpu() for name, each in halved.items()}
    texts = {".yaml": yaml.safe_dump(dict(config), sort_keys=False)}
    texts[".json"] = json.dumps(dict(metrics), indent=1) + "\n"
    path = folder / "weights.safetensors"
    with atomic_write(path) as temporary:
        temporary.write_bytes(save(tensors))
    for suffix, text in texts.items():
        with atomic_write(path.with_suffix(suffix)) as temporary:
            temporary.write_text(text)
    return path


def load_denoiser(
    build: Build, path: str | Path | None = None, grid: Sequence[int] = PAPERS
) -> Denoiser:
    """Trained denoiser from a safetensors file or its folder; without one, that of a grid.

    A checkpoint of a training (.ckpt), with its averaged weights, and the folder of a training are
    accepted as well. It computes on a GPU if there is one.
    """
    path = Path(path or shipped(grid))
    path = path / "weights" if (path / "weights").is_dir() else path
    path = path / "weights.safetensors" if path.is_dir() else path
    for needed in (path,) if path.suffix == ".ckpt" else (path, path.with_suffix(".yaml")):
        if not needed.is_file():
            raise InputError(f"no weights at {needed}; train.py writes them")
    try:
        if path.suffix == ".ckpt":
            config, tensors = _read_checkpoint(path)
        else:
            config = yaml.safe_load(path.with_suffix(".yaml").read_text())
            tensors = load_file(path)
        with torch.device("meta"):  # without memory
            empty = make_denoiser(config, build).state_dict()
        wanted, found = ({n: t.shape for n, t in own.items()} for own in (empty, tensors))
        if found != wanted:
            raise ValueError("its tensors have other names or shapes")
        if not all(own.isfinite().all() for own in tensors.values()):
            raise ValueError("it has values that are not finite")
        denoiser = make_denoiser(config, build)
        denoiser.load_state_dict(tensors)
    except Exception as error:  # each library has different errors for damaged files
        raise _unfit(path, error) from error
    return denoiser.eval().to("cuda" if torch.cuda.is_available() else "cpu")


def begin_from(denoiser: Denoiser, trained: Denoiser) -> int:
    """Copy the tensors of a trained denoiser with equal names and shapes; returns their number."""
    own = denoiser.state_dict()
    taken = {name: each for name, each in trained.state_dict().items() if name in own}
    same = {name: each for name, each in taken.items() if own[name].shape == each.shape}
    denoiser.load_state_dict(same, strict=False)
    return len(same)


def config_of(checkpoint: Path) -> Recipe:
    """Recipe of the denoiser of a checkpoint; raises InputError."""
    try:
        return _read_checkpoint(checkpoint)[0]
    except Exception as error:
        raise _unfit(checkpoint, error) from error


def epochs_of(checkpoint: Path) -> int:
    """Number of epochs that a training had at the time of its checkpoint."""
    loops = torch.load(checkpoint, map_location="cpu", weights_only=True, mmap=True)["loops"]
    return int(loops["fit_loop"]["epoch_progress"]["current"]["processed"])


def _unfit(path: Path, error: Exception) -> InputError:
    reason = brief(error)
    if isinstance(error, UnpicklingError):
        reason = "it is damaged, or holds objects that could run code, which are never loaded"
    return InputError(f"{path} does not contain the network of its config: {reason}")


def _read_checkpoint(path: Path) -> tuple[Recipe, dict[str, Tensor]]:
    # no code of the file is executed
    checkpoint = torch.load(path, map_location="cpu", weights_only=True)
    own = {n: t for n, t in checkpoint["state_dict"].items() if n.startswith("denoiser.")}
    tensors = {name.removeprefix("denoiser."): tensor for name, tensor in own.items()}
    return checkpoint["hyper_parameters"]["config"], tensors
