"""The largest displacement by the default spline and by CalculiX with C3D20R on the same hexes.

    python docs/notes/decks.py OUTPUT PART [PART ...]

Every part is clamped and loaded as in `docs.notes.statics`; the nodes of the deck lie on the
spline.  OUTPUT/PART.json holds what was found, OUTPUT/table.md shows it.  CalculiX must be
installed as ccx.
"""

import json
import sys
from pathlib import Path

import numpy as np

from docs.notes.frequencies import infer
from docs.notes.statics import Case, Row, calculix, hexes, priced, solved

EVERYWHERE = np.inf  # the stress of CalculiX is not compared


def main() -> None:
    """Compare the parts that are not there yet, then write the table."""
    output = Path(sys.argv[1])
    output.mkdir(parents=True, exist_ok=True)
    lines = ["| part | hexes | spline, mm | estimate | C3D20R | CPU s |", "|---" * 6 + "|"]
    for part in map(Path, sys.argv[2:]):
        kept = output / f"{part.stem}.json"
        if not kept.exists():
            kept.write_text(json.dumps(compared(Case(part), output / part.stem), indent=1))
        row = json.loads(kept.read_text())
        most, off = row["displacement"], row["estimates"]["displacement"]
        lines.append(
            f"| {part.stem} | {row['hexes']:,} | {most:.5g} | {100 * off / most:.2g} % "
            f"| {100 * (row['deck']['displacement'] / most - 1):+.2f} % "
            f"| {row['seconds']:.0f}, {row['deck']['seconds']:.0f} |"
        )
        (output / "table.md").write_text("\n".join(lines) + "\n")


def compared(case: Case, run: Path) -> Row:
    """The numbers of the default run of a part, and those of its deck."""

    def spline() -> Row:
        deck = ["export=[abaqus]", "export.abaqus.element=C3D20R"]
        infer(f"mesh={case.part}", f"output_dir={run}", *case.settings, *deck)
        return {**solved(run), "hexes": hexes(run)}

    row = priced(spline)
    row["deck"] = priced(lambda: calculix(run / "hex.inp", [0.0, 0.0, 0.0], EVERYWHERE))
    return row


if __name__ == "__main__":
    main()
