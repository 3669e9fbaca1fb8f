"""Trained denoisers as files anyone can read: safetensors, and a YAML that says what they are.

`weights.safetensors` holds the tensors, `weights.yaml` beside it the grid, primitives, schedule,
model and options to build the network again, `weights.json` the measured errors.  No pickle.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path

import yaml
from safetensors.torch import load_file, save_file

from polycube import HOME
from polycube.diffusion.denoiser import Denoiser, DenoiserOptions
from polycube.errors import InputError

SHIPPED = HOME / "plugins" / "weights" / "weights.safetensors"

# (kind, config) -> plugin: `polycube.registry.build`, handed in because it lies above this layer
Build = Callable[[str, Mapping[str, object]], Callable]


def make_denoiser(config: Mapping[str, object], build: Build) -> Denoiser:
    """Untrained denoiser from grid, primitives, schedule, model and options."""
    return Denoiser(
        build("model", config["model"]),
        build("schedule", config["schedule"])(),
        config["grid"],
        config["primitives"],
        DenoiserOptions(**config["options"]),
    )


def save_denoiser(
    denoiser: Denoiser,
    config: Mapping[str, object],
    metrics: Mapping[str, float],
    folder: Path,
) -> Path:
    """Write the three files, single precision halved; returns the safetensors file."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "weights.safetensors"
    tensors = {
        name: (tensor.half() if tensor.is_floating_point() else tensor).contiguous().cpu()
        for name, tensor in denoiser.state_dict().items()
    }
    save_file(tensors, path)
    path.with_suffix(".yaml").write_text(yaml.safe_dump(dict(config), sort_keys=False))
    path.with_suffix(".json").write_text(json.dumps(dict(metrics), indent=1) + "\n")
    return path


def load_denoiser(build: Build, path: str | Path | None = None) -> Denoiser:
    """Trained denoiser from a safetensors file or its folder; without one, the shipped weights."""
    path = Path(path or SHIPPED)
    path = path / "weights.safetensors" if path.is_dir() else path
    for needed in (path, path.with_suffix(".yaml")):
        if not needed.is_file():
            raise InputError(f"no weights at {needed}; train.py writes them")
    try:
        denoiser = make_denoiser(yaml.safe_load(path.with_suffix(".yaml").read_text()), build)
        denoiser.load_state_dict(load_file(path))
    except Exception as error:  # each library has its own exception for each way to be wrong
        reason = str(error).splitlines()[0]
        raise InputError(f"{path} does not hold the network of its YAML: {reason}") from error
    return denoiser.eval()
