"""Triangles of one solid of a CAD file (STEP, IGES, BREP), in the units of the file.

Gmsh tessellates in a separate process. Here it is checked that no volume is lost; whether the
surface is closed is checked later as for any surface.
"""

import json
import logging
import re
from dataclasses import asdict, dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
from scipy.spatial import cKDTree

from polycube.errors import InputError
from polycube.io.cad_worker import OPEN, REFUSED, REMOVING, TESSELLATING, WAYS, names
from polycube.io.file_units import file_unit, gmsh_lengths, gmsh_unit
from polycube.io.foreign.process import Late, read_separately, unreadable
from polycube.io.removal.options import Remove, described
from polycube.io.step.text import STEP, exchange
from polycube.io.tessellation.threads import without_threads
from polycube.surface.measures import volume
from polycube.surface.repair.clean import clean
from polycube.types import TriMesh
from polycube.types.checks import options_of
from polycube.types.options import Count, Options, Such, condition, limits
from polycube.units import resolved

logger = logging.getLogger(__name__)

BREP = ".brep"
SUFFIXES = (*STEP, ".iges", ".igs", BREP)
ROOT = re.compile(rb"\n[+-]\d+ \d+\s*$")  # end of the shapes in a BREP file
SEGMENTS = 48
CONFORM: Final = "conform"
CONTACT: Final = "contact"
SEPARATE: Final = "separate"
ONE_OR_ALL = Such(condition(Count | None).holds, "a whole number, 1 or more, or all")
SHARES = (0.8, 0.15, 0.15)  # of the time limit for each of `WAYS`; the first has most triangles
EFFORT = 4  # the time limit for the removal of features, as a multiple of that of reading
FEWER = "remove fewer, such as only the smaller ones"
LOST = 0.05  # largest share of the volume that tessellation may lose
INSTALL = "pip install 'polycube[cad]'"


@dataclass(frozen=True)
class Cad(Options):
    """Options for reading CAD files."""

    group = "cad."

    solid: Annotated[int | None, ONE_OR_ALL] = None  # number of that to read of several, from 1
    segments: Annotated[int, limits(6)] = SEGMENTS  # triangle edges on a full turn of a round face
    groups: Literal["name", "colour", "layer", "none"] = "name"  # what names and groups the faces
    units: str | None = None  # length unit of the coordinates in the rest of the run
    threads: Literal["absorb", "keep"] = "absorb"  # whether screw threads become cylinders
    # how the meshes of touching solids are joined
    interfaces: Literal["conform", "tie", "contact", "separate"] = CONFORM
    friction: Annotated[float, limits(0)] = 0.0  # coefficient of friction of solids in contact
    materials: object = None  # of several solids, for the command line only
    remove: Remove = field(default_factory=Remove)  # features that are removed from the solid

    def __post_init__(self) -> None:
        object.__setattr__(self, "remove", options_of("cad.remove", Remove, self.remove))
        if self.solid == "all":
            what = "all solids of a file are meshed only by the command line, infer.py"
            raise InputError(what, "cad.solid", "give the number of one, from 1")
        if self.materials is not None:
            what = "materials by solid are for cad.solid=all and a file with several solids"
            raise InputError(what, "cad.materials", "give analysis.material")
        super().__post_init__()
        if self.friction and self.interfaces != CONTACT:
            what = "a coefficient of friction is for solids in contact"
            raise InputError(what, "cad.friction", f"use cad.interfaces={CONTACT}")


def read_cad(path: Path, options: Cad) -> tuple[TriMesh, list[str]]:
    """Closed, oriented surface of a solid with its CAD faces, and warnings; raises InputError."""
    if options.groups == "layer" and path.suffix.lower() not in STEP:
        raise InputError("cad.groups=layer is for STEP files; use name, colour or none")
    output, errors, way = _tessellated(path, options)
    found = _chosen(_arrays(path, output, errors), options.solid, gmsh_unit(path))
    unit = file_unit(path)
    factor = gmsh_lengths(path)
    surface, notes = clean(found["vertices"] / factor, found["faces"])
    surface = _regions(surface, found, path, options.groups, factor)
    size, stated = float(found["volume"]) / factor**3, unit or "an unknown unit"
    if "removed" in found:
        removed = {**json.loads(str(found["removed"])), "volume_before": size}
        surface, size = replace(surface, removed=removed), removed["volume_after"]
        notes += options.remove.sentences(removed, unit or "units")
        for row in removed["features"]:
            logger.info("%s: %s", "removed" if row["removed"] else "kept", described(row, unit))
    logger.info("%s: lengths in %s, volume %.6g", path, stated, size)
    if unit and resolved(options.units, unit) != unit:
        given = f"analysis.units={options.units}; use analysis.units=auto"
        notes.append(f"the file's lengths are in {unit}, but {given}")
    called = (surface.name, *surface.region_names, *surface.region_groups, *surface.region_edges)
    if path.suffix.lower() in STEP and not all(map(str.isascii, called)):
        if not exchange(path).is_unicode:
            notes.append("the file is not UTF-8; its names were read as ISO 8859-1")
    if gap := _gap(found, gmsh_unit(path)):
        notes.append(f"faces were sewn to a solid over {gap}")
    if way != WAYS[0]:
        note = f"there is no closed surface with cad.segments={options.segments}"
        notes.append(f"{note}; triangles on curved faces are larger")
    if found["segments"] < options.segments:
        fewer = f"{found['segments']} triangle edges on a full turn"
        why = f"cad.segments={options.segments}, because they would have too many triangles"
        notes.append(f"round faces have {fewer} instead of {why}")
    lost = 1 - volume(surface) / size
    if abs(lost) > LOST:
        note = f"the triangles enclose {100 * lost:.1f} % less than the solid"
        notes.append(f"{note}; increase cad.segments={options.segments}")
    if options.threads == "absorb":
        surface, replaced = without_threads(surface, unit or "")
        notes += replaced
    return surface, notes


def _regions(
    surface: TriMesh, found: dict[str, np.ndarray], path: Path, by: str, factor: float
) -> TriMesh:
    """The surface with the CAD face of each triangle, and the names of solid, faces and groups.

    Cleaning may have dropped and reoriented triangles, so their centres are compared.

    by : what names the faces, as `cad.groups`
    factor : length from Gmsh that is one unit of the surface
    """
    middles = found["vertices"][found["faces"]].mean(axis=1) / factor
    nearest = cKDTree(middles).query(surface.vertices[surface.faces].mean(axis=1))[1]
    kinds, named = found["face_kind"].tolist(), names(found, path, by)
    here = set(found["cad_face"].tolist())
    edges = {n: tuple(p for p in own if here.issuperset(p)) for n, own in named.edges.items()}
    return replace(
        surface,
        region=found["cad_face"][nearest],
        region_names=named.faces,
        region_shapes=tuple(re.sub(" [Ss]urface$", "", kind).lower() for kind in kinds),
        region_groups=named.groups,
        region_edges={name: own for name, own in edges.items() if own},
        name=named.solid,
    )


def _arrays(path: Path, output: bytes | None, errors: str) -> dict[str, np.ndarray]:
    """The arrays that `cad_worker` wrote; raises InputError with the reason if there are none."""
    if output is not None:
        return dict(np.load(BytesIO(output)))
    check_gmsh(errors)
    if REFUSED in errors:
        raise InputError(errors.rpartition(REFUSED)[2].strip())
    if REMOVING in errors and TESSELLATING not in errors:
        raise InputError("Open CASCADE failed to remove features", "cad.remove", FEWER)
    raise unreadable(path, errors)


def check_gmsh(errors: str) -> None:
    """Raise InputError if errors of a process say that Gmsh cannot be loaded."""
    if "import gmsh" in errors:
        reason = errors.strip().rpartition("\n")[2]
        raise InputError(f"CAD files need gmsh, which cannot be loaded ({reason}); {INSTALL}")


def _tessellated(path: Path, options: Cad) -> tuple[bytes | None, str, str]:
    """Output and errors of the first way of tessellation that ends with a closed surface.

    The last is the name of the way. Without a closed surface, the first open one is returned.
    """
    check_complete(path)
    effort = max(1.0, options.segments / SEGMENTS) ** 2  # relative number of triangles
    remove = options.remove.in_unit(resolved(options.units, file_unit(path)), gmsh_lengths(path))
    first, seconds = None, 0
    for way, share in zip(WAYS, SHARES, strict=True):
        request = {**asdict(options), "remove": remove, "way": way}
        times = share * effort + EFFORT * bool(remove)
        try:
            found = *read_separately("polycube.io.cad_worker", path, request, times), way
        except Late as late:
            if TESSELLATING not in late.errors:
                if REMOVING in late.errors:
                    what = f"the removal of features did not finish in {late.seconds} s"
                    raise InputError(what, "cad.remove", FEWER) from None
                raise
            seconds = max(seconds, late.seconds)
            continue
        if OPEN not in found[1]:
            return found
        first = first or found
    if first is not None:
        return first
    failed = f"could not be divided into triangles in {seconds} s, also not into larger ones"
    remedy = "simplify its spline surfaces, or export the part as STL"
    raise InputError(f"the file was read, but its faces {failed}", remedy=remedy)


def check_complete(path: Path) -> None:
    """Raise InputError for an incomplete BREP file, which Open CASCADE would read forever."""
    if path.suffix.lower() == BREP and not ROOT.search(path.read_bytes()[-200:]):
        raise InputError("the file is incomplete: its last line must give the number of the shape")


def _chosen(found: dict[str, np.ndarray], solid: int | None, unit: str) -> dict[str, np.ndarray]:
    """The arrays of the requested solid; raises InputError if the request is ambiguous."""
    volumes, boxes = found["volume"], found["box"]
    if not len(volumes):
        gap = _gap(found, unit) and f"; there are {_gap(found, unit)}"
        raise InputError(f"the file contains no solid{gap}; export the part as a closed solid body")
    if "faces" not in found:
        listed = ", ".join(
            f"{i + 1} (volume {v:.6g} {unit}3, from {_point(box[:3])} to {_point(box[3:])} {unit})"
            for i, (v, box) in enumerate(zip(volumes, boxes, strict=True))
        )
        missing = "" if solid is None else f"there is no solid {solid}; "
        what = f"{missing}the file contains {len(volumes)} solids: {listed}"
        raise InputError(what, remedy="use cad.solid=1, or cad.solid=all for a mesh of each")
    return {**found, "volume": volumes[(solid or 1) - 1]}


def _gap(found: dict[str, np.ndarray], unit: str) -> str:
    """Words about the largest gap between loose faces, if there are any."""
    if "gap" not in found or not found["gap"][0]:
        return ""
    where = _point(found["gap_place"])
    return f"gaps of up to {found['gap'][0]:.3g} {unit} between its faces, at {where} {unit}"


def _point(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.5g}" for value in values.round(6) + 0.0) + ")"
