"""What is removed from a CAD solid, and sentences about it."""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from polycube.errors import InputError
from polycube.types import Json
from polycube.types.checks import is_number, is_whole
from polycube.units import MILLIMETRES

LENGTH = re.compile(r"\s*(\d+\.?\d*|\.\d+)\s*([a-z]+)\s*")
SIZES = {"hole": "diameter", "fillet": "radius"}  # what the size of a feature is


@dataclass(frozen=True)
class Remove:
    """Features that are removed from a CAD solid.

    holes : largest diameter, in the unit of the file or with a unit, such as "3mm"; None: no hole
    fillets : largest radius, likewise
    faces : numbers of CAD faces, and names of faces and groups
    """

    holes: float | str | None = None
    fillets: float | str | None = None
    faces: Sequence[int | str] = ()

    def __post_init__(self) -> None:
        for name in ("holes", "fillets"):
            size = getattr(self, name)
            if size is not None and not 0 < length(size, "mm") < math.inf:
                what = f"it must be a positive length, such as 3, 3mm or 0.1in; got {size!r}"
                raise InputError(what, f"cad.remove.{name}")
        given = () if self.faces is None else self.faces
        faces = tuple(given) if isinstance(given, list | tuple) else (given,)
        for face in faces:
            if not isinstance(face, str) and not is_whole(face, 1):
                what = f"it must be a list of names and of numbers from 1; got {face!r}"
                raise InputError(what, "cad.remove.faces")
        object.__setattr__(self, "faces", faces)

    def in_unit(self, unit: str, factor: float) -> dict[str, object]:
        """The options with lengths in a unit, times a factor; empty if nothing is removed."""
        sizes = {name: getattr(self, name) for name in ("holes", "fillets")}
        found = {name: size and factor * length(size, unit) for name, size in sizes.items()}
        return {**found, "faces": self.faces} if self != Remove() else {}

    def sentences(self, found: Json, unit: str) -> Iterator[str]:
        """What was removed, and what could not be; `found` as in `TriMesh.removed`."""
        rows, before, after = found["features"], found["volume_before"], found["volume_after"]
        for kind in SIZES:
            if getattr(self, f"{kind}s") and not any(row["kind"] == kind for row in rows):
                yield f"cad.remove.{kind}s={getattr(self, f'{kind}s')}: there is no such {kind}"
        if counts := ", ".join(_counted([row for row in rows if row["removed"]], unit)):
            change = f"{after:.6g} {unit}^3 ({100 * (after / before - 1):+.3g} %)"
            volume = f"the volume was {before:.6g} {unit}^3 and is {change}"
            yield f"cad.remove removed {counts}; {volume}"
        if kept := "; ".join(described(row, unit) for row in rows if not row["removed"]):
            yield f"Open CASCADE cannot remove some features, which are kept: {kept}"
        if merged := ", ".join(f"cad_face_{number}" for number in found["merged"]):
            yield f"after the removal, {merged} belong to other faces of the same surface"


def described(row: Json, unit: str) -> str:
    """A feature in words: kind, size, faces and place."""
    size = f" with a {SIZES[row['kind']]} of {row['size']:.4g} {unit}" if row["size"] else ""
    faces = ", ".join((*map(repr, row["names"]), *(f"cad_face_{n}" for n in row["faces"])))
    place = ", ".join(f"{value:.4g}" for value in row["place"])
    return f"{row['kind']}{size} ({faces}) at ({place})"


def _counted(rows: Sequence[Json], unit: str) -> Iterator[str]:
    for kind in (*SIZES, "detail"):
        own = [row for row in rows if row["kind"] == kind]
        sizes = sorted({f"{row['size']:.4g}" for row in own}, key=float)
        ends = " to ".join(sizes[:: len(sizes) - 1 or 1])
        size = f" with a {SIZES[kind]} of {ends} {unit}" if kind in SIZES else ""
        faces = len({face for row in own for face in row["faces"]})
        if own:
            yield f"{len(own)} {kind}{'s' * (len(own) > 1)}{size} ({faces} of the CAD faces)"


def length(value: object, unit: str) -> float:
    """A length in a unit: a number, or a text with its own unit; -1 for anything else."""
    if is_number(value):
        return float(value)  # type: ignore[arg-type]
    found = LENGTH.fullmatch(value) if isinstance(value, str) else None
    known = MILLIMETRES.get(found[2]) if found else None
    return float(found[1]) * known / MILLIMETRES[unit] if found and known else -1.0
