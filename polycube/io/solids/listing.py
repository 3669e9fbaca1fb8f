"""List the solids of a CAD file, in its units."""

import json
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from polycube.errors import InputError
from polycube.io.access.reading import reading
from polycube.io.cad import check_complete, check_gmsh
from polycube.io.file_units import gmsh_lengths
from polycube.io.foreign.process import read_separately, unreadable
from polycube.io.solids.motions import Motion
from polycube.names import in_ascii

EFFORT = 5  # time limit, relative to that of one solid


@dataclass(frozen=True, eq=False)
class Solid:
    """A solid of a CAD file."""

    number: int  # value of `cad.solid`, from 1
    name: str  # unique name in the file, of letters, digits, - and _
    volume: float  # in the cubed unit of the file
    # number of the first solid that is identical up to a motion; its own number if none
    same_as: int
    motion: Motion | None = None  # motion from that solid to this one


def read_solids(path: Path) -> list[Solid]:
    """List the solids of a CAD file.

    Raises InputError if the file has no solid, or cannot be read.
    """
    with reading(path):
        check_complete(path)
        output, errors = read_separately("polycube.io.solids.worker", path, {}, EFFORT)
    if output is None:
        check_gmsh(errors)
        raise InputError(f"{path}: {unreadable(path, errors)}")
    rows = json.loads(output)
    if not rows:
        what = "the file contains no solid; export the part as a closed solid body"
        raise InputError(f"{path}: {what}")
    unit = gmsh_lengths(path)
    names = names_of([row["name"] for row in rows])
    return [
        Solid(number, name, row["volume"] / unit**3, row.get("same_as", number), _motion(row, unit))
        for number, (row, name) in enumerate(zip(rows, names, strict=True), start=1)
    ]


def _motion(row: dict[str, list], unit: float) -> Motion | None:
    if "same_as" not in row:
        return None
    translation = np.array(row["translation"]) / unit
    return Motion(np.array(row["rotation"]), translation, np.array(row["faces"]))


def names_of(given: Sequence[str]) -> list[str]:
    """A unique name for each solid, for folders and sets.

    given : names in the file; a repeated name gets the number of the solid, a missing name becomes
        `solid` and the number
    """
    plain = [re.sub("_+", "_", in_ascii(name)).strip("_-") or "solid" for name in given]
    count = Counter(name.lower() for name in plain)
    names = []
    for number, name in enumerate(plain, start=1):
        if count[name.lower()] > 1 or name == "solid":
            name = f"{name}_{number}"
            while name.lower() in count:
                name += "_"  # no name of the file ends like this
        names.append(name)
    return names
