"""Frequencies of ten assemblies: their hexes in CalculiX, and splines, against tetrahedra.

    python docs/notes/assemblies.py OUTPUT [NAME ...]

The assemblies are drawn in OUTPUT as STEP files: each solid is a body of its own with a name, and
faces of different solids coincide where they touch, as CAD programs export them.  Each is meshed
with `cad.solid=all` and a size, and compared by its first ten elastic frequencies.  All are free
but the gears, whose bores are held.

`meshing` is this run, and `deck` its file in CalculiX.  `spline` is a run with default settings,
which has no modes of the whole where the meshes do not agree.  The reference are tetrahedra C3D10
of Gmsh in CalculiX, which share the nodes at all contacts, of two sizes; the finer one counts, and
its difference from the coarser one shows how accurate it is.  Seconds are those of the CPU.

OUTPUT/NAME.json and OUTPUT/NAME-reference.json hold a row per model, so that a study goes on where
it ended; what failed is tried again.  OUTPUT/table.md shows all of them.  CalculiX must be
installed as ccx.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import gmsh
import numpy as np

from docs.notes.drawn_assemblies import ASSEMBLIES, Assembly, model, write
from docs.notes.frequencies import HERE, MODES, TETRAHEDRON, calculix
from docs.notes.statics import ORDER, Row, priced
from polycube.analysis.problem import MATERIALS

SHARES = {"coarse": 1.4, "fine": 1.0}  # sizes of tetrahedra, of the finer size
AROUND = 10  # tetrahedra on a circle, at the finer size


def models(name: str, folder: Path) -> dict[str, Callable[[], Row]]:
    """What is run for an assembly, by name."""
    assembly = ASSEMBLIES[name]
    step, meshed, splined = folder / f"{name}.step", folder / name, folder / f"{name}-spline"
    materials = ", ".join(f"{solid}: {each}" for solid, each in assembly.materials.items())
    settings = [
        f"mesh={step}",
        "cad.solid=all",
        f"meshing.size={assembly.size}",
        f"cad.materials={{{materials}}}",
        "analysis=modal",
        "analysis.units=mm",
        f"analysis.modes={assembly.rigid + MODES}",
        f"analysis.fixed=[{', '.join(assembly.held)}]",
    ]

    def meshing() -> Row:
        write(assembly, step)
        said = infer(*settings, "order=[meshing]", "export=[abaqus]", f"output_dir={meshed}")
        report = read(meshed)
        if "hex" not in report:
            return {"failed": said}
        kept = ("solids", "faces", "names", "area", "common_area", "quads", "joined")
        contacts = [{key: each.get(key) for key in kept} for each in report["contacts"]]
        row = {"solids": len(report["solids"]), "contacts": contacts}
        row["warnings"] = report["mesh_warnings"]
        row |= {key: report["hex"][key] for key in ("hexes", "min_scaled_jacobian")}
        return {**row, "failed": said} if said else row

    def spline() -> Row:
        said = infer(*settings, f"output_dir={splined}")
        report = read(splined)
        if said or "modes" not in report:
            return {"failed": said or "the report has no modes of the whole"}
        return {"frequencies": report["modes"]["frequency_hz"][assembly.rigid :]}

    return {
        "meshing": meshing,
        "deck": lambda: solved(meshed / "hex.inp", assembly.rigid),
        "spline": spline,
    }


def infer(*settings: str) -> str:
    """Run infer.py; the last line of its errors if it ends with one."""
    command = [sys.executable, str(HERE / "infer.py"), *settings, "quiet=true"]
    run = subprocess.run(command, cwd=HERE, capture_output=True, text=True)
    return run.stderr.splitlines()[-1] if run.returncode else ""


def read(run: Path) -> Row:
    """The report of a run; empty if it wrote none."""
    kept = run / "report.json"
    return json.loads(kept.read_text()) if kept.exists() else {}


def solved(deck: Path, rigid: int) -> Row:
    """Elastic frequencies that CalculiX finds for a deck."""
    if not deck.exists():
        return {"failed": "there is no deck"}
    try:
        found = calculix(deck, rigid)
    except subprocess.CalledProcessError as error:
        return {"failed": f"CalculiX ended with {error.returncode}"}
    return {name: found[name] for name in ("unknowns", "frequencies")}


def references(name: str, folder: Path) -> dict[str, Callable[[], Row]]:
    """The tetrahedra of an assembly, coarse ones first."""
    assembly = ASSEMBLIES[name]

    def reference(size: str) -> Row:
        deck = folder / f"{name}-{size}.inp"
        tetrahedra(assembly, deck, SHARES[size])
        return solved(deck, assembly.rigid)

    return {size: partial(reference, size) for size in SHARES}


def tetrahedra(assembly: Assembly, deck: Path, share: float) -> None:
    """Write a deck of second-order tetrahedra of Gmsh, which share nodes where solids touch.

    share : of the finer size of the tetrahedra of the assembly
    """
    with model(assembly) as names:
        pieces = gmsh.model.occ.fragment(gmsh.model.getEntities(3), [])[1]
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", AROUND / share)
        gmsh.option.setNumber("Mesh.MeshSizeMax", assembly.tetrahedra * share)
        refine(assembly.tetrahedra * share, assembly.edges)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        gmsh.model.mesh.optimize("HighOrder")
        tags, places, _ = gmsh.model.mesh.getNodes()
        solids = [gmsh.model.mesh.getElements(3, own[0][1]) for own in pieces]
        faces = [
            tag
            for box in assembly.held.values()
            for _, tag in gmsh.model.getEntitiesInBoundingBox(*box, 2)
        ]
        held = [gmsh.model.mesh.getNodes(2, tag, includeBoundary=True)[0] for tag in faces]
    order = np.argsort(tags)
    used = np.unique(np.concatenate([corners[0] for _, _, corners in solids]))
    points = places.reshape(-1, 3)[order[np.searchsorted(tags[order], used)]]
    lines = ["*NODE, NSET=all"]
    lines += [
        f"{i}, {x:.12e}, {y:.12e}, {z:.12e}"
        for i, (x, y, z) in zip(used, points.tolist(), strict=True)
    ]
    for number, (name, (kinds, elements, corners)) in enumerate(zip(names, solids, strict=True)):
        assert list(kinds) == [TETRAHEDRON]
        rows = corners[0].reshape(-1, 10)[:, ORDER].tolist()
        lines.append(f"*ELEMENT, TYPE=C3D10, ELSET=solid_{number}")
        lines += [
            f"{i}, {', '.join(map(str, row))}" for i, row in zip(elements[0], rows, strict=True)
        ]
        of = MATERIALS[assembly.materials[name]]
        lines += [f"*MATERIAL, NAME=solid_{number}", "*ELASTIC"]
        lines += [f"{1e-6 * of.young:g}, {of.poisson:g}", "*DENSITY", f"{1e-12 * of.density:g}"]
        lines.append(f"*SOLID SECTION, ELSET=solid_{number}, MATERIAL=solid_{number}")
    if held:
        lines += ["*BOUNDARY", *(f"{i}, 1, 3" for i in np.unique(np.concatenate(held)))]
    lines += ["*STEP", "*FREQUENCY", str(assembly.rigid + MODES), "*END STEP"]
    deck.write_text("\n".join(lines) + "\n")


def refine(size: float, share: float) -> None:
    """Take a share of the size at the edges of contacts, where stresses may be unbounded."""
    faces = [tag for _, tag in gmsh.model.getEntities(2)]
    around = [gmsh.model.getAdjacencies(2, tag) for tag in faces]
    curves = {curve for solids, curves in around if len(solids) == 2 for curve in curves.tolist()}
    field = gmsh.model.mesh.field
    distance, threshold = field.add("Distance"), field.add("Threshold")
    field.setNumbers(distance, "CurvesList", sorted(curves))
    field.setNumber(distance, "Sampling", 50)
    field.setNumber(threshold, "InField", distance)
    for name, value in (("SizeMin", share), ("SizeMax", 1.0), ("DistMin", 0.0), ("DistMax", 1.0)):
        field.setNumber(threshold, name, value * size)
    field.setAsBackgroundMesh(threshold)


def numbered(numbers: np.ndarray, rows: list[list]) -> list[str]:
    """Lines of a deck: a number and what belongs to it."""
    pairs = zip(numbers.tolist(), rows, strict=True)
    return [f"{number}, {', '.join(map(str, row))}" for number, row in pairs]


def completed(kept: Path, runs: dict[str, Callable[[], Row]]) -> dict[str, Row]:
    """The rows of runs; those that a file has not, or that failed, are run."""
    rows: dict[str, Row] = json.loads(kept.read_text()) if kept.exists() else {}
    for name, run in runs.items():
        if "failed" in rows.get(name, {"failed": ""}):
            rows[name] = priced(run)
            kept.write_text(json.dumps(rows, indent=1))
    return {name: rows[name] for name in runs}


def line(name: str, rows: dict[str, Row], tetrahedra: list[Row]) -> str:
    """The line of an assembly in a table in Markdown."""
    coarse, fine = tetrahedra
    mesh = rows["meshing"]
    joined = [each["joined"] for each in mesh.get("contacts", ())]
    counts = joined.count("shared vertices"), joined.count("tie"), ASSEMBLIES[name].contacts
    cells = [
        f"{name}: {mesh['failed']}" if "failed" in mesh else name,
        mesh.get("solids", 0),
        f"{mesh.get('hexes', 0):,}",
        f"{mesh.get('min_scaled_jacobian', 0):.2f}",
        len(mesh.get("warnings", ())),
        ", ".join(map(str, counts)),
        f"{mesh['seconds']:.0f}",
        *(off(rows[each], fine) for each in ("deck", "spline")),
        off(coarse, fine),
    ]
    return f"| {' | '.join(map(str, cells))} |"


def off(row: Row, reference: Row) -> str:
    """The largest difference of ten frequencies from those of a reference, or why there is none."""
    if "failed" in row:
        return row["failed"]
    ours, theirs = (np.array(each["frequencies"][:MODES]) for each in (row, reference))
    difference = 100 * (ours / theirs - 1)
    return f"{difference[np.abs(difference).argmax()]:+.2f}"


def main() -> None:
    """Run what is not there yet, then write the table."""
    output = Path(sys.argv[1]).resolve()
    output.mkdir(parents=True, exist_ok=True)
    lines = [
        "| assembly | solids | hexes | min SJ | warnings | shared, tied, expected | CPU s "
        "| deck, % | spline, % | reference, % |",
        "|---" * 10 + "|",
    ]
    for name in sys.argv[2:] or ASSEMBLIES:
        known = completed(output / f"{name}-reference.json", references(name, output))
        rows = completed(output / f"{name}.json", models(name, output))
        lines.append(line(name, rows, list(known.values())))
        (output / "table.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
