"""Names, layers and groups of the faces of a solid in a STEP file.

Open CASCADE does not pass on the numbers of entities, so faces are identified by their vertices and
their kind of surface, then by their order. A solid that an assembly places elsewhere is identified
by the kinds and sizes of its faces.
"""

import re
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from polycube.io.step.text import SOLIDS, Exchange, exchange

SAME = 1e-6  # of the diagonal: closer vertices are equal
KINDS = {  # elementary surfaces: names in STEP and in gmsh
    "PLANE": "Plane",
    "CYLINDRICAL_SURFACE": "Cylinder",
    "CONICAL_SURFACE": "Cone",
    "SPHERICAL_SURFACE": "Sphere",
    "TOROIDAL_SURFACE": "Torus",
}
FACES = ("ADVANCED_FACE", "FACE_SURFACE")
SHELLS = ("CLOSED_SHELL", "OPEN_SHELL", "ORIENTED_CLOSED_SHELL")
WHOLES = (*SHELLS, *SOLIDS, "SHELL_BASED_SURFACE_MODEL", "ADVANCED_BREP_SHAPE_REPRESENTATION")
ASPECTS = ("GEOMETRIC_ITEM_SPECIFIC_USAGE", "ITEM_IDENTIFIED_REPRESENTATION_USAGE")
GROUP, LAYER = "APPLIED_GROUP_ASSIGNMENT", "PRESENTATION_LAYER_ASSIGNMENT"
STYLED = re.compile(r"STYLED_ITEM\('\d+',\(([^()]*)\),#(\d+)")
NUMBER = r"[-+]?\d+\.?\d*(?:E[-+]?\d+)?"


class Named(NamedTuple):
    """Names in a STEP file that belong to one solid, whose faces are numbered from 1."""

    solid: str  # name of the solid; empty if it has none
    faces: tuple[str, ...]  # name of each face; an empty string if it has none
    # numbers of the faces of each named shell, group, aspect or layer
    groups: dict[str, tuple[int, ...]]
    # pairs of faces whose common edges all have a name
    edges: dict[str, tuple[tuple[int, ...], ...]]


def named_faces(
    path: Path, kinds: Sequence[str], corners: Sequence[np.ndarray], by: str = "name"
) -> Named:
    """The names of a solid and of its faces in a STEP file.

    kinds : kind of surface of each face, as named by gmsh, in the order of Open CASCADE
    corners : the vertices (N, 3) around each face, in the unit of the file
    by : name: the names and groups of faces; layer or colour: the groups are those of this kind
    """
    file = exchange(path)
    solids = [n for n in file.entities if file.word(n) in SOLIDS]
    groups = _coloured(file) if by == "colour" else _groups(file, by == "layer")
    called = {n: file.name(n) if by == "name" else "" for n in file.entities if _is_face(file, n)}
    curves = [n for n in file.entities if file.word(n) == "EDGE_CURVE" and file.name(n)]
    if not groups and not any(called.values()) and not any(map(file.name, [*solids, *curves])):
        return Named("", ("",) * len(kinds), {}, {})
    entity = _identified(file, solids, list(called), kinds, corners)
    place = {n: k for k, n in enumerate(entity, start=1) if n}
    members = {name: sorted(place[n] for n in own if n in place) for name, own in groups.items()}
    owners = [s for s in solids if not set(entity).isdisjoint(_faces(file, [s]))]
    return Named(
        file.name(owners[0]) if len(owners) == 1 else "",
        tuple(called.get(n, "") for n in entity),
        {name: tuple(own) for name, own in members.items() if own},
        _edges(file, entity) if by == "name" and curves else {},
    )


def _edges(file: Exchange, faces: Sequence[str]) -> dict[str, tuple[tuple[int, ...], ...]]:
    """Pairs of faces by the name of the edges between them, if all of these have the same name."""
    sides: dict[str, tuple[int, ...]] = {}
    for number, face in enumerate(faces, start=1):
        for edge in _below(file, face, "EDGE_CURVE"):
            sides[edge] = (*sides.get(edge, ()), number)
    names: dict[tuple[int, ...], set[str]] = {}
    for edge, pair in sides.items():
        names.setdefault(pair, set()).add(file.name(edge))
    found: dict[str, tuple[tuple[int, ...], ...]] = {}
    for pair, own in names.items():
        name = own.pop() if len(own) == 1 and len(pair) == 2 else ""
        if name:
            found[name] = (*found.get(name, ()), pair)
    return found


def _groups(file: Exchange, layers: bool) -> dict[str, set[str]]:
    """Names of layers, or of groups and shells, with their faces; equal names are one group."""
    found: dict[str, set[str]] = {}
    for number in file.entities:
        word = file.word(number)
        if word not in ((LAYER,) if layers else (GROUP, *ASPECTS, *SHELLS)):
            continue
        named, items = number, [number] if word in SHELLS else file.references(number)
        if word in (GROUP, *ASPECTS) and items:
            named, items = items[0], items[1 if word == GROUP else 2 :]  # 1: a representation
        if name := file.name(named):
            found.setdefault(name, set()).update(_faces(file, items))
    return found


def _coloured(file: Exchange) -> dict[str, set[str]]:
    """The faces of each colour; that of a face has precedence over that of its solid."""
    styled = [STYLED.search(body) for body in file.entities.values() if "STYLED_ITEM(" in body]
    items = [(each[2], re.findall(r"#(\d+)", each[1])) for each in styled if each]
    colour: dict[str, str] = {}
    for item, styles in sorted(items, key=lambda each: _is_face(file, each[0])):
        if name := _colour(file, styles):
            colour |= dict.fromkeys(_faces(file, [item]), name)
    found: dict[str, set[str]] = {}
    for face, name in colour.items():
        found.setdefault(name, set()).add(face)
    return found


def _colour(file: Exchange, styles: Sequence[str]) -> str:
    """Name of the colour of surfaces in some styles, such as `colour_ff0000`; empty if none."""
    for number in _reached(styles, lambda n: file.references(n) * (file.word(n) != "CURVE_STYLE")):
        if file.word(number) == "COLOUR_RGB":
            parts = re.findall(NUMBER, file.body(number).partition(",")[2])
            return "colour_" + "".join(f"{round(255 * float(c)):02x}" for c in parts)
        if file.word(number) == "DRAUGHTING_PRE_DEFINED_COLOUR":
            return f"colour_{file.name(number)}"
    return ""


def _is_face(file: Exchange, number: str) -> bool:
    return file.word(number) in FACES


def _faces(file: Exchange, items: Iterable[str]) -> list[str]:
    """The faces among some entities and in the shells and solids among them, in order."""
    found = _reached(items, lambda n: file.references(n) * (file.word(n) in WHOLES))
    return [number for number in found if _is_face(file, number)]


def _below(file: Exchange, face: str, word: str) -> list[str]:
    """The entities with a keyword among the bounds of a face, their edges and vertices."""
    ends = {"EDGE_CURVE": 2}  # its third reference is the curve, the last one of a face the surface
    first = file.references(face)[:-1]
    found = _reached(first, lambda n: file.references(n)[: ends.get(file.word(n))])
    return [number for number in found if file.word(number) == word]


def _reached(start: Iterable[str], below: Callable[[str], list[str]]) -> Iterator[str]:
    """The entities that are reached from some entities, each once, in order."""
    waiting, seen = list(start)[::-1], set()
    while waiting:
        number = waiting.pop()
        if number not in seen:
            seen.add(number)
            yield number
            waiting += below(number)[::-1]


def _identified(
    file: Exchange,
    solids: Sequence[str],
    faces: Sequence[str],
    kinds: Sequence[str],
    corners: Sequence[np.ndarray],
) -> list[str]:
    """The entity of each face of Open CASCADE; empty if it is not known."""
    from scipy.spatial import cKDTree  # which takes longer to import than most files to read

    plain = [kind if kind in KINDS.values() else None for kind in kinds]
    points = np.reshape(np.concatenate(corners), (-1, 3))
    tree, near = cKDTree(points), SAME * _span(points)
    wanted = [(kind, _places(tree, own, near)) for kind, own in zip(plain, corners, strict=True)]
    groups = [_faces(file, [solid]) for solid in solids]
    loose = set(faces).difference(*groups)
    best, most = [""] * len(kinds), 0
    for own in [*groups, [n for n in faces if n in loose]]:
        vertices = [_vertices(file, n) for n in own]
        has = [KINDS.get(file.word((file.references(n) or [""])[-1])) for n in own]
        keys = [(kind, _places(tree, each, near)) for kind, each in zip(has, vertices, strict=True)]
        found = _matched(own, keys, wanted)
        number = len(found) - found.count("")
        known = set(found)
        left = [(n, kind) for n, kind in zip(own, has, strict=True) if n not in known]
        if [kind for _, kind in left] == [k for n, k in zip(found, plain, strict=True) if not n]:
            in_order = iter(left)  # such as a ball, which has no vertices
            found = [n or next(in_order)[0] for n in found]
        sizes = np.array([*map(_span, vertices)]), np.array([*map(_span, corners)])
        is_placed = has == plain and np.allclose(*sizes, 1e-4, near)
        if number > most or (is_placed and not any(best)):
            best, most = found, number
    return best


def _matched(
    entities: Sequence[str], keys: Sequence[Hashable], wanted: Sequence[Hashable]
) -> list[str]:
    """The entity with each wanted key; of several with one key, those in the same order."""
    left: dict[Hashable, list[str]] = {}
    for entity, key in zip(entities, keys, strict=True):
        left.setdefault(key, []).append(entity)
    count = Counter(wanted)
    each = {key: iter(own) for key, own in left.items() if len(own) == count[key]}
    return [next(each[key]) if key in each else "" for key in wanted]


def _span(points: np.ndarray) -> float:
    """A size of some points that a motion preserves."""
    return float(np.linalg.norm(points - points.mean(axis=0))) if len(points) else 0.0


def _vertices(file: Exchange, face: str) -> np.ndarray:
    """(N, 3) vertices of a face."""
    points = [file.body(n).partition(",")[2] for n in _below(file, face, "CARTESIAN_POINT")]
    found = [re.findall(NUMBER, point) for point in points]
    return np.array([point for point in found if len(point) == 3], np.float64).reshape(-1, 3)


def _places(tree: Any, points: np.ndarray, near: float) -> frozenset[int]:
    """The first points of the k-d tree at some places; -1 for a place where there is none."""
    points = np.reshape(points, (-1, 3))
    found = tree.query_ball_point(points[np.isfinite(points).all(axis=1)], near)
    return frozenset(min(own, default=-1) for own in found)
