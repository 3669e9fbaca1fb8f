"""Statics on the hexes of modes.py: two efforts, and the largest stress against fine tetrahedra.

    python docs/notes/peaks.py OUTPUT PART [PART ...]

OUTPUT is that of `docs.notes.modes`, whose hexes of the default run (`auto`) and of effort=first
are analysed with the load of `docs.notes.statics`.  The work of the force, the largest
displacement and the largest stress with its estimate are compared.  The reference of the work and
of the displacement is what `docs.notes.statics` found: REFERENCES has its differences from its
coarsest tetrahedra, which are made again.  The stress is compared at the place where each run has
its largest one, with that of tetrahedra of two sizes that are refined round this place; it is read
off a linear function fitted to the stresses at the nodes nearest to the place.

OUTPUT/PART-peaks.json holds what was found, OUTPUT/peaks.md shows it.
"""

from __future__ import annotations

import json
import sys
from functools import partial
from pathlib import Path

import numpy as np

from docs.notes.frequencies import infer
from docs.notes.modes import same_hexes
from docs.notes.statics import (
    TETRAHEDRA,
    Case,
    Row,
    calculix,
    priced,
    refine_at,
    solved,
    stresses,
    tetrahedra,
)

COARSE = 0.12
REFERENCES = {  # errors of work and displacement of the coarsest tetrahedra, per cent
    "conrod": (-4.48, -4.26),
    "sheet_bracket": (-2.54, -2.56),
    "hub_wheel": (-5.40, -5.57),
    "stepped_shaft": (-4.22, -4.28),
    "triangle_plate_holes": (-2.07, -2.04),
    "0-7-9-11-19": (-2.46, -3.20),
    "4-4-11-13-19": (-4.40, -4.84),
    "0-2-7-7-14-23": (-3.82, -4.18),
    "3-7-10-12-19": (-2.00, -2.50),
}
REFINED = ((0.08, 0.01), (0.05, 0.006))  # sizes of tetrahedra, and at the place, in diagonals
NEAREST = 20  # nodes that give the stress at a place
EFFORTS = ("auto", "first")


def found(case: Case, folder: Path) -> dict[str, Row]:
    """Statics by two efforts, and by the coarsest tetrahedra."""
    meshed = json.loads(folder.with_suffix(".json").read_text())
    rows: dict[str, Row] = {}
    for name in EFFORTS:
        if rows and same_hexes(folder / "auto", folder / name):
            spent = rows["auto"]["seconds"] - meshed["auto"]["meshed"]
            rows[name] = {**rows["auto"], "seconds": spent + meshed[name]["meshed"]}
            continue
        row = priced(partial(static, case, folder / name, folder / f"{name}-static"))
        row["fine"] = [at_place(case, folder, row["at"], *sizes) for sizes in REFINED]
        rows[name] = {**row, "seconds": row["seconds"] + meshed[name]["meshed"]}
    deck = folder / "static-tetrahedra.inp"
    tetrahedra(case, deck, COARSE, TETRAHEDRA[COARSE])
    rows["coarse"] = calculix(deck, rows["auto"]["at"], case.radius)
    return rows


def static(case: Case, meshed: Path, run: Path) -> Row:
    """The numbers of statics on the hexes of a run."""
    steps = "order=[meshing,spline,analysis]"
    infer(f"resume={meshed}", "from=spline", f"output_dir={run}", steps, *case.settings)
    return solved(run)


def at_place(
    case: Case, folder: Path, place: list[float], size: float, smaller: float
) -> list[float]:
    """Von Mises stress at a place by refined tetrahedra, the number of unknowns and the seconds."""
    deck = folder / "refined.inp"

    def solve() -> Row:
        tetrahedra(case, deck, size, TETRAHEDRA[size], partial(refine_at, place, smaller))
        return calculix(deck, place, case.radius)

    row = priced(solve)
    points, stress = stresses(deck.with_suffix(".frd"))
    away = points - place
    near = np.argsort((away**2).sum(axis=1))[:NEAREST]
    linear = np.column_stack([np.ones(NEAREST), away[near]])
    value = np.linalg.lstsq(linear, stress[near], rcond=None)[0][0]
    return [1e6 * float(value), row["unknowns"], row["seconds"]]


def table(everything: dict[str, dict[str, Row]]) -> list[str]:
    """Lines of a table in Markdown."""
    heads = "part | run | unknowns | work, % | displacement, % (estimate)"
    lines = [f"| {heads} | stress at its place, % (estimate) | coarser tetrahedra, % | CPU s |"]
    lines.append("|---" * 8 + "|")
    for part, rows in everything.items():
        work, moved = (
            rows["coarse"][name] / (1 + off / 100)
            for name, off in zip(("work", "displacement"), REFERENCES[part], strict=True)
        )
        for name in EFFORTS:
            row = rows[name]
            coarse, fine = (each[0] for each in row["fine"])
            own = {what: 100 * off / row[what] for what, off in row["estimates"].items()}
            lines.append(
                f"| {part} | {name} | {row['unknowns']:,} | {100 * (row['work'] / work - 1):+.2f} "
                f"| {100 * (row['displacement'] / moved - 1):+.2f} ({own['displacement']:.2g}) "
                f"| {100 * (row['stress'] / fine - 1):+.1f} ({own['stress']:.2g}) "
                f"| {100 * (coarse / fine - 1):+.1f} | {row['seconds']:.0f} |"
            )
    return lines


def main() -> None:
    """Run what is not there yet, then write the table."""
    output, everything = Path(sys.argv[1]), {}
    for part in map(Path, sys.argv[2:]):
        kept = output / f"{part.stem}-peaks.json"
        if not kept.exists():
            kept.write_text(json.dumps(found(Case(part), output / part.stem), indent=1))
        everything[part.stem] = json.loads(kept.read_text())
        (output / "peaks.md").write_text("\n".join(table(everything)) + "\n")


if __name__ == "__main__":
    main()
