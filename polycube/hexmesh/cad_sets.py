"""The sets of CAD faces: ends, holes, names and groups of the file, and each face alone."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from polycube.hexmesh.face_groups import cad_ends_and_holes
from polycube.names import plain, unique
from polycube.types import TriMesh


@dataclass(frozen=True, eq=False)
class CadSets:
    """The sets of CAD faces of a surface; their names are unique without regard to case.

    Parameters
    ----------
    numbers : numbers of the CAD faces of each set
    alone : set of each CAD face alone, `cad_face_1` etc.
    edges : pairs of CAD faces on both sides of each named edge, by the name of its set of nodes
    names : names of sets that come from the file, with the name there
    """

    numbers: dict[str, np.ndarray]
    alone: dict[int, str]
    edges: dict[str, tuple[tuple[int, ...], ...]]
    names: dict[str, str]

    def renamed(self) -> list[str]:
        """A sentence on the sets with a number, because another one has their name."""
        pairs = [f"{name!r} is {new}" for new, name in self.names.items() if "__" in new]
        pairs += [f"face {n} is {new}" for n, new in self.alone.items() if "__" in new]
        if not pairs:
            return []
        more = f" and {len(pairs) - 5} more" if len(pairs) > 5 else ""
        return [
            f"names that differ only in case or signs got numbers: {', '.join(pairs[:5])}{more}"
        ]


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
