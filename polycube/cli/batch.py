"""Batches of parts: `infer.py mesh=folder`, `mesh='parts/*.stl'`, `-m mesh=a.stl,b.stl`.

Hydra makes a job of every part (and of every value of other lists). The jobs are run in sequence
or by another launcher of Hydra. A job writes `row.json` to its folder; a job with a row of the same
settings and file is not run again. At the end, the rows become a table, `summary.csv` and
`summary.html`, with successes and failures.
"""

import csv
import hashlib
import json
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Mapping
from glob import glob
from os.path import exists, isdir  # unlike those of Path, they accept names that are too long
from pathlib import Path
from typing import Any

from hydra.core.override_parser.types import QuotedString
from omegaconf import DictConfig, OmegaConf

from polycube import __version__
from polycube.cli.command import Sweep, parsed
from polycube.cli.signals import INTERRUPTED
from polycube.config import quote
from polycube.errors import InputError, printable
from polycube.io import manifest
from polycube.io.access.reading import read_json
from polycube.io.surfaces import KNOWN
from polycube.report.page.html import summary_page

ROW, FAILURE = "row.json", "failure.txt"
TABLE = ("summary.csv", "summary.html")
VERDICT = {0: "valid", 2: "refused", 3: "no valid result"}
LAST = ["says", "folder", "identity", "exit"]  # last columns of a row, and those that are omitted
MANY = {"-m", "--multirun"}
PRESENTATION = ("output_dir", "quiet", "verbose")  # settings that do not change a result

Attempt = Callable[..., tuple[int, str]]  # settings -> exit code, and the reason if it is not 0


def expanded(arguments: list[str]) -> list[str]:
    """The command line with a folder or pattern of `mesh=` replaced by its files, and `-m`.

    Folders of jobs are named by the part and by the settings with several values. Raises InputError
    if there is no such file, or if two parts have the same name.
    """
    result, several, single = [], bool(MANY & set(arguments)), []
    for argument in arguments:
        key, is_setting, value = argument.partition("=")
        paths = _files(value) if key == "mesh" and value else []
        if paths:
            several = True
            check_names(paths)
            argument = "mesh=" + ",".join(map(quote, paths))
        elif is_setting and key != "mesh" and not _sweep(argument):
            single.append(key.lstrip("+~"))
        result.append(argument)
    if not several:
        return result
    if "output_dir" not in single:
        result.append(f"output_dir=outputs/{time.strftime('%Y%m%d-%H%M%S')}")
    names = ",".join(["mesh", "hex", *PRESENTATION, *single])
    named = f"hydra.job.config.override_dirname.exclude_keys=[{names}]"
    return ["-m", *(argument for argument in result if argument not in MANY), named]


def _sweep(argument: str) -> list[str]:
    """The values of a setting with several values."""
    override = parsed(argument)
    if override is None or not override.is_sweep_override():
        return []  # Hydra will report an error
    values = override.sweep_iterator()
    return [value.text if isinstance(value, QuotedString) else str(value) for value in values]


def _files(value: str) -> list[str]:
    """Surfaces of a folder, a pattern or a list; empty for one file or example."""
    if isdir(value):
        found = sorted(str(p) for p in Path(value).iterdir() if p.suffix.lower() in KNOWN)
        if not found:
            raise InputError(f"{value}: the folder contains no surface ({', '.join(KNOWN)})")
        return found
    if exists(value):
        return []
    if any(sign in value for sign in "*?["):
        found = sorted(glob(value, recursive=True))
        if not found:
            raise InputError(f"{value}: there is no such file")
        return found
    return _sweep(f"mesh={value}")


def check_names(paths: list[str]) -> None:
    """Raise InputError if two parts have the same name, which is the name of their folder."""
    for name, count in Counter(map(part_name, paths)).items():
        if count > 1:
            same = [path for path in paths if part_name(path) == name]
            what = f"{count} parts have the name {name}: {', '.join(same)}"
            remedy = "their results would be in the same folder, rename them or run them apart"
            raise InputError(what, remedy=remedy)


def part_name(path: str) -> str:
    """Name of a file or example, for folders and tables; never `..`, and no interpolation."""
    name = Path(path.removeprefix("example:")).stem.replace("${", "_{")
    return name if name.strip(".") else f"part{name.replace('.', '_')}"


def _job_folder(values: str, *, _root_: DictConfig) -> str:
    """Folder of one job: the part, and the settings of the batch."""
    select = OmegaConf.select
    name = part_name(select(_root_, "mesh") or select(_root_, "hex") or "part")
    return f"{name},{values.replace('/', '_')}" if values else name


OmegaConf.register_new_resolver("job_folder", _job_folder)


def run_job(cfg: Mapping[str, Any], folder: Path, overrides: str, job: Attempt) -> int:
    """Exit code of one job of a batch, from a new or an earlier run; prints one line.

    Raises InputError if the row would overwrite a file of the user.
    """
    name = part_name(str(cfg["hex"] or cfg["mesh"]))
    identity = _identity(cfg)
    row = _row(folder)
    is_done = row.get("identity") == identity
    if not is_done:
        manifest.check(folder, [ROW, FAILURE])
        manifest.remove(folder, [ROW, FAILURE])
        try:
            code, sentence = job({**cfg, "output_dir": str(folder)})
        except Exception as error:
            code, sentence = 1, f"{type(error).__name__}: {error}"
            with manifest.writing(folder) as scratch:
                (scratch / FAILURE).write_text(traceback.format_exc())
        if code == INTERRUPTED:  # no row, so that it is run again the next time
            sys.stderr.write(f"{printable(f'{folder.name}: {sentence}')}\n")
            return code
        row = {"identity": identity, "exit": code, "part": name, "settings": overrides}
        row |= {"result": VERDICT.get(code, "failed"), **main_numbers(folder), "says": sentence}
        with manifest.writing(folder) as scratch:
            (scratch / ROW).write_text(json.dumps(row, indent=1))
    details = [row["says"]] if row["says"] else []
    if "hexes" in row:
        details.insert(0, f"{row['hexes']} hexes, scaled Jacobian {row['min_scaled_jacobian']:.3f}")
    result = row["result"] + ", as before" * is_done
    sys.stderr.write(f"{printable(f'{folder.name}: ' + '; '.join([result, *details]))}\n")
    return row["exit"]


def _identity(cfg: Mapping[str, object]) -> str:
    """Hash of everything that determines a result: settings, contents of the files, version."""
    chosen = {name: value for name, value in cfg.items() if name not in PRESENTATION}
    settings = json.loads(json.dumps(chosen))  # all keys are text, as sorting needs it
    digest = hashlib.sha256(json.dumps([__version__, settings], sort_keys=True).encode())
    for key in ("mesh", "hex"):
        path = Path(str(cfg[key]))
        digest.update(path.read_bytes() if path.is_file() else b"")
    return digest.hexdigest()


def main_numbers(folder: Path) -> dict[str, object]:
    """Columns of the table from the report of a run; lengths in per cent of the diagonal."""
    path = folder / "report.json"
    if not path.is_file():
        return {}
    report = read_json(path)
    hexes, spline = report.get("hex", {}), report.get("spline", {})
    names = ("hexes", "min_scaled_jacobian", "mean_scaled_jacobian")
    row = {name: hexes.get(name) for name in names}
    for name in ("mesh_to_surface_p99", "surface_to_mesh_p99"):
        row[f"{name}_percent"] = 100 * hexes[name] if name in hexes else None
    row |= {"functions": spline.get("functions"), "min_scaled_detj": spline.get("min_scaled_detj")}
    row["seconds"] = round(sum(report["seconds"].values()), 1)
    row["mesh_warnings"] = len(report.get("mesh_warnings", ()))
    return {name: value for name, value in row.items() if value is not None}


class Summary(Sweep):
    """A batch in Hydra; it ends with the table and the largest exit code."""

    files = TABLE

    def on_multirun_end(self, config: DictConfig, **_: object) -> None:
        """Write `summary.csv` and `summary.html` to the folder of the batch."""
        folder = Path(config.hydra.sweep.dir)
        rows = summarized(folder)
        results = Counter(row["result"] for row in rows)
        counts = ", ".join(f"{count} {result}" for result, count in results.items())
        sys.stderr.write(f"{printable(f'{counts}: {folder / TABLE[1]}')}\n")
        sys.exit(max(row["exit"] for row in rows))


def summarized(folder: Path) -> list[dict[str, Any]]:
    """All rows below a folder, written as tables `summary.csv` and `summary.html`."""
    found = ((path.parent, _row(path.parent)) for path in sorted(folder.glob(f"*/{ROW}")))
    rows = [{**row, "folder": job.name} for job, row in found if row]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    columns = [name for name in columns if name not in LAST] + LAST[:2]
    with manifest.writing(folder) as scratch:
        with (scratch / TABLE[0]).open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, columns, extrasaction="ignore")
            writer.writeheader()
            writer.writerows({name: _cell(row[name]) for name in row} for row in rows)
        page = summary_page(rows, columns, folder)
        (scratch / TABLE[1]).write_text(page, encoding="utf-8", errors="backslashreplace")
    return rows


def _row(folder: Path) -> dict[str, Any]:
    """The row of an earlier run of a job; empty if there is none, or if it was changed."""
    return dict(read_json(folder / ROW)) if manifest.is_result(folder, ROW) else {}


def _cell(value: object) -> object:
    """A value for a table: spreadsheets take text that begins with = + - @ for a formula."""
    if not isinstance(value, str):
        return value
    return printable(f"'{value}" if value.startswith(("=", "+", "-", "@", "\t", "\r")) else value)
