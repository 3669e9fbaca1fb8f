"""Named parts of the boundary: sides, holes, patch numbers, faces of a CAD model.

Names are derived from the geometry (`polycube.hexmesh.face_groups`), so a hex mesh of another
program has them as well. Exports, analyses and the report use these sets.
"""

import re
import unicodedata
from collections.abc import Mapping

import numpy as np

from polycube.hexmesh.connectivity import quad_sides
from polycube.hexmesh.face_groups import ENDS, ends_and_holes
from polycube.types import HexMesh, Spline

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
    owner, side = quad_sides(mesh)
    quad = np.full((len(mesh.hexes), 6), -1)
    quad[owner, side] = np.arange(len(owner))
    element, face = spline.sides.T
    return quad[spline.element_hex[element], face]


def cad_faces(mesh: HexMesh) -> np.ndarray:
    """(Q,) CAD face of each boundary quad; 0 if there is none."""
    return mesh.cad_face if len(mesh.cad_face) else np.zeros(len(mesh.quads), np.int64)


def listed(sets: Sets) -> str:
    """List the names in a sentence; of numbered names, the first and the last."""
    texts: list[str] = []
    numbered: dict[str, list[str]] = {}
    for name in sets:
        kind, _, number = name.rpartition("_")
        if kind in ("patch", "cad_face") and number.isdigit():
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
    """Whether a part can have a set of this name."""
    ends = "|".join(ENDS)
    return bool(re.fullmatch(rf"{ends}|hole_\d+|patch_\d+|cad_\w+", set_name(place)))
