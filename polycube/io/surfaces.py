"""Read a surface from a file or an example, and check that it bounds one solid.

The surface of a point cloud is reconstructed. Coordinates are not changed: no scaling,
translation or rotation.
"""

import logging
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from polycube.errors import InputError
from polycube.examples.parts import example
from polycube.io.access.reading import reading
from polycube.io.cad import SUFFIXES, Cad, read_cad
from polycube.io.clouds import reading as clouds
from polycube.io.clouds.reading import is_cloud, read_cloud
from polycube.io.file_units import file_unit
from polycube.io.foreign.process import parsed
from polycube.io.polygons.division import Soup
from polycube.io.polygons.ply import read_ply
from polycube.io.polygons.text import read_obj, read_off
from polycube.io.stl import read_stl
from polycube.surface.clouds.options import Points
from polycube.surface.clouds.points import without_open3d
from polycube.surface.clouds.reconstruction import Reconstruction, reconstruct
from polycube.surface.repair.clean import clean, crossings
from polycube.surface.repair.repair import LEVELS, Repair, finite, repaired
from polycube.types import TriMesh

logger = logging.getLogger(__name__)

EXAMPLE = "example:"
LOOK = "preflight=true lists all defects, preflight=FILE.vtp writes their places"


class Reading(NamedTuple):
    """A surface that was read."""

    surface: TriMesh
    warnings: list[str]
    repair: Repair | None = None  # changes, if a repair was requested
    points: Reconstruction | None = None  # the reconstruction, for a file of points


def read_surface(
    path: str | Path, cad: Cad | None = None, points: Points | None = None
) -> tuple[TriMesh, list[str]]:
    """Closed, oriented surface of one solid, and a list of changes and warnings.

    `path` is a file or `example:NAME`; `cad` are the options for CAD files, `points` those for
    point clouds. Raises InputError with one sentence for an unusable surface.
    """
    read = read_repaired(path, cad, LEVELS[0], points)
    return read.surface, read.warnings


def read_repaired(
    path: str | Path, cad: Cad | None, level: str, points: Points | None = None
) -> Reading:
    """Like `read_surface`, after a repair with a level of `repair.LEVELS`; None if it is off."""
    if str(path).startswith(EXAMPLE):
        return Reading(example(str(path).removeprefix(EXAMPLE)), [])
    path = Path(path)
    repair = made = None
    with reading(path):
        if is_cad(path) and level != LEVELS[0]:
            raise InputError("repair works on triangles, not on CAD solids; export the part as STL")
        if is_cad(path):
            surface, warnings = read_cad(path, cad or Cad())
        else:
            soup, made = _soup(path, points)
            if level == LEVELS[0]:
                surface, warnings = _cleaned(*soup[:2])
            else:
                surface, repair = repaired(*soup[:2], level)
                warnings = [repair.sentence(), *crossings(surface)]
            warnings = [*soup.notes, *warnings]
        surface = replace(surface, unit=file_unit(path))
    logger.info("%s: %d vertices, %d faces", path, len(surface.vertices), len(surface.faces))
    if made is not None:
        warnings = [made.sentence(), *warnings]
    return Reading(surface, warnings, repair, made)


def read_soup(path: Path, points: Points | None = None) -> Soup:
    """Vertices and faces of a file that is not a CAD file, unchanged; raises InputError."""
    with reading(path):
        return _soup(path, points)[0]


def is_cad(path: Path) -> bool:
    """Whether the suffix is that of a CAD file."""
    return path.suffix.lower() in SUFFIXES and not path.is_dir()


def _cleaned(vertices: np.ndarray, faces: np.ndarray) -> tuple[TriMesh, list[str]]:
    """Like `clean`; the error message names the repair that would help."""
    try:
        return clean(vertices, faces)
    except InputError as error:
        raise InputError(f"{error}{_remedy(vertices, faces)}") from error.__cause__


def _remedy(vertices: np.ndarray, faces: np.ndarray) -> str:
    """The remedy for an error message, if there is one."""
    try:
        finite(vertices, faces)
    except InputError:
        return ""
    for level in LEVELS[1:]:
        try:
            repaired(vertices, faces, level)
        except InputError:
            continue
        return f"; repair={level} makes it usable, {LOOK}"
    return f"; {LOOK}"


def _soup(path: Path, points: Points | None) -> tuple[Soup, Reconstruction | None]:
    """Vertices and faces, and how they were made of points."""
    if is_cloud(path):
        surface, made = reconstruct(read_cloud(path), points or Points())
        return Soup(surface.vertices, surface.faces), made
    suffix = path.suffix.lower()
    if suffix not in READERS:
        known = ", ".join(KNOWN)
        raise InputError(f"unknown kind of file {suffix!r}; can read {known} and example:NAME")
    return READERS[suffix](path), None


def _read_glb(path: Path) -> Soup:
    found = parsed(path, "trimesh")
    return Soup(found["vertices"], found["faces"])


def _read_fbx(path: Path) -> Soup:
    found = parsed(path, "open3d")
    if "missing" in found:
        raise without_open3d("FBX needs", found["missing"])
    if not len(found["faces"]):
        raise InputError("not a complete FBX file, or a file without triangles")
    return Soup(found["vertices"], found["faces"])


READERS: dict[str, Callable[[Path], Soup]] = {
    ".stl": read_stl, ".obj": read_obj, ".ply": read_ply, ".off": read_off,
    ".glb": _read_glb, ".fbx": _read_fbx,
}  # fmt: skip
KNOWN = (*dict.fromkeys((*READERS, *clouds.READERS)), *SUFFIXES)  # suffixes of readable files
