"""Files of parts with their polycubes: numpy archives without pickled objects."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from polycube.diffusion.pairs.any_structure import Part
from polycube.diffusion.pairs.lattices import MOST_SLABS
from polycube.diffusion.pairs.meshed_parts import STYLE, check_cover
from polycube.diffusion.pairs.tessellation import Tessellation
from polycube.errors import InputError
from polycube.structure.lattice import OUTWARD
from polycube.structure.neighbourhoods import solid_genus
from polycube.types import Polycube

SUFFIX = ".npz"
REMEDY = "python -m polycube.make_pairs makes such files"
# name -> dimensions, where equal letters are equal lengths, and the kind of the numpy type
SHAPES = {
    "geometry": ("V 3", "f"),
    "places": ("V 3", "f"),
    "quads": ("Q 4", "i"),
    "axis": ("Q", "i"),
    "knot": ("Q", "i"),
    "occupancy": ("X Y Z", "b"),
    "x": ("X+1", "f"),
    "y": ("Y+1", "f"),
    "z": ("Z+1", "f"),
}
OFF = 1e-6  # of the learning frame: permitted distance of a position from the plane of its label


def write_part(path: Path, part: Part) -> None:
    """Write a part with its polycube; labels belong to quads of two triangles each."""
    surface, solid = part.surface, part.polycube
    np.savez_compressed(
        path,
        geometry=part.geometry,
        places=surface.vertices,
        quads=surface.quads,
        axis=surface.axis[::2],
        knot=surface.knot[::2],
        occupancy=solid.occupancy,
        x=solid.x,
        y=solid.y,
        z=solid.z,
    )


def read_part(path: Path) -> Part:
    """Read a part written by `write_part`; raises InputError with one sentence otherwise."""
    try:
        with np.load(path, allow_pickle=False) as file:
            found = {name: file[name] for name in SHAPES}
    except Exception:  # zip, zlib and numpy raise different errors
        raise InputError("this is not a file of a part", str(path), REMEDY) from None
    try:
        return _part(found)
    except ValueError as error:
        raise InputError(str(error), str(path), REMEDY) from None


def read_parts(folder: Path) -> list[Part]:
    """All parts of a folder, by name; raises InputError if there is none or one is damaged."""
    files = sorted(folder.glob(f"*{SUFFIX}"))
    if not files:
        raise InputError(f"there is no part (*{SUFFIX}) in the folder", str(folder), REMEDY)
    return [read_part(path) for path in files]


def _part(found: Mapping[str, np.ndarray]) -> Part:
    """The part in some arrays; raises ValueError if they are inconsistent."""
    _check_shapes(found)
    quads, axis, knot = found["quads"], found["axis"], found["knot"]
    knots = found["x"], found["y"], found["z"]
    solid = Polycube(found["occupancy"], *knots, (1, 1, 1), ("lattice",))
    genus = solid_genus(solid.occupancy)
    if genus is None:
        raise ValueError("the polycube is not one solid without voids")
    if max(solid.occupancy.shape) > MOST_SLABS:
        raise ValueError(f"the polycube has more than {MOST_SLABS} slabs along an axis")
    _check_range("quads", quads, len(found["geometry"]) - 1)
    _check_range("axis", axis, len(OUTWARD) - 1)
    for a, planes in enumerate(knots):
        own = axis // 2 == a
        _check_range("knot", knot[own], len(planes) - 1)
        at = found["places"][quads[own], a]
        if np.abs(at - planes[knot[own]][:, None]).max(initial=0) > OFF:
            raise ValueError("places are not on the planes of their labels")
    faces = quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    surface = Tessellation(found["places"], quads, faces, axis.repeat(2), knot.repeat(2))
    check_cover(surface, solid)
    return Part(found["geometry"], surface, solid, genus, STYLE)


def _check_shapes(found: Mapping[str, np.ndarray]) -> None:
    """Raise ValueError for an array of another shape or type, or with non-finite numbers."""
    sizes = {"3": 3, "4": 4}
    for name, (shape, kind) in SHAPES.items():
        array, letters = found[name], shape.split()
        for letter, size in zip(letters, array.shape, strict=False):
            sizes.setdefault(letter, sizes[letter[0]] + 1 if "+" in letter else size)
        wanted = tuple(sizes.get(letter) for letter in letters)
        if array.dtype.kind != kind or array.shape != wanted or not array.size:
            raise ValueError(f"{name} must have shape ({shape.replace(' ', ', ')}) and kind {kind}")
        if not np.isfinite(array).all():
            raise ValueError(f"{name} has values that are not finite")


def _check_range(name: str, values: np.ndarray, most: int) -> None:
    if values.min(initial=0) < 0 or values.max(initial=0) > most:
        raise ValueError(f"{name} must be from 0 to {most}")
