"""Statics from a STEP file to the answer: this program, its hexes in CalculiX, and tetrahedra.

    python docs/notes/statics.py OUTPUT PART [PART ...]

Of each part, the two CAD faces (at least 1 % of the area) whose centroids are farthest apart are
chosen; one is clamped, and on the other acts a force of 100 N along the axis that is closest to
perpendicular to the line between them.  Seconds are CPU seconds of all processes from the STEP file
on, so a space or a deck on the automatic hexes includes their meshing.  The compared numbers are
the work of the force, the largest displacement and the largest regular stress (von Mises).  The
error of the work is the square of the relative error in the energy norm.  This program reports
its largest regular stress; that of CalculiX is the largest at the nodes near the place where the
reference has its largest one.

The reference of a part is the optimal spline on smaller hexes.  OUTPUT/PART.json holds a row per
model, so that a study goes on where it ended; OUTPUT/table.md and OUTPUT/plot.png show all of them.
CalculiX must be installed as ccx.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import gmsh
import matplotlib.pyplot as plt
import meshio
import numpy as np

from docs.notes.frequencies import TETRAHEDRON, infer, nodes
from polycube.io.surfaces import read_surface
from polycube.surface.measures import face_areas

# sizes in diagonals, and elements on a full circle
TETRAHEDRA = {0.12: 8, 0.08: 12, 0.05: 18, 0.035: 26, 0.025: 36}
LEAST = 0.01  # of the area of the part: smallest face that is held or loaded
FORCE = 100.0  # N
ORDER = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]  # nodes of a tetrahedron of Gmsh in the order of Abaqus
SHARES = (0.5, 0.65, 0.8)  # sizes of the hexes of a reference, of those of the first mesh
LARGEST = 350_000  # unknowns of a reference, about
REFERENCE = "optimal, smaller hexes"
NEAR = 0.03  # diagonals: how far from the place of the largest stress that of CalculiX may lie
NUMBERS = ("work", "displacement", "stress")
ESTIMATES = {"displacement": "displacement_error", "stress": "max_von_mises_error"}
Row = dict[str, Any]


class Case:
    """A part, its held and its loaded CAD face, and the force.

    chosen : numbers of both faces, and the axis of the force; by default as described above
    """

    def __init__(self, part: Path, chosen: tuple[int, int, int] | None = None) -> None:
        surface, _ = read_surface(part)
        self.radius = NEAR * float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
        area = face_areas(surface)
        middles = surface.vertices[surface.faces].mean(axis=1)
        total = np.bincount(surface.region, area)
        centre = np.stack([np.bincount(surface.region, area * x) for x in middles.T], axis=1)
        centre /= np.maximum(total, 1e-300)[:, None]
        if chosen is None:
            own = np.flatnonzero(total > LEAST * total.sum())
            apart = np.linalg.norm(centre[own][:, None] - centre[own], axis=2)
            i, j = own[list(np.unravel_index(apart.argmax(), apart.shape))].tolist()
            chosen = i, j, int(np.abs(centre[j] - centre[i]).argmin())
        *faces, axis = chosen
        self.part, self.faces = part, faces
        self.centres = centre[faces]
        self.force = FORCE * np.eye(3)[axis]
        self.settings = [
            "analysis=static",
            "analysis.units=mm",
            f"analysis.fixed=[cad_face_{self.faces[0]}]",
            f"analysis.loads=[{{at: cad_face_{self.faces[1]}, force: {self.force.tolist()}}}]",
        ]


def priced(run: Callable[[], Row]) -> Row:
    """The row of a run with the CPU seconds of this process and its children."""

    def spent() -> float:
        used = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
        return sum(each.ru_utime + each.ru_stime for each in used)

    began = spent()
    row = run()
    return {**row, "seconds": spent() - began + row.get("seconds", 0.0)}


def mesh(part: Path, run: Path, *settings: str) -> float:
    """Mesh a part with further settings; the CPU seconds."""

    def meshed() -> Row:
        infer(f"mesh={part}", f"output_dir={run}", "order=[meshing]", *settings)
        return {}

    return float(priced(meshed)["seconds"])


def models(case: Case, folder: Path, rows: dict[str, Row]) -> dict[str, Callable[[], Row]]:
    """What is solved for a part, by name; all spaces are on the hexes of the first run."""
    first = folder / "auto"

    def automatic(run: Path, *settings: str) -> Row:
        meshed = mesh(case.part, run, *settings)
        made = run.with_name(f"{run.name}-static")
        steps = "order=[meshing,spline,analysis]"
        infer(f"resume={run}", "from=spline", f"output_dir={made}", steps, *case.settings)
        return {**solved(made), "meshed": meshed}

    def spline(run: Path, space: str, element: str) -> Row:
        made = run.with_name(f"{run.name}-{space}")
        infer(
            f"resume={run}",
            "from=spline",
            f"output_dir={made}",
            f"spline={space}",
            "export=[abaqus]",
            f"export.abaqus.element={element}",
            *case.settings,
        )
        return {**solved(made), "seconds": rows["auto"]["meshed"]}

    def reference() -> Row:
        each = rows["optimal"]["unknowns"] / hexes(first)
        for share in SHARES:
            fine = folder / f"fine-{share:g}"
            size = f"meshing.size={share * length(first):g}"
            with suppress(subprocess.CalledProcessError):  # too many hexes
                mesh(case.part, fine, size)
                if each * hexes(fine) < LARGEST:
                    break
        return spline(fine, "optimal", "C3D8I")

    def deck(name: str) -> Row:
        found = calculix(folder / name / "hex.inp", rows[REFERENCE]["at"], case.radius)
        return {**found, "seconds": rows["auto"]["meshed"]}

    def free(size: float, round_ones: int) -> Row:
        at = folder / f"tetrahedra-{size:g}.inp"
        tetrahedra(case, at, size, round_ones)
        return calculix(at, rows[REFERENCE]["at"], case.radius)

    found = {
        "auto": lambda: automatic(first),
        "first": lambda: automatic(folder / "first", "effort=first"),
        "h2s": lambda: spline(first, "h2s", "C3D20R"),
        "optimal": lambda: spline(first, "optimal", "C3D8I"),
        REFERENCE: reference,
        "C3D20R": lambda: deck("auto-h2s"),
        "C3D8I": lambda: deck("auto-optimal"),
    }
    for size, round_ones in TETRAHEDRA.items():
        found[f"C3D10, {100 * size:g} %"] = partial(free, size, round_ones)
    return found


def hexes(run: Path) -> int:
    """Number of hexes of a run."""
    return int(json.loads((run / "report.json").read_text())["hex"]["hexes"])


def length(run: Path) -> float:
    """Mean length of the hexes of a run."""
    mesh = meshio.read(run / "hex.vtu")
    corners = mesh.points[mesh.cells_dict["hexahedron"]]
    return float(np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1).mean())


def solved(run: Path) -> Row:
    """The numbers of a run of this program."""
    report = json.loads((run / "report.json").read_text())
    static = report["static"]
    return {
        "unknowns": 3 * report["spline"]["functions"],
        "work": 2 * static["strain_energy"],
        "displacement": static["max_displacement"],
        "stress": static["max_von_mises"],
        "at": static["max_von_mises_at"],
        "estimates": {name: static[kept] for name, kept in ESTIMATES.items()},
    }


def calculix(deck: Path, place: list[float], radius: float) -> Row:
    """The numbers that CalculiX finds for a deck; the displacement of all nodes is requested.

    The stress is the largest at the nodes within a radius of a place.
    """
    text = deck.read_text()
    if "*NODE PRINT" not in text:
        text = text.replace("*END STEP", "*NODE PRINT, NSET=all\nU\n*END STEP")
        deck.write_text(text)
    environment = {**os.environ, "OMP_NUM_THREADS": str(os.cpu_count())}
    command = ["ccx", "-i", deck.stem]
    subprocess.run(command, check=True, cwd=deck.parent, env=environment, capture_output=True)
    rows = map(str.split, deck.with_suffix(".dat").read_text().splitlines())
    moved = np.array([row for row in rows if len(row) == 4 and row[0].isdigit()], float)
    at = {int(row[0]): row[1:] for row in moved}
    loads = text.partition("*CLOAD\n")[2].partition("*")[0].splitlines()
    forces = (line.split(",") for line in loads)
    work = sum(float(f) * at[int(node)][int(axis) - 1] for node, axis, f in forces) * 1e-3
    largest = float(np.linalg.norm(moved[:, 1:], axis=1).max())
    stress = 1e6 * largest_stress(deck.with_suffix(".frd"), place, radius)
    return {"unknowns": 3 * nodes(deck), "work": work, "displacement": largest, "stress": stress}


def largest_stress(file: Path, place: list[float], radius: float) -> float:
    """Largest von Mises stress at the nodes within a radius of a place, of a file of CalculiX."""
    points, stress = stresses(file)
    return float(stress[np.linalg.norm(points - place, axis=1) < radius].max())


def stresses(file: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) and von Mises stresses (N,) at the nodes of a file of CalculiX."""
    text = file.read_text()
    points, found = rows_after(text, "    2C", 3), rows_after(text, " -4  STRESS", 6)
    order = np.searchsorted(points[:, 0], found[:, 0])
    normal, shear = found[:, 1:4], found[:, 4:]
    apart = ((normal - np.roll(normal, 1, axis=1)) ** 2).sum(axis=1) / 2
    return points[order, 1:], np.sqrt(apart + 3 * (shear**2).sum(axis=1))


def rows_after(text: str, header: str, count: int) -> np.ndarray:
    """Node and numbers (N, 1 + count) of the rows that follow a header in a file of CalculiX."""
    ends = [(3, 13), *((13 + 12 * i, 25 + 12 * i) for i in range(count))]
    rows = text.partition(header)[2].partition("\n -3")[0].splitlines()
    return np.array([[float(row[i:j]) for i, j in ends] for row in rows if row[:3] == " -1"])


def tetrahedra(
    case: Case,
    deck: Path,
    size: float,
    round_ones: int,
    refine: Callable[[float], None] | None = None,
) -> None:
    """Write a deck of second-order tetrahedra of Gmsh, of a size in diagonals and round curves.

    refine : sets further sizes in Gmsh before it meshes; gets the diagonal
    """
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.merge(str(case.part))
        box = np.reshape(gmsh.model.getBoundingBox(-1, -1), (2, 3))
        length = size * np.linalg.norm(box[1] - box[0])
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", round_ones)
        gmsh.option.setNumber("Mesh.MeshSizeMax", length)
        gmsh.option.setNumber("Mesh.MeshSizeMin", length / 20)
        if refine is not None:
            refine(length / size)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        gmsh.model.mesh.optimize("HighOrder")
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        kinds, _, elements = gmsh.model.mesh.getElements(3)
        places = [gmsh.model.occ.getCenterOfMass(2, tag) for _, tag in gmsh.model.getEntities(2)]
        held, loaded = (
            1 + int(np.linalg.norm(np.array(places) - centre, axis=1).argmin())
            for centre in case.centres
        )
        ends = gmsh.model.mesh.getNodes(2, held, includeBoundary=True)[0]
        sides = np.reshape(gmsh.model.mesh.getElements(2, loaded)[2][0], (-1, 6))
    finally:
        gmsh.finalize()
    assert list(kinds) == [TETRAHEDRON]
    number = np.zeros(int(tags.max()) + 1, np.int64)
    used = np.unique(elements[0])
    number[used] = 1 + np.arange(len(used))
    place = dict(zip(tags.tolist(), coordinates.reshape(-1, 3).tolist(), strict=True))
    lines = ["*NODE, NSET=all"]
    lines += [
        f"{number[tag]}, " + ", ".join(f"{x:.12e}" for x in place[tag]) for tag in used.tolist()
    ]
    lines.append("*ELEMENT, TYPE=C3D10, ELSET=all")
    rows = number[np.reshape(elements[0], (-1, 10))[:, ORDER]].tolist()
    lines += [f"{i}, " + ", ".join(map(str, row)) for i, row in enumerate(rows, 1)]
    corners = np.array([[place[tag] for tag in row[:3]] for row in sides.tolist()])
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    share: dict[int, float] = {}  # of the force: a third of a triangle at each middle of an edge
    for row, own in zip(sides[:, 3:].tolist(), (area / area.sum() / 3).tolist(), strict=True):
        for tag in row:
            share[tag] = share.get(tag, 0.0) + own
    axis = int(case.force.argmax())
    lines += ["*MATERIAL, NAME=steel", "*ELASTIC", "210000., 0.3"]
    lines += ["*SOLID SECTION, ELSET=all, MATERIAL=steel", "*STEP", "*STATIC", "*BOUNDARY"]
    lines += [f"{number[tag]}, 1, 3" for tag in ends.tolist()]
    lines.append("*CLOAD")
    lines += [f"{number[tag]}, {axis + 1}, {FORCE * own:.12e}" for tag, own in share.items()]
    deck.write_text("\n".join([*lines, "*EL FILE", "S", "*END STEP"]) + "\n")


def refine_at(place: list[float], size: float, diagonal: float) -> None:
    """Have Gmsh make elements of a size in diagonals round a place, growing outside."""
    radius = 2 * NEAR * diagonal
    ball = gmsh.model.mesh.field.add("Ball")
    numbers = dict(zip(("XCenter", "YCenter", "ZCenter"), place, strict=True))
    numbers |= {"Radius": radius, "Thickness": 2 * radius, "VIn": size * diagonal, "VOut": 1e22}
    for name, value in numbers.items():
        gmsh.model.mesh.field.setNumber(ball, name, value)
    gmsh.model.mesh.field.setAsBackgroundMesh(ball)


def errors(row: Row, reference: Row) -> list[float]:
    """Errors of work, largest displacement and largest stress, in per cent of the reference's."""
    return [100 * (row[name] / reference[name] - 1) for name in NUMBERS]


def table(found: dict[str, dict[str, Row]]) -> list[str]:
    """Lines of a table in Markdown."""
    names = " | ".join(f"{name}, %" for name in NUMBERS)
    lines = [f"| part | model | unknowns | {names} | estimates, % | CPU s |", "|---" * 8 + "|"]
    for part, rows in found.items():
        for name, row in rows.items():
            own = row.get("estimates", {})
            estimates = ", ".join(f"{100 * off / row[what]:.2g}" for what, off in own.items())
            off = " | ".join(f"{each:+.2f}" for each in errors(row, rows[REFERENCE]))
            lines.append(
                f"| {part} | {name} | {row['unknowns']:,} | {off} | {estimates} "
                f"| {row['seconds']:.1f} |"
            )
    return lines


def plot(found: dict[str, dict[str, Row]]) -> plt.Figure:
    """Error of the work against unknowns, and against CPU seconds below."""
    kinds = {
        "auto": "D",
        "first": "*",
        "h2s": "o",
        "optimal": "s",
        "C3D8I": "^",
        "C3D20R": "v",
        "C3D10": "x",
    }
    size = (2.3 * len(found), 6)
    figure, axes = plt.subplots(
        2, len(found), figsize=size, sharey=True, layout="constrained", squeeze=False
    )
    for column, (part, rows) in enumerate(found.items()):
        for colour, (kind, marker) in enumerate(kinds.items()):
            chosen = [
                row for name, row in rows.items() if name.partition(",")[0] == kind != REFERENCE
            ]
            chosen = [row for row in chosen if row is not rows[REFERENCE]]
            off = [abs(errors(row, rows[REFERENCE])[0]) for row in chosen]
            for axis, unit in zip(axes[:, column], ("unknowns", "seconds"), strict=True):
                x = [row[unit] for row in chosen]
                axis.loglog(x, off, f"{marker}-", color=f"C{colour}", label=kind)
                axis.set_xlabel("CPU seconds" if unit == "seconds" else unit)
                axis.grid(alpha=0.3)
                axis.xaxis.set_minor_formatter("")
        axes[0, column].set_title(part)
    for axis in axes[:, 0]:
        axis.set_ylabel("error of the work, %")
    axes[0, 0].legend(fontsize=8)
    return figure


def study(
    models: Callable[[Case, Path, dict[str, Row]], dict[str, Callable[[], Row]]],
    table: Callable[[dict[str, dict[str, Row]]], list[str]],
    plot: Callable[[dict[str, dict[str, Row]]], plt.Figure],
) -> None:
    """Run the models of all parts that are not there yet, then write table and plot.

    A model that is too large gives a row without unknowns, which is empty.
    """
    output = Path(sys.argv[1])
    output.mkdir(parents=True, exist_ok=True)
    found = {}
    for part in map(Path, sys.argv[2:]):
        kept, case = output / f"{part.stem}.json", Case(part)
        (output / part.stem).mkdir(exist_ok=True)
        rows: dict[str, Row] = json.loads(kept.read_text()) if kept.exists() else {}
        for name, run in models(case, output / part.stem, rows).items():
            if name not in rows:
                row = priced(run)
                rows[name] = row if "unknowns" in row else {}
                kept.write_text(json.dumps(rows, indent=1))
        found[part.stem] = rows
        (output / "table.md").write_text("\n".join(table(found)) + "\n")
    plot(found).savefig(output / "plot.png", dpi=110)


if __name__ == "__main__":
    study(models, table, plot)
