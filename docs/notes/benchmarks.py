"""Well-known benchmarks of solid mechanics, from STEP files drawn here to the compared number.

    python docs/notes/benchmarks.py OUTPUT [NAME ...]

Each benchmark is one command of `infer.py`, which is printed. OUTPUT/NAME.step is the part,
OUTPUT/NAME the folder of the run, OUTPUT/table.md the table of all that were computed.

Targets: NAFEMS, The Standard NAFEMS Benchmarks, TNSB rev. 3, 1990 (LE10, LE11, FV22, FV41, FV52);
MacNeal and Harder 1985 (the roof of Scordelis and Lo); Timoshenko and Goodier, Theory of
Elasticity (thick sphere under internal pressure); Kirsch 1898 (plate with a hole, in plane strain,
with the exact tractions at its outer sides).
"""

from __future__ import annotations

import json
import shlex
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import gmsh
import numpy as np

import polycube
from polycube.io.surfaces import read_surface
from polycube.result import Result
from polycube.spline.boundary import corner_nodes

MM = 1000.0  # the benchmarks are in metres, the files in mm
METAL = "{young: 200e9, poisson: 0.3, density: 8000}"
occ = gmsh.model.occ


@dataclass(frozen=True)
class Benchmark:
    """A part, its overrides, and the numbers that are compared with their targets.

    faces : points on CAD faces without a name, by the word that stands for them in the overrides
    compared : from the result to (what, value, target) of each number
    """

    draw: Callable[[], None]
    overrides: tuple[str, ...]
    compared: Callable[[Result], list[tuple[str, float, float]]]
    faces: dict[str, tuple[float, float, float]] | None = None


def at(found: Result, point: tuple[float, float, float], field: str) -> np.ndarray:
    """A field at a corner of an element on the boundary, where it is the Bezier coefficient."""
    places = found.spline.extraction @ found.spline.control
    corners = np.unique(corner_nodes(found.spline))
    off = np.linalg.norm(places[corners] - MM * np.array(point), axis=1)
    assert off.min() < 1e-3 * np.ptp(places), f"no element corner at {point}: {off.min():.3g} mm"
    return getattr(found.solution, field)[corners[off.argmin()]]


def frequencies(*targets: tuple[int, float]) -> Callable[[Result], list]:
    """Modes by number, from one, with their targets in Hz."""

    def compared(found: Result) -> list[tuple[str, float, float]]:
        return [(f"mode {n}, Hz", found.modes.frequency[n - 1], f) for n, f in targets]

    return compared


def axisymmetric(*targets: float) -> Callable[[Result], list]:
    """The elastic modes whose radial and axial components depend on radius and height only."""

    def compared(found: Result) -> list[tuple[str, float, float]]:
        x, y, z = (found.spline.extraction @ found.spline.control).T
        radius, terms = np.hypot(x, y), []
        r, h = (2 * (a - a.min()) / np.ptp(a) - 1 for a in (radius, z))
        for i, j in np.ndindex(3, 14):
            terms.append(r**i * np.polynomial.chebyshev.chebval(h, np.eye(14)[j]))
        basis, own = np.stack(terms, axis=1), []
        for frequency, shape in zip(found.modes.frequency, found.modes.shapes, strict=True):
            u = found.spline.extraction @ shape
            u = np.stack([(u[:, 0] * x + u[:, 1] * y) / radius, u[:, 2]], axis=1)
            rest = u - basis @ np.linalg.lstsq(basis, u, rcond=None)[0]
            if frequency > 1 and (rest**2).sum() < 0.3 * (u**2).sum():
                own.append(frequency)
        names = (f"axisymmetric mode {n}, Hz" for n in range(2, 2 + len(targets)))
        return list(zip(names, own, targets, strict=False))

    return compared


def elliptic_plate() -> None:
    """A quarter of LE10 in two layers, so that the middle of the outer face is an edge."""
    gmsh.option.set_number("Geometry.OCCUnionUnify", 0)
    halves = []
    for z in (0.0, 0.3):
        outer, inner = (
            occ.add_cylinder(0, 0, z, 0, 0, 0.3, 1),
            occ.add_cylinder(0, 0, z, 0, 0, 1, 1),
        )
        occ.dilate([(3, outer)], 0, 0, 0, 3.25, 2.75, 1)
        occ.dilate([(3, inner)], 0, 0, 0, 2.0, 1.0, 1)
        quarter, _ = occ.intersect([(3, outer)], [(3, occ.add_box(0, 0, 0, 4, 4, 1))])
        halves += occ.cut(quarter, [(3, inner)])[0]
    occ.fuse(halves[:1], halves[1:])


def extruded(corners: list[tuple[float, float]], height: float) -> None:
    """A polygon (x, y), extruded along z."""
    points = [occ.add_point(*corner, 0) for corner in corners]
    lines = [occ.add_line(a, b) for a, b in zip(points, points[1:] + points[:1], strict=True)]
    occ.extrude([(2, occ.add_plane_surface([occ.add_curve_loop(lines)]))], 0, 0, height)


def pipe() -> None:
    """A quarter of the tube of FV41, about z."""
    outer, inner = (occ.add_cylinder(0, 0, 0, 0, 0, 10, r, angle=np.pi / 2) for r in (2.2, 1.8))
    occ.cut([(3, outer)], [(3, inner)])


def roof() -> None:
    """A quarter of the roof: 25 m of its length along y, 40 degrees on the side of positive x."""
    start = occ.add_rectangle(24.875, 0, 0, 0.25, 25)
    occ.rotate([(2, start)], 0, 0, 0, 0, 1, 0, -np.radians(90))
    occ.revolve([(2, start)], 0, 0, 0, 0, 1, 0, np.radians(40))


def shell() -> None:
    """An eighth of a hollow sphere with radii 1 and 2."""
    outer, inner = (occ.add_sphere(0, 0, 0, r, angle1=0, angle3=np.pi / 2) for r in (2, 1))
    occ.cut([(3, outer)], [(3, inner)])


def taper() -> None:
    """A quarter of LE11: a sphere, a taper and a cylinder, turned about z."""
    s = np.sqrt(0.5)
    corners = [(1, 0), (1.4, 0), (1.4 * np.cos(np.pi / 6), 0.7), (1, 1.39), (1, 1.79)]
    corners += [(s, 1.79), (s, s)]
    a, b, d, g, i, h, e = (occ.add_point(r, 0, z) for r, z in corners)
    centre = occ.add_point(0, 0, 0)
    lines = [occ.add_line(*ends) for ends in ((a, b), (d, g), (g, i), (i, h), (h, e))]
    arcs = occ.add_circle_arc(b, centre, d), occ.add_circle_arc(e, centre, a)
    loop = occ.add_curve_loop([lines[0], arcs[0], *lines[1:], arcs[1]])
    occ.revolve([(2, occ.add_plane_surface([loop]))], 0, 0, 0, 0, 0, 1, np.pi / 2)


def holed() -> None:
    """A quarter of a square plate with a hole of radius 1, up to x = y = 4."""
    hole = occ.add_cylinder(0, 0, 0, 0, 0, 1, 1)
    occ.cut([(3, occ.add_box(0, 0, 0, 4, 4, 1))], [(3, hole)])


def kirsch() -> tuple[str, str, str]:
    """Stresses xx, yy, xy in Pa of an infinite plate under 1 MPa along x, in mm (Kirsch 1898)."""
    r2 = f"((x**2 + y**2) / {MM:g}**2)"
    c2, s2 = "((x**2 - y**2) / (x**2 + y**2))", "(2 * x * y / (x**2 + y**2))"
    c4, s4 = f"(2 * {c2}**2 - 1)", f"(2 * {s2} * {c2})"
    return (
        f"1e6 * (1 - (1.5 * {c2} + {c4}) / {r2} + 1.5 * {c4} / {r2}**2)",
        f"1e6 * (-(0.5 * {c2} - {c4}) / {r2} - 1.5 * {c4} / {r2}**2)",
        f"1e6 * (-(0.5 * {s2} + {s4}) / {r2} + 1.5 * {s4} / {r2}**2)",
    )


XX, YY, XY = kirsch()
SIDES = [f"{axis}_{end}" for axis in "xy" for end in ("min", "max")]
SYMMETRIC = "{at: x_min, components: [x]}, {at: y_min, components: [y]}"
RIM = 25.125 * np.sin(np.radians(40)), 25.125 * np.cos(np.radians(40))  # free edge of the roof
SKEW = 10 * np.cos(np.radians(45))
BENCHMARKS = {
    "LE10": Benchmark(
        elliptic_plate,
        (
            "analysis=static",
            "analysis.material={young: 210e9, poisson: 0.3, density: 7850}",
            f"analysis.fixed=[{SYMMETRIC}, {{at: LOW, components: [x, y]}}, "
            "{at: HIGH, components: [x, y]}, {at: {edge: [LOW, HIGH]}, components: [z]}]",
            "analysis.loads=[{at: z_max, pressure: 1e6}]",
        ),
        lambda r: [("stress yy at D, MPa", at(r, (2, 0, 0.6), "stress")[1] / 1e6, -5.38)],
        {"LOW": (2.298, 1.945, 0.15), "HIGH": (2.298, 1.945, 0.45)},
    ),
    "LE11": Benchmark(
        taper,
        (
            "analysis=static",
            "analysis.material={young: 210e9, poisson: 0.3, density: 7850, expansion: 2.3e-4}",
            f"analysis.fixed=[{SYMMETRIC}, {{at: z_min, components: [z]}}, "
            "{at: z_max, components: [z]}]",
            f"analysis.temperature='(sqrt(x**2 + y**2) + z) / {MM:g}'",
        ),
        lambda r: [("stress zz at A, MPa", at(r, (1, 0, 0), "stress")[2] / 1e6, -105.0)],
    ),
    "hole": Benchmark(
        holed,
        (
            "analysis=static",
            f"analysis.material={METAL}",
            f"analysis.fixed=[{SYMMETRIC}, {{at: z_min, components: [z]}}, "
            "{at: z_max, components: [z]}]",
            f"analysis.loads=[{{at: x_max, traction: ['{XX}', '{XY}', 0]}}, "
            f"{{at: y_max, traction: ['{XY}', '{YY}', 0]}}]",
        ),
        lambda r: [
            ("stress xx at (0, 1), MPa", at(r, (0, 1, 0), "stress")[0] / 1e6, 3.0),
            ("stress yy at (1, 0), MPa", at(r, (1, 0, 0), "stress")[1] / 1e6, -1.0),
        ],
    ),
    "FV22": Benchmark(
        lambda: extruded([(0, 0), (10, 0), (10 + SKEW, SKEW), (SKEW, SKEW)], 1.0),
        (
            "analysis=modal",
            f"analysis.material={METAL}",
            "analysis.fixed=[y_min, y_max, LEFT, RIGHT]",
            "analysis.modes=6",
        ),
        frequencies((1, 133.95), (2, 201.41), (3, 265.81), (4, 282.74), (5, 334.45)),
        {"LEFT": (SKEW / 2, SKEW / 2, 0.5), "RIGHT": (10 + SKEW / 2, SKEW / 2, 0.5)},
    ),
    "FV41": Benchmark(
        pipe,
        (
            "analysis=modal",
            f"analysis.material={METAL}",
            f"analysis.fixed=[{SYMMETRIC}]",
            "analysis.modes=50",
        ),
        axisymmetric(243.53, 377.41, 394.11, 397.72, 405.28),
    ),
    "FV52": Benchmark(
        lambda: occ.add_box(0, 0, 0, 10, 10, 1),
        (
            "analysis=modal",
            f"analysis.material={METAL}",
            "analysis.fixed=["
            + ", ".join(f"{{at: {{edge: [{s}, z_min]}}, components: [z]}}" for s in SIDES)
            + "]",
            "analysis.modes=12",
        ),
        frequencies((4, 45.897), (5, 109.44), (7, 167.89), (8, 193.59), (9, 206.19)),
    ),
    "roof": Benchmark(
        roof,
        (
            "analysis=static",
            "analysis.material={young: 4.32e8, poisson: 0.0, density: 360}",
            "analysis.fixed=[{at: y_min, components: [x, z]}, {at: y_max, components: [y]}, "
            "{at: x_min, components: [x]}]",
            "analysis.gravity=[0, 0, -1]",
        ),
        lambda r: [
            (
                "deflection of the free edge, ft",
                -at(r, (RIM[0], 25, RIM[1]), "displacement")[2] / MM,
                0.3024,
            )
        ],
    ),
    "sphere": Benchmark(
        shell,
        (
            "analysis=static",
            "analysis.material={young: 1e9, poisson: 0.3, density: 1000}",
            f"analysis.fixed=[{SYMMETRIC}, {{at: z_min, components: [z]}}]",
            "analysis.loads=[{at: INSIDE, pressure: 1e6}]",
        ),
        lambda r: [
            # u = p a / (E (b^3 - a^3)) ((1 - 2 nu) a^3 + (1 + nu) b^3 / 2), hoop stress at a
            ("displacement inside, mm", at(r, (1, 0, 0), "displacement")[0], 5.6 / 7),
            ("hoop stress inside, MPa", at(r, (1, 0, 0), "stress")[1] / 1e6, 5 / 7),
        ],
        {"INSIDE": (1 / np.sqrt(3),) * 3},
    ),
}


def drawn(name: str, folder: Path) -> Path:
    """The STEP file of a benchmark, in mm."""
    path = folder / f"{name}.step"
    gmsh.initialize()
    gmsh.option.set_number("General.Terminal", 0)
    BENCHMARKS[name].draw()
    occ.dilate(occ.get_entities(3), 0, 0, 0, MM, MM, MM)
    occ.synchronize()
    gmsh.write(str(path))
    gmsh.finalize()
    return path


def named(overrides: tuple[str, ...], path: Path, faces: dict[str, tuple]) -> list[str]:
    """The overrides with the numbers of CAD faces, found by points on them."""
    surface, _ = read_surface(path)
    middles = surface.vertices[surface.faces].mean(axis=1)
    found = list(overrides)
    for word, point in faces.items():
        number = surface.region[np.linalg.norm(middles - MM * np.array(point), axis=1).argmin()]
        found = [each.replace(word, f"cad_face_{number}") for each in found]
    return found


def main() -> None:
    """Run the benchmarks that are named, or all; write the table of those with a result."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[2:] or BENCHMARKS:
        path, own = drawn(name, folder), BENCHMARKS[name]
        overrides = named(own.overrides, path, own.faces or {})
        sys.stdout.write(f"python infer.py mesh={path} {shlex.join(overrides)}\n")
        start = time.process_time()
        found = polycube.mesh(path, *overrides, output_dir=folder / name)
        row = {
            "hexes": len(found.hexes.hexes),
            "functions": len(found.spline.control),
            "seconds": time.process_time() - start,
            "compared": [(what, float(value), goal) for what, value, goal in own.compared(found)],
        }
        (folder / f"{name}.json").write_text(json.dumps(row))
    lines = ["| benchmark | quantity | target | result | error | hexes | functions | CPU s |"]
    lines.append("|---|---|---|---|---|---|---|---|")
    for path in sorted(folder.glob("*.json")):
        row = json.loads(path.read_text())
        price = f"{row['hexes']:,} | {row['functions']:,} | {row['seconds']:.0f}"
        for what, value, goal in row["compared"]:
            error = f"{value / goal - 1:+.2%}"
            name = path.stem
            lines.append(f"| {name} | {what} | {goal:.5g} | {value:.5g} | {error} | {price} |")
            price = " | | "
    text = "\n".join(lines) + "\n"
    (folder / "table.md").write_text(text)
    sys.stdout.write(text)


if __name__ == "__main__":
    main()
