"""Information of a STEP file that is not passed on with its shapes: length unit, names of faces."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from polycube.units import METRES

STEP = (".step", ".stp")
MILLIMETRES = {name: 1000 * metres for name, metres in METRES.items()}
PREFIX = {"": 1000.0, ".MILLI.": 1.0, ".CENTI.": 10.0, ".MICRO.": 1e-3}  # of a metre, in mm
SAME = 1e-6  # of the diagonal: closer vertices are equal
ADVANCED_FACE = r"ADVANCED_FACE\s*\(\s*'([^']*)'\s*,\s*\(([^)]*)\)\s*,\s*#(\d+)"
KINDS = {  # elementary surfaces: names in STEP and in gmsh
    "PLANE": "Plane",
    "CYLINDRICAL_SURFACE": "Cylinder",
    "CONICAL_SURFACE": "Cone",
    "SPHERICAL_SURFACE": "Sphere",
    "TOROIDAL_SURFACE": "Torus",
}


def file_unit(path: Path) -> str:
    """Length unit declared in a STEP file, a key of MILLIMETRES; mm for other files."""
    if path.suffix.lower() not in STEP:
        return "mm"
    text = re.sub(r"\s+", "", _data(path).upper())
    entity = _entities(text)
    context = re.search(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\(\(([#\d,]*)\)", text)
    units = [entity.get(n, "") for n in re.findall(r"\d+", context[1] if context else "")]
    length = next((unit for unit in units if "LENGTH_UNIT()" in unit), "")
    size = _millimetres(length, entity)
    known = [name for name, value in MILLIMETRES.items() if np.isclose(value, size)]
    return known[0] if known else "mm"


def _millimetres(unit: str, entity: dict[str, str]) -> float:
    """Millimetres of a unit: an SI unit, or a multiple of another unit."""
    if based := re.search(r"CONVERSION_BASED_UNIT\('[^']*',#(\d+)\)", unit):
        measure = entity.get(based[1], "")
        factor = re.search(r"LENGTH_MEASURE\(([-+.\dE]+)\),#(\d+)", measure)
        return float(factor[1]) * _millimetres(entity.get(factor[2], ""), entity) if factor else 1.0
    metre = re.search(r"SI_UNIT\((\.\w+\.|\$),\.METRE\.\)", unit)
    return PREFIX.get(metre[1].replace("$", ""), 1.0) if metre else 1.0


def face_names(path: Path, kinds: Sequence[str], corners: Sequence[np.ndarray]) -> tuple[str, ...]:
    """Names of the faces of a solid in a STEP file; "" for a face without a name, or another file.

    kinds : kind of surface of each face, as named by gmsh
    corners : the vertices (N, 3) around each face, in the unit of the file

    Faces are identified by their vertices; the name is "" if faces of different names have the same
    vertices.
    """
    if path.suffix.lower() not in STEP:
        return ("",) * len(kinds)
    entity = _entities(_data(path))
    named = [
        (face[1].strip(), KINDS.get(_word(entity.get(face[3], ""))), _points(face[2], entity))
        for body in entity.values()
        if (face := re.match(ADVANCED_FACE, body, re.DOTALL)) and face[1].strip()
    ]
    if not any(len(points) for _, _, points in named):
        return ("",) * len(kinds)
    tree = cKDTree(np.concatenate([points for _, _, points in named]))
    near = SAME * np.linalg.norm(np.ptp(tree.data, axis=0))
    called: dict[tuple[str | None, frozenset], set[str]] = {}
    for name, kind, points in named:
        called.setdefault((kind, _places(tree, points, near)), set()).add(name)
    found = []
    for kind, points in zip(kinds, corners, strict=True):
        plain = kind if kind in KINDS.values() else None
        names = called.get((plain, _places(tree, points, near)), set())
        found.append(names.pop() if len(names) == 1 else "")
    return tuple(found)


def _data(path: Path) -> str:
    """The text of a file, without what follows its end."""
    return path.read_text(errors="replace").partition("END-ISO-10303-21;")[0]


def _entities(text: str) -> dict[str, str]:
    """Text of each entity by its number; in one pass, also if there are no ends."""
    found = (re.match(r"\s*#(\d+)\s*=\s*", part) for part in text.split(";")[:-1])
    parts = zip(text.split(";"), found, strict=False)
    return {begin[1]: part[begin.end() :] for part, begin in parts if begin}


def _word(body: str) -> str:
    return body.partition("(")[0].strip()


def _references(body: str) -> list[str]:
    return re.findall(r"#(\d+)", body)


def _points(body: str, entity: dict[str, str]) -> np.ndarray:
    """(N, 3) vertices of an entity, or of a list of references."""
    waiting, seen, found = [body], set(), []
    while waiting:
        body = waiting.pop()
        word, below = _word(body), _references(body)
        if word == "CARTESIAN_POINT":
            found.append(re.findall(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?", body)[-3:])
        elif word == "EDGE_CURVE":
            below = below[:2]  # the third is the curve
        new = [number for number in below if number not in seen]
        seen.update(new)
        waiting += [entity.get(number, "") for number in new]
    points = np.array([point for point in found if len(point) == 3], np.float64).reshape(-1, 3)
    return points[np.isfinite(points).all(axis=1)]


def _places(tree: cKDTree, points: np.ndarray, near: float) -> frozenset[int]:
    """The numbers of the points in the tree; -1 for points that are not in it."""
    off, number = tree.query(np.reshape(points, (-1, 3)))
    return frozenset(np.where(off <= near, number, -1).tolist())
