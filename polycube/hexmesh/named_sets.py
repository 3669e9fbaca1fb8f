"""Named parts of the boundary: sides, holes, patch numbers, faces of a CAD model.

Names are derived from the geometry (`polycube.hexmesh.face_groups`), so a hex mesh of another
program has them as well. Exports, analyses and the report use these sets.
"""

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from polycube.hexmesh.connectivity import on_faces
from polycube.hexmesh.face_groups import ENDS, cad_ends_and_holes, ends_and_holes
from polycube.names import plain, unique
from polycube.types import HexMesh, Spline, TriMesh

MOST_PATCHES = 500  # number of patches above which they get no names
Sets = Mapping[str, np.ndarray]  # numbers of boundary faces (N,) by name


def boundary_sets(mesh: HexMesh) -> dict[str, np.ndarray]:
    """Numbers of the boundary quads of each name: ends, holes, then `patch_n` for every patch."""
    return sets_of_quads(mesh.vertices, mesh.quads, mesh.patch)


def sets_of_quads(
    points: np.ndarray, quads: np.ndarray, patch: np.ndarray
) -> dict[str, np.ndarray]:
    """The same for a closed surface: quads (Q, 4) of points (N, 3), and the patch of each (Q,)."""
    return ends_and_holes(points, quads, patch) | patch_sets(patch)


def patch_sets(patch: np.ndarray) -> dict[str, np.ndarray]:
    """Numbers of the boundary quads of each patch (Q,), as `patch_0` etc.

    Empty if there are more than `MOST_PATCHES`, as in a lattice as fine as the hexes, which has a
    patch at every step.
    """
    if patch.max(initial=0) >= MOST_PATCHES:
        return {}
    return {f"patch_{n}": np.flatnonzero(patch == n) for n in np.unique(patch).tolist()}


def sets_of_spline(spline: Spline, mesh: HexMesh) -> dict[str, np.ndarray]:
    """Numbers of the sides (N,) of a spline that belong to the quads of each set of its mesh."""
    quad = quads_of_spline(spline, mesh)
    return {name: np.flatnonzero(np.isin(quad, own)) for name, own in mesh.sets.items()}


def quads_of_spline(spline: Spline, mesh: HexMesh) -> np.ndarray:
    """(S,) boundary quad of the mesh that belongs to each side of its spline."""
    element, face = spline.sides.T
    return on_faces(mesh, np.arange(len(mesh.quads)))[spline.element_hex[element], face]


def cad_faces(mesh: HexMesh) -> np.ndarray:
    """(Q,) CAD face of each boundary quad; 0 if there is none."""
    return mesh.cad_face if len(mesh.cad_face) else np.zeros(len(mesh.quads), np.int64)


def listed(sets: Sets) -> str:
    """List the names in a sentence; of numbered names, the first and the last."""
    texts: list[str] = []
    numbered: dict[str, list[str]] = {}
    for name in sets:
        kind, _, number = name.rpartition("_")
        if kind.endswith(("patch", "cad_face")) and number.isdigit():
            numbered.setdefault(kind, []).append(name)
        else:
            texts.append(name)
    texts += [f"{n[0]} to {n[-1]}" if len(n) > 1 else n[0] for n in numbered.values()]
    return ", ".join(texts)


def set_name(place: object) -> str:
    """The set that belongs to a place: the name itself, or `patch_7` for the number 7."""
    text = unicodedata.normalize("NFC", str(place))
    return f"patch_{int(text)}" if text.isdigit() else text


def kind_of(name: str) -> str:
    """Kind of set of a name: "direction", "hole", "cad_face" or "patch"."""
    if name in ENDS:
        return "direction"
    return "cad_face" if name.startswith("cad_") else name.rpartition("_")[0]


def may_name(place: object) -> bool:
    """Whether a part can have a set of this name, or an assembly, behind the name of a solid."""
    ends = "|".join(ENDS)
    return bool(re.fullmatch(rf"([\w-]+_)?({ends}|hole_\d+|patch_\d+|cad_\w+)", set_name(place)))


@dataclass(frozen=True, eq=False)
class CadSets:
    """The sets of CAD faces of a surface; their names are unique without regard to case."""

    numbers: dict[str, np.ndarray]  # numbers of the CAD faces of each set
    alone: dict[int, str]  # set of each CAD face alone, `cad_face_1` etc.
    # pairs of CAD faces on both sides of each named edge, by the name of its set of nodes
    edges: dict[str, tuple[tuple[int, ...], ...]]
    names: dict[str, str]  # names of sets that come from the file, with the name there

    def renamed(self) -> list[str]:
        """A sentence on the sets with a number, because another one has their name."""
        pairs = [f"{name!r} is {new}" for new, name in self.names.items() if "__" in new]
        pairs += [f"face {n} is {new}" for n, new in self.alone.items() if "__" in new]
        if not pairs:
            return []
        more = f" and {len(pairs) - 5} more" if len(pairs) > 5 else ""
        listed = f"{', '.join(pairs[:5])}{more}"
        return [f"names that differ only in case or signs got numbers: {listed}"]


@lru_cache(maxsize=2)
def cad_sets(surface: TriMesh) -> CadSets:
    """The sets of a CAD model.

    All faces with equal names in the file are one set. A name of the file has precedence over that
    of a face alone, and one that needs no change over one that does.
    """
    numbers = np.unique(surface.region).tolist()
    if not numbers:
        return CadSets({}, {}, {}, {})
    groups: dict[str, set[int]] = {}
    for number, name in enumerate(surface.region_names, start=1):
        if name:
            groups.setdefault(name, set()).add(number)
    for name, own in surface.region_groups.items():
        groups.setdefault(name, set()).update(own)
    groups = {name: own & set(numbers) for name, own in groups.items() if own & set(numbers)}
    given = sorted(groups, key=lambda name: plain(name) != name)
    wanted = [f"cad_{plain(name) or 'name'}" for name in given]
    called = unique([*wanted, *(f"cad_face_{number}" for number in numbers)])
    names = dict(zip(given, called, strict=False))
    alone = dict(zip(numbers, called[len(given) :], strict=True))
    sets = {names[name]: np.array(sorted(own)) for name, own in groups.items()}
    sets |= {name: np.array([number]) for number, name in alone.items()}
    edges = unique(f"edge_{plain(name) or 'name'}" for name in surface.region_edges)
    return CadSets(
        cad_ends_and_holes(surface) | sets,
        alone,
        dict(zip(edges, surface.region_edges.values(), strict=True)),
        {names[n]: n for n in groups} | dict(zip(edges, surface.region_edges, strict=True)),
    )


def face_set(surface: TriMesh, number: int) -> str:
    """Name of the set of a CAD face alone."""
    return cad_sets(surface).alone.get(number, f"cad_face_{number}")
