"""The estimated errors of frequencies, displacements and stresses against a finer solution.

    python docs/notes/errors.py OUTPUT PART ...

Each part is computed twice by `infer.py`: with the default settings, and on the same hexes in the
space `optimal` with every element divided into eight, whose result counts as exact. Of each run the
three lowest elastic frequencies of the free part, and under its own weight on its lowest faces the
largest displacement and the largest regular stress are compared. OUTPUT/table.md is the table, and
OUTPUT/PART.json the numbers of a part; finished parts are not computed again.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

FINER = ["from=spline", "spline=optimal", "spline.refine.levels=1"]
PROBLEMS = {
    "modal": ["analysis=modal", "analysis.modes=10"],
    "static": ["analysis=static", "analysis.fixed=[z_min]"],
}


def report(folder: Path, *overrides: str) -> dict:
    """The numbers of a run of `infer.py`, which is started unless there are some."""
    path = folder / "report.json"
    if not path.is_file():
        command = [sys.executable, "infer.py", f"output_dir={folder}", *overrides]
        subprocess.run(command, check=True)
    return json.loads(path.read_text())


def computed(folder: Path, *overrides: str) -> dict[str, tuple[float, float]]:
    """Values and estimated errors by name: one mesh and one spline for both problems."""
    first = report(folder / "modal", *overrides, *PROBLEMS["modal"])
    again = (f"resume={folder / 'modal'}", "from=analysis", *PROBLEMS["static"])
    modes, found = first["modes"], report(folder / "static", *again)["static"]
    values = {}
    for k, error in enumerate(modes["frequency_error"][:3]):
        frequency = modes["frequency_hz"][modes["rigid"] + k]
        values[f"frequency {k + 1}"] = frequency, error * frequency
    values["displacement"] = found["max_displacement"], found["displacement_error"]
    values["stress"] = found["max_von_mises"], found["max_von_mises_error"]
    return values


def main() -> None:
    """Compute all parts and write the table."""
    folder, *parts = map(Path, sys.argv[1:])
    for part in parts:
        path = folder / f"{part.stem}.json"
        if path.is_file():
            continue
        own = folder / part.stem
        coarse = computed(own / "default", f"mesh={part}")
        fine = computed(own / "finer", f"resume={own / 'default' / 'modal'}", *FINER)
        rows = {name: [*coarse[name], fine[name][0]] for name in coarse}
        path.write_text(json.dumps(rows))
    lines = ["| part | quantity | value | estimated error | error | ratio |"]
    lines.append("|---|---|---|---|---|---|")
    for path in sorted(folder.glob("*.json")):
        for name, (value, estimate, exact) in json.loads(path.read_text()).items():
            off, told = abs(value - exact) / abs(exact), estimate / abs(exact)
            errors = f"{told:.2%} | {off:.2%} | {told / off:.1f}"
            lines.append(f"| {path.stem} | {name} | {value:.5g} | {errors} |")
    (folder / "table.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
