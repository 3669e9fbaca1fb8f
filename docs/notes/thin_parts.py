"""Thin parts: the default splines, and their hexes in CalculiX, against second-order tetrahedra.

    python docs/notes/thin_parts.py OUTPUT [PART ...]

Without parts, three are drawn in OUTPUT: a bent sheet, half a pipe and the cover of a box.  Of
each part, the largest displacement and the first ten elastic frequencies of the free part are
compared.  The load is 100 N on a CAD face while another one is clamped: see LOADS; the faces of a
part that is not there are chosen as in `docs.notes.statics`.

`auto` is a run with default settings from the STEP file, and then the modes on the same hexes.
C3D8I and C3D20R are these hexes in CalculiX; the nodes of C3D20R lie on the spline of statics.  The
tetrahedra C3D10 of Gmsh have up to four sizes; the finest are the reference.  Seconds are those
of the CPU for statics and modes; `auto` is timed from the STEP file on, a deck without the mesh.

OUTPUT/PART.json holds a row per model, so that a study goes on where it ended; OUTPUT/table.md
shows all of them.  CalculiX must be installed as ccx.
"""

from __future__ import annotations

import itertools
import json
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import gmsh
import numpy as np

from docs.notes.frequencies import MODES, RIGID, STEP, infer
from docs.notes.frequencies import calculix as modes_by_calculix
from docs.notes.statics import Case, Row, priced, tetrahedra
from docs.notes.statics import calculix as statics_by_calculix
from polycube.hexmesh.hex_counts import through
from polycube.io.hex_meshes import read_hexes

TETRAHEDRA = {0.06: 15, 0.04: 22, 0.03: 30, 0.02: 45}  # size in diagonals, elements on circles
FINEST = {"sheet_bracket": 0.04, "u_bracket_holes": 0.04}  # of larger parts
LOADS = {  # the clamped and the loaded CAD face, and the axis of the force
    "sheet_bracket": (2, 17, 2),
    "ski_bent_sheet": (3, 7, 1),
    "u_bracket_holes": (5, 2, 1),
    "bent_sheet": (2, 9, 0),
    "half_pipe": (2, 4, 0),
    "box_cover": (2, 9, 2),
}
MODAL = ["analysis=modal", f"analysis.modes={RIGID + MODES}", "analysis.units=mm"]
EVERYWHERE = np.inf  # the stress of CalculiX is not compared


def main() -> None:
    """Run what is not there yet, model after model, each for all parts; write the table."""
    output = Path(sys.argv[1])
    output.mkdir(parents=True, exist_ok=True)
    parts = [Path(each) for each in sys.argv[2:]] or drawn(output)
    runs = {
        part.stem: models(Case(part, LOADS.get(part.stem)), output / part.stem) for part in parts
    }
    kept = {part: output / f"{part}.json" for part in runs}
    found = {p: json.loads(at.read_text()) if at.exists() else {} for p, at in kept.items()}
    for model in dict.fromkeys(itertools.chain(*runs.values())):
        for part, solvers in runs.items():
            if model in solvers and model not in found[part]:
                (output / part).mkdir(exist_ok=True)
                found[part][model] = priced(solvers[model])
                kept[part].write_text(json.dumps(found[part], indent=1))
            (output / "table.md").write_text("\n".join(table(found)) + "\n")


def drawn(output: Path) -> list[Path]:
    """STEP files of a bent sheet, half a pipe and the cover of a box."""
    occ = gmsh.model.occ

    def bent_sheet() -> None:
        corners = [
            (61.9, 0),
            (6.1, 0),
            (0, 6.1),
            (0, 47.3),
            (2, 47.3),
            (2, 6.1),
            (6.1, 2),
            (61.9, 2),
        ]
        points = [occ.addPoint(x, 0, z) for x, z in corners]
        centre = occ.addPoint(6.1, 0, 6.1)
        curves = [
            occ.addCircleArc(a, centre, b) if i in (1, 5) else occ.addLine(a, b)
            for i, (a, b) in enumerate(zip(points, [*points[1:], points[0]], strict=True))
        ]
        sheet = occ.extrude([(2, occ.addPlaneSurface([occ.addCurveLoop(curves)]))], 0, 31.7, 0)[1]
        occ.remove([(0, centre)])
        occ.cut([sheet], [(3, occ.addCylinder(43.7, 14.3, -1, 0, 0, 4, 4.7))])

    def half_pipe() -> None:
        outer = occ.addCylinder(0, 0, 0, 0, 57.3, 0, 21.9, angle=np.pi)
        occ.cut([(3, outer)], [(3, occ.addCylinder(0, -1, 0, 0, 60, 0, 19.6))])

    def box_cover() -> None:
        outer = occ.addRectangle(0, 0, 0, 53.7, 36.1, roundedRadius=7.3)
        inner = occ.addRectangle(2, 2, -1, 49.7, 32.1, roundedRadius=5.3)
        solids = [
            occ.extrude([(2, outer)], 0, 0, 17.3)[1],
            occ.extrude([(2, inner)], 0, 0, 16.3)[1],
        ]
        occ.cut(solids[:1], solids[1:])

    found = []
    for draw in (bent_sheet, half_pipe, box_cover):
        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)
        draw()
        occ.synchronize()
        found.append(output / f"{draw.__name__}.step")
        gmsh.write(str(found[-1]))
        gmsh.finalize()
    return found


def models(case: Case, folder: Path) -> dict[str, Callable[[], Row]]:
    """What is solved for a part, by name; the decks are written with the splines."""
    first, modal, eight = (folder / name for name in ("auto", "modal", "eight"))

    def deck(element: str) -> list[str]:
        return ["export=[abaqus]", f"export.abaqus.element={element}"]

    def automatic() -> Row:
        infer(f"mesh={case.part}", f"output_dir={first}", *case.settings, *deck("C3D20R"))
        before = [
            f"resume={first}",
            "from=spline",
            f"output_dir={modal}",
            "order=[meshing,spline,analysis]",
        ]
        infer(*before, *MODAL, *deck("C3D8I"))
        return solved(first, modal)

    def of_eight() -> Row:
        infer(
            f"resume={first}",
            "from=meshing/refine",
            "order=[meshing]",
            f"output_dir={eight}",
            *case.settings,
            *deck("C3D8I"),
        )
        return by_calculix(eight / "hex.inp")

    def free(size: float, round_ones: int) -> Row:
        at = folder / f"tetrahedra-{size:g}.inp"
        tetrahedra(case, at, size, round_ones)
        return by_calculix(at)

    found = {"auto": automatic, "C3D8I": of_eight, "C3D20R": lambda: by_calculix(first / "hex.inp")}
    for size, round_ones in TETRAHEDRA.items():
        if size >= FINEST.get(case.part.stem, 0.0):
            found[f"C3D10, {100 * size:g} %"] = partial(free, size, round_ones)
    return found


def solved(first: Path, modal: Path) -> Row:
    """The numbers of the two runs of this program."""
    static, modes = (json.loads((run / "report.json").read_text()) for run in (first, modal))
    walls = through(read_hexes(first / "hex.vtu")[0])[0]
    return {
        "hexes": static["hex"]["hexes"],
        "walls": [int(walls.min()), float(np.median(walls))],
        "functions": [static["spline"]["functions"], modes["spline"]["functions"]],
        "spaces": [
            "h2s" if run["spline"]["functions"] == static["hex"]["vertices"] else "optimal"
            for run in (static, modes)
        ],
        "unknowns": 3 * modes["spline"]["functions"],
        "displacement": static["static"]["max_displacement"],
        "estimate": static["static"]["displacement_error"],
        "frequencies": modes["modes"]["frequency_hz"][RIGID:],
        "estimates": modes["modes"]["frequency_error"],
    }


def by_calculix(deck: Path) -> Row:
    """Displacement that CalculiX finds for a deck of statics, and frequencies of the free part."""
    free = deck.with_name(f"{deck.stem}-free.inp")
    free.write_text(deck.read_text().partition("*MATERIAL")[0] + STEP)
    frequencies = modes_by_calculix(free)["frequencies"]
    statics = statics_by_calculix(deck, [0.0, 0.0, 0.0], EVERYWHERE)
    return {**statics, "frequencies": frequencies}


def table(found: dict[str, dict[str, Row]]) -> list[str]:
    """Lines of a table in Markdown; estimates are in brackets."""
    lines = [
        "| part | model | unknowns | displacement, % | frequencies, % | CPU s |",
        "|---" * 6 + "|",
    ]
    for part, rows in found.items():
        for name, row in rows.items():
            reference = list(rows.values())[-1]
            moved = f"{100 * (row['displacement'] / reference['displacement'] - 1):+.2f}"
            ours, theirs = (np.array(each["frequencies"][:MODES]) for each in (row, reference))
            off = 100 * (ours / theirs - 1)
            modes = f"{off[np.abs(off).argmax()]:+.2f}"
            if "estimates" in row:
                moved += f" ({100 * row['estimate'] / row['displacement']:.2g})"
                modes += f" ({100 * max(row['estimates'][:MODES]):.2g})"
                name += (
                    f": {row['hexes']:,} hexes, {row['walls']}, {row['functions']}, {row['spaces']}"
                )
            lines.append(
                f"| {part} | {name} | {row['unknowns']:,} | {moved} | {modes} "
                f"| {row['seconds']:.1f} |"
            )
    return lines


if __name__ == "__main__":
    main()
