"""`python -m polycube.evaluate`: evaluate weights; writes a table, JSON and TensorBoard files.

Exit codes: 0, or 2 for an invalid option.
"""

import json
import logging
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from lightning.pytorch.loggers import TensorBoardLogger

from polycube import __version__, registry
from polycube.cli.command import OTHER_FOLDER, command
from polycube.diffusion.denoiser import Denoiser
from polycube.diffusion.training.any_evaluation import evaluate_any, evaluate_lattices
from polycube.diffusion.training.data_module import JUDGED
from polycube.diffusion.training.evaluation import by_context, evaluate, summary, threads
from polycube.diffusion.weights import load_denoiser, shipped
from polycube.errors import InputError
from polycube.io import manifest
from polycube.pipeline.primitives import voxels
from polycube.types import Json
from polycube.types.options import Count, condition, require

logger = logging.getLogger(__name__)

RESULT = "evaluation.json"
Row = dict[str, Any]
GRIDLESS: Json = {"grid": (1, 1, 1), "primitives": {}}  # for a plugin that uses neither

# heading: column of `diffusion.evaluation`
TABLE = {
    "error": "error", "p95": "error_p95", "one step": "error_one_step",
    "off polycube": "off_polycube",
    "patch": "labelled_patch", "cell": "labelled_cell", "wall": "labelled_wall",
    "nearest: patch": "patch", "cell ": "cell", "wall ": "wall",
    "context top-1": "context_top1", "top-3": "context_top3", "any genus": "context_top1_any_genus",
    "turned top-1": "turned_top1", "top-3 ": "turned_top3",
    "s": "seconds", "1/s": "samples_per_second",
}  # fmt: skip
FORMATS = {"error": "{:.3f}", "off": "{:.3f}", "seconds": "{:.3g}", "samples": "{:.3g}"}
SHARE = "{:.1%}"  # format of the other columns
# beside every network of a grid: what needs none, given the context
BASELINES = ("untouched", "box", "normals", "centre")
# the same for arbitrary structures; additional columns if there are any
WITHOUT_GRID = {
    "axis": "labelled_axis", "knot": "labelled_knot", "nearest: axis": "nearest_axis",
    "lattice": "lattice_1", "best of 4": "lattice_4", "best of 16": "lattice_16",
    "volume": "volume_1", "best of 16 ": "volume_16", "genus": "genus", "any ": "genus_any",
}  # fmt: skip


def evaluate_weights(cfg: Json, folder: Path) -> dict[str, object]:
    """Evaluate all weights, write `folder`/evaluation.json and curves, and return the content."""
    for name in ("pairs", "batch_size"):
        require(name, condition(Count), cfg[name])
    cfg = {**cfg, "slabs": _slabs(cfg["slabs"])}
    manifest.check(folder, [RESULT], remedy=OTHER_FOLDER)
    paths = cfg["weights"] if isinstance(cfg["weights"], list) else [cfg["weights"]]
    denoisers = {str(path or shipped()): load_denoiser(registry.build, path) for path in paths}
    rows: list[Row] = []
    for path, denoiser in denoisers.items():
        rows.append({"path": path, **_measured(denoiser, cfg)})
        version = _short(path).replace("/", "_")
        curves = TensorBoardLogger(folder, name="tensorboard", version=version)
        curves.log_metrics(rows[-1]["columns"], step=0)
        curves.finalize("success")
    settings = {name: cfg[name] for name in ("pairs", "seed", "sampler", "data")}
    found = {**settings, "version": __version__, "weights": rows}
    with manifest.writing(folder) as scratch:
        (scratch / RESULT).write_text(json.dumps(found, indent=1) + "\n")
    sys.stdout.write(table(rows))
    logger.info("results: %s", folder / RESULT)
    return found


def table(rows: Sequence[Row]) -> str:
    """Markdown table: a line for every row, with empty cells if columns are missing."""
    heads = TABLE | (WITHOUT_GRID if any("nearest_axis" in row["columns"] for row in rows) else {})
    lines = [["weights", *heads], ["-"] * (1 + len(heads))]
    for row in rows:
        columns = row["columns"]
        lines.append([_short(row["path"]), *(_cell(columns, name) for name in heads.values())])
        for name in BASELINES:
            own = {"error": f"error_{name}", "patch": f"patch_{name}"}
            cells = [_cell(columns, own.get(column, "")) for column in heads.values()]
            if any(cells):
                lines.append([f"{_short(row['path'])}: {name}", *cells])
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _cell(columns: Row, name: str) -> str:
    """A column with its confidence interval, if it has one; empty if it is missing."""
    if name not in columns:
        return ""
    form = FORMATS.get(name.partition("_")[0], SHARE)
    half = columns.get(f"{name}_interval")
    return form.format(columns[name]) + ("" if half is None else f" ± {form.format(half)}")


def main() -> None:
    """Command line."""
    command("evaluate", evaluate_weights)


def _measured(denoiser: Denoiser, cfg: Json) -> Row:
    """Columns of held-out pairs for the grid of the denoiser, of all and of each kind of pair."""
    primitives, number = voxels(denoiser.condition.cells), cfg["pairs"]
    data, sampler = registry.build("data", cfg["data"]), registry.build("sampler", cfg["sampler"])
    pairs = data(denoiser.condition.grid, primitives, cfg["seed"] + JUDGED)
    how = sampler, cfg["batch_size"], cfg["seed"]
    if not denoiser.condition.grid:
        found = summary(evaluate_any(denoiser, pairs, number, *how))
        if cfg["lattices"]:
            drawn = registry.build("structure", cfg["drawn"], **GRIDLESS)
            draw = partial(drawn.polycubes, denoiser)
            found |= summary(evaluate_lattices(draw, pairs, cfg["lattices"], cfg["slabs"]))
        return {"threads": threads(), "columns": found}
    pairs.pads = denoiser.options.pads  # as many points as in the training
    made, columns = evaluate(denoiser, pairs, number, primitives, *how)
    groups = by_context(made, columns).items()
    return {
        "threads": threads(),
        "columns": summary(columns),
        "contexts": [{"context": list(context), **numbers} for context, numbers in groups],
    }


def _slabs(given: Any) -> tuple[int, int]:
    """Smallest and largest number of slabs along an axis; raises InputError for anything else."""
    numbers = given if isinstance(given, list) and len(given) == 2 else [0, 0]
    if not all(isinstance(n, int) for n in numbers) or not 1 <= numbers[0] <= numbers[1]:
        what = f"slabs must be the smallest and the largest number, such as [2, 5]; got {given!r}"
        raise InputError(what)
    return numbers[0], numbers[1]


def _short(path: str) -> str:
    """Distinguishing part of the path of weights, for tables."""
    common = ("weights", "checkpoints", "/")
    parts = [part for part in Path(path).with_suffix("").parts if part not in common]
    return "/".join(parts[-2:]) or path
