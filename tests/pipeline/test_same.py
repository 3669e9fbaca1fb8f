"""The same seed on the same machine gives the same bytes, on any number of its cores."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from polycube import HOME

HEXES = ("hex.vtu", "polycube.vtu", "labels.vtp")
ALL = (*HEXES, "spline.bext", "spline.npz", "modes.csv")


def result(folder: Path, n_cores: int, order: str, structure: str) -> tuple[dict, list[bytes]]:
    """Numbers without times, and files, of a run in a process of its own."""
    cores = sorted(os.sched_getaffinity(0))[:n_cores]
    command = [sys.executable, str(HOME / "infer.py"), "mesh=example:dice", f"output_dir={folder}"]
    command += ["seed=3", f"order={order}", f"structure={structure}"]
    command += ["meshing.size=12%", "analysis.modes=8"]
    done = subprocess.run(
        command, capture_output=True, text=True, preexec_fn=lambda: os.sched_setaffinity(0, cores)
    )
    assert done.returncode == 0, done.stderr
    report = json.loads((folder / "report.json").read_text())
    del report["seconds"], report["made"]
    for row in report["search"]:
        del row["seconds"]
    files = HEXES if order == "[meshing]" else ALL
    return report, [(folder / name).read_bytes() for name in files]


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="cores can not be chosen here")
@pytest.mark.slow
@pytest.mark.parametrize(
    ("order", "structure"),
    [("[meshing]", "slices"), ("[meshing]", "auto"), ("[meshing,spline,analysis]", "slices")],
)
def test_two_runs_are_the_same_to_the_last_bit(order: str, structure: str, tmp_path: Path) -> None:
    report, files = result(tmp_path / "a", 1, order, structure)
    repeated, the_same = result(tmp_path / "b", 2, order, structure)
    assert report == repeated
    for name, one, other in zip(ALL, files, the_same, strict=False):
        assert one == other, name
