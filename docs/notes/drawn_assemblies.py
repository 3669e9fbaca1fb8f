"""Ten assemblies, drawn by Gmsh's kernel OpenCASCADE, in mm: see `docs.notes.assemblies`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import gmsh
import numpy as np

from docs.notes.frequencies import RIGID

occ = gmsh.model.occ
Point = tuple[float, float, float]
X, Y, Z = np.eye(3)


def cut(solid: int, *tools: int) -> int:
    """A solid without the tools."""
    return occ.cut([(3, solid)], [(3, tool) for tool in tools])[0][0][1]


def fuse(solid: int, *others: int) -> int:
    """Solids as one."""
    return occ.fuse([(3, solid)], [(3, other) for other in others])[0][0][1]


def cylinder(radius: float, start: float, end: float, at: Point = (0, 0, 0), axis=Z) -> int:
    """A cylinder along an axis through a point, from a start to an end on it."""
    foot, along = at + start * axis, (end - start) * axis
    return occ.addCylinder(*foot, *along, radius)


def tube(outer: float, inner: float, start: float, end: float) -> int:
    """A tube along z."""
    return cut(cylinder(outer, start, end), cylinder(inner, start, end))


def prism(corners: np.ndarray, start: float, height: float) -> int:
    """A polygon (N, 2) of lines, extruded along z."""
    points = [occ.addPoint(x, y, start) for x, y in corners]
    lines = [occ.addLine(*ends) for ends in zip(points, [*points[1:], points[0]], strict=True)]
    return occ.extrude([(2, occ.addPlaneSurface([occ.addCurveLoop(lines)]))], 0, 0, height)[1][1]


def pin_in_lug() -> dict[str, list[int]]:
    """Lug of 15 with a bore of d 12, and a pin with a head of d 18."""
    lug = fuse(occ.addBox(-50, -15, 0, 50, 30, 15), cylinder(15, 0, 15))
    lug = cut(lug, cylinder(6, 0, 15))
    pin = fuse(cylinder(6, -5, 15), cylinder(9, 15, 20))
    return {"LUG": [lug], "PIN": [pin]}


def flanges() -> dict[str, list[int]]:
    """Two flanges of d 110 x 14 on pipes of d 50 x 5, and four bolts M12 with nuts in clearance."""
    places = [(42.5 * x, 42.5 * y, 0.0) for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1))]
    hexagon = 9 / np.cos(np.pi / 6) * np.exp(1j * np.pi / 3 * np.arange(6))

    def flange(sign: int) -> int:
        ends = sorted((0, sign * 14)), sorted((0, sign * 44))
        solid = fuse(cylinder(55, *ends[0]), cylinder(25, *ends[1]))
        return cut(solid, cylinder(20, *ends[1]), *(cylinder(6.75, *ends[0], at) for at in places))

    def bolt(at: Point) -> int:
        corners = np.stack([hexagon.real, hexagon.imag], axis=1) + at[:2]
        head, nut = prism(corners, 14, 8), prism(corners, -24, 10)
        return fuse(cylinder(6, -24, 14, at), head, nut)

    return {"LOWER": [flange(-1)], "UPPER": [flange(1)], "BOLT": [bolt(at) for at in places]}


def plate_on_block() -> dict[str, list[int]]:
    """Plate of 40 x 30 x 8 on a block of 70 x 50 x 25, not in its middle."""
    return {
        "BLOCK": [occ.addBox(0, 0, 0, 70, 50, 25)],
        "PLATE": [occ.addBox(20, 12, 25, 40, 30, 8)],
    }


def bush_in_bore() -> dict[str, list[int]]:
    """Block of 50 x 40 x 20 with a bore of d 24, and a bush of 3 in it, flush."""
    block = cut(occ.addBox(-25, -20, 0, 50, 40, 20), cylinder(12, 0, 20))
    return {"BLOCK": [block], "BUSH": [tube(12, 9, 0, 20)]}


def laminate() -> dict[str, list[int]]:
    """Bar of 120 x 20 of three layers, 3 and 8 and 4 thick."""
    layers = {"BOTTOM": (0, 3), "CORE": (3, 8), "TOP": (11, 4)}
    return {name: [occ.addBox(0, 0, z, 120, 20, height)] for name, (z, height) in layers.items()}


def housing() -> dict[str, list[int]]:
    """Open box of 100 x 70 x 40 with four bosses, a cover of 6 and four screws M5."""
    places = [(41.0 * x, 26.0 * y, 0.0) for x in (-1, 1) for y in (-1, 1)]

    def rounded(start: float, height: float) -> int:
        base = occ.addRectangle(-50, -35, start, 100, 70, roundedRadius=8)
        return occ.extrude([(2, base)], 0, 0, height)[1][1]

    bosses = [occ.addBox(x - 7, y - 7, 6, 14, 14, 34) for x, y, _ in places]
    cavity = cut(occ.addBox(-44, -29, 6, 88, 58, 34), *bosses)
    box = cut(rounded(0, 40), cavity, *(cylinder(2.5, 26, 40, at) for at in places))
    cover = cut(rounded(40, 6), *(cylinder(2.75, 40, 46, at) for at in places))
    screws = [fuse(cylinder(2.5, 28, 46, at), cylinder(4.25, 46, 51, at)) for at in places]
    return {"HOUSING": [box], "COVER": [cover], "SCREW": screws}


def nested_tubes() -> dict[str, list[int]]:
    """Tubes of 60, 80 and 100 in one another, from d 40 to d 22, in front flush."""
    return {
        "OUTER": [tube(20, 17, 0, 60)],
        "MIDDLE": [tube(17, 14, 0, 80)],
        "INNER": [tube(14, 11, 0, 100)],
    }


def pipe_tee() -> dict[str, list[int]]:
    """Pipe of d 40 x 4 and 120 long, and a branch of d 30 x 3 on its opening of d 24."""
    run, bore = (cylinder(radius, -60, 60, axis=X) for radius in (20, 16))
    run = cut(run, bore, cylinder(12, -30, 0))
    branch = cut(tube(15, 12, -60, 0), cylinder(20, -60, 60, axis=X))
    return {"RUN": [run], "BRANCH": [branch]}


def hinge() -> dict[str, list[int]]:
    """Two leaves of 60 x 35 x 4 with three knuckles of d 12, and a pin of d 6."""

    def leaf(side: int, *knuckles: tuple[float, float]) -> int:
        solid = occ.addBox(min(7 * side, 35 * side), 0, -2, 28, 60, 4)
        for start, end in knuckles:
            bridge = occ.addBox(min(0, 7 * side), start, -2, 7, end - start, 4)
            solid = fuse(solid, bridge, cylinder(6, start, end, axis=Y))
        holes = [cylinder(2.5, -2, 2, (22.0 * side, y, 0)) for y in (15, 45)]
        return cut(solid, cylinder(3, 0, 60, axis=Y), *holes)

    return {
        "LEFT": [leaf(-1, (0, 19.5), (40.5, 60))],
        "RIGHT": [leaf(1, (20.5, 39.5))],
        "PIN": [cylinder(3, -2, 62, axis=Y)],
    }


def gears() -> dict[str, list[int]]:
    """Spur gears of module 3 with 15 and 20 teeth, 12 wide, with backlash."""
    pinion, wheel = cut(gear(15), cylinder(8, 0, 12)), cut(gear(20), cylinder(10, 0, 12))
    occ.rotate([(3, wheel)], 0, 0, 0, 0, 0, 1, np.pi / 20)
    occ.translate([(3, wheel)], 52.8, 0, 0)
    return {"PINION": [pinion], "WHEEL": [wheel]}


def gear(teeth: int, module: float = 3.0, width: float = 12.0) -> int:
    """An involute spur gear on the z axis with a tooth on the x axis."""
    pitch, pressure = module * teeth / 2, np.deg2rad(20)
    root, base, tip = pitch - 1.25 * module, pitch * np.cos(pressure), pitch + module
    radii = np.concatenate([[root], np.linspace(max(base, root), tip, 5)])
    roll = np.arccos(np.minimum(base / radii, 1))
    half = np.pi / 2 / teeth - 0.1 / pitch + np.tan(pressure) - pressure - (np.tan(roll) - roll)
    curves, first, last = [], 0, 0
    for angle in 2 * np.pi / teeth * np.arange(teeth):
        rise, fall = (
            [occ.addPoint(*each, 0) for each in polar(radii, angle + sign * half)]
            for sign in (-1, 1)
        )
        if last:
            curves.append(occ.addLine(last, rise[0]))
        first, last = first or rise[0], fall[0]
        curves += [occ.addLine(*rise[:2]), occ.addSpline(rise[1:]), occ.addLine(rise[-1], fall[-1])]
        curves += [occ.addSpline(fall[:0:-1]), occ.addLine(fall[1], fall[0])]
    curves.append(occ.addLine(last, first))
    solid = occ.extrude([(2, occ.addPlaneSurface([occ.addCurveLoop(curves)]))], 0, 0, width)[1][1]
    occ.remove(occ.getEntities(0))  # the inner points of the splines
    return solid


def polar(radius: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Points (N, 2) of radii and angles."""
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


@dataclass(frozen=True)
class Assembly:
    """How an assembly is drawn, meshed and held."""

    draw: Callable[[], dict[str, list[int]]]  # solids by name
    materials: dict[str, str]
    size: float  # of hexes, mm
    tetrahedra: float  # finer size of tetrahedra, mm
    contacts: int  # expected
    edges: float = 1.0  # size of tetrahedra at the edges of contacts, of the size elsewhere
    held: dict[str, list[float]] = field(default_factory=dict)  # sets, and boxes around their faces

    @property
    def rigid(self) -> int:
        """Number of rigid motions."""
        return 0 if self.held else RIGID


ASSEMBLIES = {
    each.draw.__name__: each
    for each in (
        Assembly(pin_in_lug, {"LUG": "aluminium", "PIN": "steel"}, 3, 2, 2),
        Assembly(
            flanges, {"LOWER": "steel", "UPPER": "aluminium", "BOLT": "steel"}, 5, 6.5, 9, 0.5
        ),
        Assembly(plate_on_block, {"BLOCK": "aluminium", "PLATE": "steel"}, 4, 5, 1, 0.25),
        Assembly(bush_in_bore, {"BLOCK": "aluminium", "BUSH": "brass"}, 3, 2.1, 1),
        Assembly(laminate, {"BOTTOM": "steel", "CORE": "aluminium", "TOP": "brass"}, 4, 2.5, 2),
        Assembly(
            housing, {"HOUSING": "aluminium", "COVER": "aluminium", "SCREW": "steel"}, 4, 5, 9
        ),
        Assembly(
            nested_tubes, {"OUTER": "steel", "MIDDLE": "brass", "INNER": "aluminium"}, 3, 3.5, 2
        ),
        Assembly(pipe_tee, {"RUN": "steel", "BRANCH": "brass"}, 4, 3.8, 1, 0.4),
        Assembly(hinge, {"LEFT": "steel", "RIGHT": "steel", "PIN": "brass"}, 2.5, 2.6, 3),
        Assembly(
            gears,
            {"PINION": "steel", "WHEEL": "brass"},
            4,
            3,
            0,
            held={
                "PINION_hole_1": [-9, -9, -1, 9, 9, 13],
                "WHEEL_hole_1": [42, -11, -1, 64, 11, 13],
            },
        ),
    )
}


@contextmanager
def model(assembly: Assembly) -> Iterator[list[str]]:
    """Draw an assembly in Gmsh; gives the names of its solids."""
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        names = {tag: name for name, own in assembly.draw().items() for tag in own}
        occ.synchronize()
        yield [names[tag] for _, tag in gmsh.model.getEntities(3)]
    finally:
        gmsh.finalize()


def write(assembly: Assembly, step: Path) -> None:
    """Write a STEP file in which each solid is a product of its own, with its name."""
    with model(assembly) as names:
        gmsh.write(str(step))
    blank = r"'Open CASCADE STEP translator \S+ \d+\.(\d+)'"
    text = re.sub(blank, lambda found: f"'{names[int(found[1]) - 1]}'", step.read_text())
    step.write_text(text)
