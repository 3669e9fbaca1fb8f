"""CAD parts for the pictures of the theory, drawn by Gmsh's kernel OpenCASCADE, in mm."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import gmsh

occ = gmsh.model.occ


def cut(solid: int, *tools: int) -> int:
    """A solid without the tools."""
    return occ.cut([(3, solid)], [(3, tool) for tool in tools])[0][0][1]


def fuse(solid: int, *others: int) -> int:
    """Solids as one."""
    return occ.fuse([(3, solid)], [(3, other) for other in others])[0][0][1]


def valve_block() -> int:
    """A block with holes along three axes, two of which meet, a slot and a boss."""
    block = fuse(occ.addBox(0, 0, 0, 60, 40, 30), occ.addCylinder(60, 20, 15, 14, 0, 0, 11))
    along = occ.addCylinder(30, 20, 15, 50, 0, 0, 6)
    upwards = occ.addCylinder(30, 20, 15, 0, 0, 20, 7)
    across = occ.addCylinder(14, -1, 10, 0, 42, 0, 4)
    return cut(block, along, upwards, across, occ.addBox(-1, 12, 20, 20, 16, 12))


def plate() -> int:
    """A plate with four small holes and a large one."""
    small = [occ.addCylinder(x, y, 0, 0, 0, 8, 4) for x in (10, 70) for y in (10, 40)]
    return cut(occ.addBox(0, 0, 0, 80, 50, 8), occ.addCylinder(40, 25, 0, 0, 0, 8, 13), *small)


def shaft() -> int:
    """A stepped shaft with a bore."""
    steps = [(0, 20, 12), (20, 12, 20), (32, 30, 14), (62, 18, 9)]
    solids = [occ.addCylinder(x, 0, 0, length, 0, 0, radius) for x, length, radius in steps]
    return cut(fuse(*solids), occ.addCylinder(0, 0, 0, 40, 0, 0, 5))


def sheet() -> int:
    """A bent sheet with a hole in each leg."""
    outer = fuse(occ.addBox(0, 0, 0, 50, 40, 4), occ.addBox(0, 0, 0, 4, 40, 36))
    edges = [tag for _, tag in occ.getEntities(1) if _is_bend(tag)]
    bent = occ.fillet([outer], edges, [_radius(tag) for tag in edges])[0][1]
    holes = occ.addCylinder(32, 20, -1, 0, 0, 6, 7), occ.addCylinder(-1, 20, 24, 6, 0, 0, 5)
    return cut(bent, *holes)


def _is_bend(edge: int) -> bool:
    """Whether an edge along y is an edge of the bend of the sheet."""
    x, _, z = occ.getCenterOfMass(1, edge)
    return max(abs(x - z), min(abs(x), abs(x - 4))) < 1e-6


def _radius(edge: int) -> float:
    return 7 if occ.getCenterOfMass(1, edge)[0] < 1 else 3


def elbow() -> int:
    """A pipe with an elbow of 90 degrees."""
    ring = [occ.addDisk(0, 0, 0, radius, radius) for radius in (9, 6)]
    section = occ.cut([(2, ring[0])], [(2, ring[1])])[0]
    straight = occ.extrude(section, 0, 0, 30)
    top = [each for each in straight if each[0] == 2 and occ.getCenterOfMass(*each)[2] > 29.9]
    curved = occ.revolve(top, 28, 0, 30, 0, 1, 0, math.pi / 2)
    return fuse(*(tag for dim, tag in [*straight, *curved] if dim == 3))


def bracket() -> int:
    """An L-bracket with a gusset and four holes."""
    points = [occ.addPoint(*at) for at in ((12, 20, 10), (47, 20, 10), (12, 20, 45))]
    ends = zip(points, [*points[1:], points[0]], strict=True)
    outline = occ.addCurveLoop([occ.addLine(*pair) for pair in ends])
    gusset = occ.extrude([(2, occ.addPlaneSurface([outline]))], 0, 10, 0)[1][1]
    solid = fuse(occ.addBox(0, 0, 0, 80, 50, 10), occ.addBox(0, 0, 10, 12, 50, 45), gusset)
    floor = [occ.addCylinder(62, y, 0, 0, 0, 10, 4.5) for y in (12, 38)]
    return cut(solid, *floor, *(occ.addCylinder(0, y, 42, 12, 0, 0, 4) for y in (10, 40)))


def write(draw: Callable[[], int], path: Path) -> Path:
    """Write the part that a function draws as a STEP file."""
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add(path.stem)
        draw()
        occ.synchronize()
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path
