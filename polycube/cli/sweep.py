"""Several trainings, `train.py -m schedule=linear,cosine`, with a table and a figure at the end."""

import csv
import json
import sys
from pathlib import Path

import yaml
from hydra.experimental.callback import Callback
from omegaconf import DictConfig

from polycube.cli.command import begin_sweep
from polycube.diffusion.training.pictures import curves, draw
from polycube.io.manifest import writing

TABLE = ("summary.csv", "loss.png")
SHOWN = ("error", "error_p95", "error_one_step", "loss", "samples_per_second")


class Trainings(Callback):
    """End of a sweep in Hydra: `summary.csv`, `loss.png`, and the table on the terminal."""

    def on_multirun_start(self, config: DictConfig, **_: object) -> None:
        """Refuse a folder in which a file of the user would be overwritten."""
        begin_sweep(config, TABLE)

    def on_multirun_end(self, config: DictConfig, **_: object) -> None:
        """Summarise all trainings in the folder of the sweep."""
        folder = Path(config.hydra.sweep.dir)
        rows = summarized(folder)
        sys.stderr.write(_table(rows) + f"{folder / 'summary.csv'}, {folder / 'loss.png'}\n")


def summarized(folder: Path) -> list[dict[str, object]]:
    """A row for each training below a folder, sorted by error, failed ones last."""
    rows, curves_of = [], {}
    for run, chosen in _settings(folder).items():
        path = run / "weights" / "weights.json"
        metrics = json.loads(path.read_text()) if path.is_file() else {}
        rows.append({"settings": chosen, **metrics, "folder": run.name})
        if metrics:
            curves_of[chosen] = curves(run)
    rows.sort(key=lambda row: row.get("error", float("inf")))
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with writing(folder) as scratch:
        with (scratch / TABLE[0]).open("w", newline="") as file:
            writer = csv.DictWriter(file, columns)
            writer.writeheader()
            writer.writerows(rows)
        if curves_of:
            draw(curves_of, scratch / TABLE[1])
    return rows


def _settings(folder: Path) -> dict[Path, str]:
    """Settings of each training folder that differ between trainings."""
    files = {path.parent.parent: path for path in sorted(folder.glob("*/.hydra/overrides.yaml"))}
    chosen = {run: yaml.safe_load(path.read_text()) for run, path in files.items()}
    common = set.intersection(*map(set, chosen.values())) if chosen else set()
    return {run: ", ".join(s for s in own if s not in common) for run, own in chosen.items()}


def _table(rows: list[dict[str, object]]) -> str:
    """The most important columns, aligned."""
    lines = [["settings", *SHOWN, "folder"]]
    for row in rows:
        values = [f"{row[name]:.3f}" if name in row else "failed" for name in SHOWN]
        lines.append([str(row["settings"]), *values, str(row["folder"])])
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    aligned = ("  ".join(map(str.ljust, line, widths)).rstrip() for line in lines)
    return "".join(f"{line}\n" for line in aligned)
