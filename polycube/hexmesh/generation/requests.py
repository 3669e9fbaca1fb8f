"""Requested numbers of hexes at faces of the part.

An entry of `meshing.at` names a set of the surface and gives the number of edges around its rim
(`around`), the number of hexes through the wall below it (`through`), or the largest edge length of
the hexes on it (`size`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from polycube.hexmesh.generation.sizing import LENGTH, length
from polycube.types import TriMesh
from polycube.types.options import require

LEAST = {"around": 3, "through": 1}
MOST = 1000  # largest number of hexes through a wall or edges around a rim
LONGER = 1.1  # of the requested length: longer edges do not meet the request


@dataclass(frozen=True)
class Request:
    """An entry of `meshing.at`."""

    at: str  # name of a set, such as cad_face_7 or hole_1
    kind: str  # "around", "through" or "size"
    # number of hexes or edges; or a length in model units or as a share of the diagonal
    value: float | str

    def wanted(self, surface: TriMesh) -> float:
        """The requested number, or length in model units."""
        from polycube.surface.measures import diagonal

        return length(self.value, diagonal(surface)) if self.kind == "size" else float(self.value)

    def is_met(self, surface: TriMesh, reached: float | None) -> bool:
        """Whether a number of hexes, or an edge length, meets the request."""
        if reached is None:
            return False
        if self.kind == "size":
            return reached <= LONGER * self.wanted(surface)
        return reached >= self.wanted(surface)


def requests_of(entries: object) -> list[Request]:
    """Read the entries of `meshing.at`.

    Raises ValueError unless it is a list of {at: NAME, around: 16}, {at: NAME, through: 3} or {at:
    NAME, size: 1%}.
    """
    if not isinstance(entries, Sequence) or isinstance(entries, str):
        raise ValueError(f"at must be a list such as [{{at: hole_1, around: 16}}]; got {entries!r}")
    return [_request_of(entry) for entry in entries]


def _request_of(entry: object) -> Request:
    from polycube.hexmesh.named_sets import kind_of, may_name

    keys = set(entry) - {"at"} if isinstance(entry, Mapping) else set()
    if not isinstance(entry, Mapping) or "at" not in entry or len(keys) != 1:
        known = "{at: NAME, around: 16}, {at: NAME, through: 3} or {at: NAME, size: 1%}"
        raise ValueError(f"an entry of at is {known}; got {entry!r}")
    name, kind = entry["at"], str(*keys)
    if not isinstance(name, str) or not may_name(name) or kind_of(name) in ("patch", ""):
        known = "an end (x_min to z_max), a hole (hole_1) or a CAD face (cad_face_1, cad_NAME)"
        raise ValueError(f"an entry of at must name {known}; got {name!r}")
    value = entry[kind]
    if kind == "size":
        require(f"the size at {name}", LENGTH, value)
    elif kind not in LEAST:
        what = f"an entry of at must have around, through or size; got {kind!r} at {name}"
        raise ValueError(what)
    elif type(value) is not int or not LEAST[kind] <= value <= MOST:
        what = f"{kind} at {name} must be a whole number from {LEAST[kind]} to {MOST}"
        raise ValueError(f"{what}; got {value!r}")
    return Request(name, kind, value)
