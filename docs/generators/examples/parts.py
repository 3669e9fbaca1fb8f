"""Example parts, similar to those of the paper, lengths in mm."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from docs.generators.examples.contour import contour
from docs.generators.examples.implicit import (
    Field,
    box,
    capsule,
    cylinder,
    difference,
    intersection,
    sphere,
    torus,
    turned,
    union,
)
from polycube.types import TriMesh

X, Y, Z = range(3)


def surface_of(name: str) -> TriMesh:
    """Closed, smooth, regular triangulation of a part."""
    make, half, cell = PARTS[name]
    reach = np.add(half, 1.5 * cell)
    return contour(make(), -reach, reach, cell)


def _dice() -> Field:
    """Cube of 40 with spots: opposite sides have the sum seven."""
    patterns = {
        1: [(0, 0)],
        2: [(-1, -1), (1, 1)],
        3: [(-1, -1), (0, 0), (1, 1)],
        4: [(-1, -1), (-1, 1), (1, -1), (1, 1)],
        5: [(-1, -1), (-1, 1), (0, 0), (1, -1), (1, 1)],
        6: [(-1, -1), (-1, 0), (-1, 1), (1, -1), (1, 0), (1, 1)],
    }
    spots = []
    for axis in range(3):
        for side, number in ((1, axis + 1), (-1, 6 - axis)):
            for u, v in patterns[number]:
                center = np.roll([side * 24.0, 10.5 * u, 10.5 * v], axis)
                spots.append(sphere(center, 5.5))
    return difference(box((0, 0, 0), (20, 20, 20), 4), *spots, blend=1.5)


def _ring() -> Field:
    """Signet ring around the y axis."""
    band = cylinder((0, 0, 0), Y, 14, 5, 1.5)
    seat = box((0, 0, 13), (7, 6, 3.5), 1.5)
    return difference(union(band, seat, blend=3), cylinder((0, 0, 0), Y, 10, 20), blend=1.5)


def _rod() -> Field:
    """Rod with a cube at one end and an eye around the z axis at the other."""
    block = box((-45, 0, 0), (13, 13, 13), 3)
    shank = capsule((-45, 0, 0), (45, 0, 0), 8, 6.5)
    eye = cylinder((42, 0, 0), Z, 17, 11, 2.5)
    return difference(union(block, shank, eye, blend=6), cylinder((42, 0, 0), Z, 7.5, 40), blend=2)


def _lantern() -> Field:
    """Lamp housing: open below, a flared roof, and an eye around the y axis at the top."""
    body = box((0, 0, -18), (17, 17, 24), 3)
    roof = intersection(
        turned(Z, [(0, 26), (10, 21), (20, 12), (30, 6)]), box((0, 0, 15), (23, 23, 12), 2), blend=3
    )
    eye = cylinder((0, 0, 32), Y, 10, 6, 2)
    return difference(
        union(body, roof, eye, blend=4),
        cylinder((0, 0, 33), Y, 4.5, 40),
        box((0, 0, -34), (10, 10, 22), 3),
        blend=1.5,
    )


def _eight() -> Field:
    """Figure eight: two rings in a row."""
    return union(torus((-16, 0, 0), Z, 14, 5.5), torus((16, 0, 0), Z, 14, 5.5), blend=8)


def _key() -> Field:
    """Key: bow, collars, shaft and bit."""
    return union(
        torus((-26, 0, 0), Z, 10, 3.2),
        capsule((-15, 0, 0), (38, 0, 0), 3, 2.6),
        capsule((-8, 0, 0), (-8, 0, 0.1), 4.4, 4.4),
        box((32, 6, 0), (4, 6.5, 2), 1),
        blend=3,
    )


def _barrel() -> Field:
    """Barrel with a blind hole from above."""
    staves = [(z, 33 - 7 * (z / 38) ** 2) for z in np.linspace(-50, 50, 41)]
    hull = intersection(turned(Z, staves), box((0, 0, 0), (50, 50, 36)), blend=4)
    return difference(hull, cylinder((0, 0, 24), Z, 18, 34, 4), blend=2)


def _cup() -> Field:
    """Cup without a floor, with a handle."""
    wall = intersection(turned(Z, [(-60, 20), (60, 32)]), box((0, 0, 0), (60, 60, 28)), blend=3)
    handle = intersection(torus((25, 0, 1), Y, 16, 4.5), box((35, 0, 0), (17, 20, 40)), blend=2)
    return difference(union(wall, handle, blend=4), cylinder((0, 0, 0), Z, 15, 60), blend=2.5)


# function, half the bounding box, and width of a face
PARTS: dict[str, tuple[Callable[[], Field], tuple[float, float, float], float]] = {
    "dice": (_dice, (20, 20, 20), 2.4),
    "ring": (_ring, (15, 7, 17), 1.3),
    "rod": (_rod, (60, 18, 14), 3.0),
    "lantern": (_lantern, (25, 25, 43), 3.0),
    "eight": (_eight, (36, 20, 7), 2.3),
    "key": (_key, (42, 14, 6), 1.33),
    "barrel": (_barrel, (34, 34, 37), 4.0),
    "cup": (_cup, (48, 32, 29), 3.5),
}
