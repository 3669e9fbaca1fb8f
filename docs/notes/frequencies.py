"""The first frequencies of free parts by splines, and by hexahedra and tetrahedra in CalculiX.

    python docs/notes/frequencies.py OUTPUT PART [PART ...]

A part is meshed once, automatically.  On these hexes come the splines h2s and optimal, and CalculiX
with C3D8I and with C3D20, whose nodes lie on the spline.  Gmsh makes tetrahedra C3D10 of the CAD
file, or of the patches of a triangulated surface, at several sizes.  The reference of a part is
the optimal spline on smaller hexes; its finest tetrahedra stand beside it as a check.

OUTPUT/PART.json holds a row per model, so that a study goes on where it ended; OUTPUT/table.md and
OUTPUT/plot.png show all of them.  CalculiX must be installed as ccx.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import gmsh
import matplotlib.pyplot as plt
import meshio
import numpy as np

HERE = Path(__file__).parents[2]
MODES = 10  # elastic ones compared
RIGID = 6
TETRAHEDRA = (0.06, 0.04, 0.025)  # sizes in diagonals
ANGLE = np.deg2rad(30)  # between the patches of a triangulated surface
TETRAHEDRON = 11  # of ten nodes, in Gmsh
LARGEST = 300_000  # unknowns of a reference, about
REFERENCE = "optimal, smaller hexes"
STEP = f"""*MATERIAL, NAME=steel
*ELASTIC
210000., 0.3
*DENSITY
7.85e-09
*SOLID SECTION, ELSET=all, MATERIAL=steel
*STEP
*FREQUENCY
{RIGID + MODES}
*END STEP
"""  # in N, mm, s: as the decks of infer.py

Row = dict[str, Any]


def main() -> None:
    """Run what is not there yet, then write table and plot."""
    output = Path(sys.argv[1])
    output.mkdir(parents=True, exist_ok=True)
    found = {}
    for part in map(Path, sys.argv[2:]):
        kept = output / f"{part.stem}.json"
        rows: dict[str, Row] = json.loads(kept.read_text()) if kept.exists() else {}
        solvers = models(part, output / part.stem, rows)
        for name, solve in solvers.items():
            if name not in rows:
                rows[name] = solve()
                kept.write_text(json.dumps(rows, indent=1))
        found[part.stem] = {name: rows[name] for name in solvers}
    (output / "table.md").write_text("\n".join(table(found)) + "\n")
    plot(found).savefig(output / "plot.png", dpi=110)


def models(part: Path, folder: Path, rows: dict[str, Row]) -> dict[str, Callable[[], Row]]:
    """What is solved for a part, by name; a deck is written beside the spline before it."""
    hexes, fine = folder / "hexes", folder / "fine"

    def on_fine(space: str) -> Row:
        mesh(part, fine, f"meshing.size={smaller(hexes, rows['optimal']['unknowns']):g}")
        return spline(fine, space)

    mesh(part, hexes)
    found = {
        "h2s": lambda: spline(hexes, "h2s", "C3D20"),
        "optimal": lambda: spline(hexes, "optimal", "C3D8I"),
        "C3D8I": lambda: calculix(folder / "hexes-optimal" / "hex.inp"),
        "C3D20": lambda: calculix(folder / "hexes-h2s" / "hex.inp"),
    }
    for size in TETRAHEDRA:
        deck = folder / f"tetrahedra-{size:g}.inp"
        found[f"C3D10, {100 * size:g} %"] = partial(tetrahedra, part, deck, size)
    found["h2s, smaller hexes"] = partial(on_fine, "h2s")
    found[REFERENCE] = partial(on_fine, "optimal")
    return found


def mesh(part: Path, folder: Path, *settings: str) -> None:
    """Mesh a part, unless that is done."""
    if not (folder / "report.json").exists():
        infer(f"mesh={part}", f"output_dir={folder}", "order=[meshing]", *settings)


def infer(*settings: str) -> None:
    """Run infer.py; raises CalledProcessError where it ends with an error."""
    command = [sys.executable, str(HERE / "infer.py"), *settings, "quiet=true"]
    subprocess.run(command, check=True, cwd=HERE)


def smaller(run: Path, unknowns: int) -> float:
    """Size of the hexes of a reference, in units of the part: half that of a run, or more.

    unknowns : of the optimal spline on the hexes of the run
    """
    mesh = meshio.read(run / "hex.vtu")
    corners = mesh.points[mesh.cells_dict["hexahedron"]]
    length = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1).mean()
    return float(length * max(0.5, np.cbrt(unknowns / LARGEST)))


def spline(run: Path, space: str, element: str = "C3D8I") -> Row:
    """Frequencies by a spline on the hexes of a run; a deck of an element is written with it."""
    folder = run.with_name(f"{run.name}-{space}")
    infer(
        f"resume={run}",
        "from=spline",
        f"output_dir={folder}",
        "order=[meshing,spline,analysis]",
        f"spline={space}",
        f"analysis.modes={RIGID + MODES}",
        "export=[abaqus]",
        f"export.abaqus.element={element}",
    )
    report = json.loads((folder / "report.json").read_text())
    return {
        "unknowns": 3 * report["spline"]["functions"],
        "frequencies": report["modes"]["frequency_hz"][RIGID:],
        "seconds": report["seconds"]["spline"] + report["seconds"]["analysis"],
    }


def calculix(deck: Path, rigid: int = RIGID) -> Row:
    """Frequencies that CalculiX finds for a deck, without the first ones of rigid motions."""
    began = time.monotonic()
    environment = {"OMP_NUM_THREADS": str(os.cpu_count()), **os.environ}
    command = ["ccx", "-i", deck.stem]
    subprocess.run(command, check=True, cwd=deck.parent, env=environment, capture_output=True)
    text = deck.with_suffix(".dat").read_text().partition("P A R T I C I P A T I O N")[0]
    rows = [row for row in map(str.split, text.splitlines()) if len(row) == 5]
    found = [float(row[3]) for row in rows if row[0].isdigit()]
    return {
        "unknowns": 3 * nodes(deck),
        "frequencies": found[rigid:],
        "seconds": time.monotonic() - began,
    }


def nodes(deck: Path) -> int:
    """Number of nodes of a deck."""
    lines = deck.read_text().split("*NODE", 1)[1].splitlines()[1:]
    return next(i for i, line in enumerate(lines) if line.startswith("*"))


def tetrahedra(part: Path, deck: Path, size: float) -> Row:
    """Frequencies by second-order tetrahedra of Gmsh, a size in diagonals; seconds of all."""
    began = time.monotonic()
    points, elements = gmsh_tetrahedra(part, size)
    with deck.open("w") as file:
        file.write("*NODE, NSET=all\n")
        for i, (x, y, z) in enumerate(points, 1):
            file.write(f"{i}, {x:.12e}, {y:.12e}, {z:.12e}\n")
        file.write("*ELEMENT, TYPE=C3D10, ELSET=all\n")
        for i, row in enumerate((elements + 1).tolist(), 1):
            file.write(f"{i}, {', '.join(map(str, row))}\n")
        file.write(STEP)
    return {**calculix(deck), "seconds": time.monotonic() - began}


def gmsh_tetrahedra(part: Path, size: float) -> tuple[list[list[float]], np.ndarray]:
    """Points, and corners and middles of edges in the order of Abaqus (T, 10)."""
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.merge(str(part))
        if part.suffix == ".stl":
            gmsh.model.mesh.classifySurfaces(ANGLE, True, True, np.pi)
            gmsh.model.mesh.createGeometry()
            sides = [tag for _, tag in gmsh.model.getEntities(2)]
            gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop(sides)])
            gmsh.model.geo.synchronize()
        else:
            gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 12)
        box = np.reshape(gmsh.model.getBoundingBox(-1, -1), (2, 3))
        length = size * np.linalg.norm(box[1] - box[0])
        gmsh.option.setNumber("Mesh.MeshSizeMax", length)
        gmsh.option.setNumber("Mesh.MeshSizeMin", length / 5)
        gmsh.model.mesh.generate(3)
        gmsh.option.setNumber("Mesh.SecondOrderLinear", part.suffix == ".stl")
        gmsh.model.mesh.setOrder(2)
        if part.suffix != ".stl":
            gmsh.model.mesh.optimize("HighOrder")
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        kinds, _, corners = gmsh.model.mesh.getElements(3)
    finally:
        gmsh.finalize()
    assert list(kinds) == [TETRAHEDRON]
    used, elements = np.unique(corners[0], return_inverse=True)
    order = np.argsort(tags)
    points = coordinates.reshape(-1, 3)[order[np.searchsorted(tags[order], used)]]
    return points.tolist(), elements.reshape(-1, 10)[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]


def error(row: Row, reference: Row) -> float:
    """Mean error of the frequencies in per cent of the reference's."""
    ours, theirs = (np.array(each["frequencies"][:MODES]) for each in (row, reference))
    return float(100 * np.abs(ours / theirs - 1).mean())


def table(found: dict[str, dict[str, Row]]) -> list[str]:
    """Lines of a table in Markdown."""
    lines = ["| part | model | unknowns | first, Hz | tenth, Hz | error, % | seconds |"]
    lines.append("|---|---|---|---|---|---|---|")
    for part, rows in found.items():
        for name, row in rows.items():
            first, last = row["frequencies"][0], row["frequencies"][MODES - 1]
            lines.append(
                f"| {part} | {name} | {row['unknowns']:,} | {first:,.0f} | {last:,.0f} "
                f"| {error(row, rows[REFERENCE]):.2f} | {row['seconds']:.1f} |"
            )
    return lines


def plot(found: dict[str, dict[str, Row]]) -> plt.Figure:
    """Error against unknowns, and against seconds below: a part per column, a line per model."""
    kinds = {"h2s": "o", "optimal": "s", "C3D8I": "^", "C3D20": "v", "C3D10": "x"}
    size = (2.6 * len(found), 6)
    figure, axes = plt.subplots(2, len(found), figsize=size, sharey=True, layout="constrained")
    for column, (part, rows) in enumerate(found.items()):
        for colour, (kind, marker) in enumerate(kinds.items()):
            chosen = [
                row
                for name, row in rows.items()
                if name.partition(",")[0] == kind and name != REFERENCE
            ]
            errors = [error(row, rows[REFERENCE]) for row in chosen]
            for axis, unit in zip(axes[:, column], ("unknowns", "seconds"), strict=True):
                x = [row[unit] for row in chosen]
                axis.loglog(x, errors, f"{marker}-", color=f"C{colour}", label=kind)
                axis.set_xlabel(unit)
                axis.grid(alpha=0.3)
                axis.xaxis.set_minor_formatter("")
        axes[0, column].set_title(part)
    for axis in axes[:, 0]:
        axis.set_ylabel("mean error of ten frequencies, %")
    axes[0, 0].legend()
    return figure


if __name__ == "__main__":
    main()
