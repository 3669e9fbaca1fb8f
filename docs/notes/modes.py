"""Free frequencies from a STEP file to the answer: this program, its hexes in CalculiX, tetrahedra.

    python docs/notes/modes.py OUTPUT PART [PART ...]

The first ten elastic frequencies of the free part are compared.  `auto` is a run with default
settings; `first` is the same with effort=first, whose analysis is not repeated on the same hexes;
C3D20R are the hexes of `auto` in CalculiX, with nodes on the spline; C3D10 are the tetrahedra of
`docs.notes.statics`, of those of its five sizes that have less than LARGEST unknowns.  Seconds are
CPU seconds of all processes from the STEP file on, so those of C3D20R include the hex mesh.

The reference is extrapolated from the spline `optimal` on the hexes of `auto` and on smaller ones,
whose errors are taken to be in proportion to their estimates; half the extrapolation is its
uncertainty.  As a check, tetrahedra that are graded towards inner edges are solved for the parts
of CHECKED.

OUTPUT/PART.json holds a row per model, so that a study goes on where it ended; OUTPUT/table.md and
OUTPUT/plot.png show all of them.  CalculiX must be installed as ccx.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

import gmsh
import matplotlib.pyplot as plt
import numpy as np

from docs.notes.frequencies import MODES, REFERENCE, RIGID, STEP, calculix, infer, nodes, smaller
from docs.notes.statics import TETRAHEDRA, Case, Row, mesh, study, tetrahedra
from polycube.io.hex_meshes import read_hexes

MODAL = [
    "analysis=modal",
    f"analysis.modes={RIGID + MODES}",
    "analysis.units=mm",
    "export=[abaqus]",
    "export.abaqus.element=C3D20R",
]
LARGEST = 110_000  # unknowns of tetrahedra, whose modes take more than a minute otherwise
GRADED = (0.012, 0.05)  # sizes in diagonals at inner edges and elsewhere
CHECKED = ("4-4-11-13-19", "0-2-7-7-14-23")
TICKS = (0.1, 0.2, 0.5, 1, 2, 5)  # per cent, of the plot
KINDS = {"auto": "D", "optimal": "s", "C3D20R": "v", "C3D10": "x"}


def models(case: Case, folder: Path, rows: dict[str, Row]) -> dict[str, Callable[[], Row]]:
    """What is solved for a part, by name."""

    first = folder / "auto"

    def meshed(name: str, *settings: str) -> Row:
        run = folder / name
        spent = mesh(case.part, run, *settings)
        if name == "first" and same_hexes(first, run):
            row = rows["auto"]
            return {**row, "meshed": spent, "seconds": row["seconds"] - row["meshed"]}
        return {**solved(run, f"{name}-modal"), "meshed": spent}

    def solved(run: Path, name: str, *settings: str) -> Row:
        steps = ["order=[meshing,spline,analysis]", *settings, *MODAL]
        infer(f"resume={run}", "from=spline", f"output_dir={folder / name}", *steps)
        report = json.loads((folder / name / "report.json").read_text())
        return {
            "hexes": report["hex"]["hexes"],
            "unknowns": 3 * report["spline"]["functions"],
            "frequencies": report["modes"]["frequency_hz"][RIGID:],
            "estimates": report["modes"]["frequency_error"],
        }

    def optimal() -> Row:
        return {**solved(first, "optimal", "spline=optimal"), "seconds": rows["auto"]["meshed"]}

    def fine() -> Row:
        size = smaller(first, 2 * rows["optimal"]["unknowns"])  # the factor needs the memory
        mesh(case.part, folder / "fine", f"meshing.size={size:g}")
        return solved(folder / "fine", "fine-optimal", "spline=optimal")

    def deck() -> Row:
        return {**modes(folder / "auto-modal" / "hex.inp"), "seconds": rows["auto"]["meshed"]}

    def free(size: float, round_ones: int) -> Row:
        at = folder / f"tetrahedra-{size:g}.inp"
        tetrahedra(case, at, size, round_ones)
        at.write_text(at.read_text().partition("*MATERIAL")[0] + STEP)
        return modes(at) if 3 * nodes(at) < LARGEST else {}

    def graded() -> Row:
        at = folder / "graded.inp"
        tetrahedra(case, at, GRADED[1], TETRAHEDRA[GRADED[1]], refine_at_inner_edges)
        at.write_text(at.read_text().partition("*MATERIAL")[0] + STEP)
        return modes(at)

    found = {
        "auto": lambda: meshed("auto"),
        "first": lambda: meshed("first", "effort=first"),
        "optimal": optimal,
        REFERENCE: fine,
        "C3D20R": deck,
    }
    for size, round_ones in TETRAHEDRA.items():
        found[f"C3D10, {100 * size:g} %"] = partial(free, size, round_ones)
    if case.part.stem in CHECKED:
        found["graded C3D10"] = graded
    return found


def same_hexes(first: Path, second: Path) -> bool:
    """Whether two runs have the same hex mesh."""
    one, other = (read_hexes(run / "hex.vtu")[0] for run in (first, second))
    return np.array_equal(one.hexes, other.hexes) and np.allclose(one.vertices, other.vertices)


def inner_edges() -> list[int]:
    """Curves of the model in Gmsh at which the angle in the solid is above 180 degrees."""
    model, found = gmsh.model, []
    solid = model.getEntities(3)[0][1]
    for _, curve in model.getEntities(1):
        faces = model.getAdjacencies(1, curve)[0]
        low, high = model.getParametrizationBounds(1, curve)
        middle = model.getValue(1, curve, (low + high) / 2)
        one, other = (
            np.array(model.getNormal(face, model.getParametrization(2, face, middle)))
            for face in (faces[0], faces[-1])
        )
        if abs(one @ other) < 0.95:
            near = [middle + 1e-3 * (i * one + j * other) for i in (-1, 1) for j in (-1, 1)]
            if sum(model.isInside(3, solid, at) for at in near) > 1:
                found.append(curve)
    return found


def refine_at_inner_edges(diagonal: float) -> None:
    """Have Gmsh make elements smaller towards the inner edges."""
    small, large = (diagonal * each for each in GRADED)
    field = gmsh.model.mesh.field
    away, size = field.add("Distance"), field.add("Threshold")
    field.setNumbers(away, "CurvesList", inner_edges())
    field.setNumber(away, "Sampling", 100)
    numbers = {"InField": away, "SizeMin": small, "SizeMax": large}
    numbers |= {"DistMin": 0.7 * small, "DistMax": 1.2 * large}
    for name, value in numbers.items():
        field.setNumber(size, name, value)
    field.setAsBackgroundMesh(size)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)


def modes(deck: Path) -> Row:
    """Unknowns and frequencies that CalculiX finds for a deck of a free part."""
    row = calculix(deck)
    return {name: row[name] for name in ("unknowns", "frequencies")}


def reference(rows: dict[str, Row]) -> tuple[np.ndarray, np.ndarray]:
    """The frequencies (MODES,) of a reference, and their uncertainty (MODES,) in per cent."""
    coarse, fine = rows["optimal"], rows[REFERENCE]
    first, last = (np.array(row["frequencies"][:MODES]) for row in (coarse, fine))
    own, rest = (np.array(row["estimates"][:MODES]) for row in (coarse, fine))
    left = (first - last) * rest / (own - rest)
    return last - left, 50 * np.abs(left) / last


def errors(row: Row, exact: np.ndarray) -> np.ndarray:
    """Errors of the frequencies in per cent of those of a reference (MODES,)."""
    return 100 * (np.array(row["frequencies"][:MODES]) / exact - 1)


def table(found: dict[str, dict[str, Row]]) -> list[str]:
    """Lines of a table in Markdown."""
    heads = "part | model | unknowns | mean error, % | largest | mean estimate | within | CPU s"
    lines = [f"| {heads} |", "|---" * 8 + "|"]
    for part, rows in found.items():
        exact, unsure = reference(rows)
        for name, row in rows.items():
            if not row:
                continue
            off, estimate = errors(row, exact), ""
            within = ""
            if "estimates" in row:
                own = 100 * np.array(row["estimates"][:MODES])
                estimate = f"{own.mean():.2f}"
                within = f"{np.sum(np.abs(off) <= own + unsure)}"
            lines.append(
                f"| {part} | {name} | {row['unknowns']:,} | {np.abs(off).mean():.2f} "
                f"| {off[np.abs(off).argmax()]:+.2f} | {estimate} | {within} "
                f"| {row['seconds']:.0f} |"
            )
    return lines


def plot(found: dict[str, dict[str, Row]]) -> plt.Figure:
    """Mean error against unknowns, and against CPU seconds below; a grey band is uncertain."""
    figure, axes = plt.subplots(
        2,
        len(found),
        figsize=(2.3 * len(found), 6),
        sharey=True,
        layout="constrained",
        squeeze=False,
    )
    for column, (part, rows) in enumerate(found.items()):
        exact, unsure = reference(rows)
        for colour, (kind, marker) in enumerate(KINDS.items()):
            chosen = [row for name, row in rows.items() if name.partition(",")[0] == kind and row]
            chosen = [row for row in chosen if row is not rows[REFERENCE]]
            off = [np.abs(errors(row, exact)).mean() for row in chosen]
            for axis, unit in zip(axes[:, column], ("unknowns", "seconds"), strict=True):
                x = [row[unit] for row in chosen]
                axis.loglog(x, off, f"{marker}-", color=f"C{colour}", label=kind)
                axis.set_xlabel("CPU seconds" if unit == "seconds" else unit)
                axis.xaxis.set_minor_formatter("")
                axis.set_yticks(TICKS, map(str, TICKS))
                axis.yaxis.set_minor_formatter("")
        for axis in axes[:, column]:
            axis.axhspan(0, unsure.mean(), color="0.85")
            axis.grid(alpha=0.3)
        axes[0, column].set_title(part, fontsize=10)
    for axis in axes[:, 0]:
        axis.set_ylabel("mean error of ten frequencies, %")
    axes[0, 0].legend(fontsize=8)
    return figure


if __name__ == "__main__":
    study(models, table, plot)
