"""An LS-DYNA deck for the free vibration modes of a spline in BEXT version 1.

Keywords and cards are those of the deck of the published rod, which was run with LS-DYNA in 2020.
The units are consistent: length unit of the part, kg, s; frequencies are in Hz.
"""

from __future__ import annotations

from pathlib import Path
from typing import TypedDict

from polycube.analysis.material import Material, material
from polycube.io.atomic import atomic_write
from polycube.types import Json
from polycube.units import METRES, resolved


def write_modal_deck(
    path: Path, bext: str, elastic: Material, units: str, modes: int, lumped: bool = False
) -> Path:
    """Write the deck for a file `bext` in the same folder; the modes include the six rigid ones.

    lumped : default of LS-DYNA: row sums of the mass matrix on the diagonal
    """
    metre = METRES[units]
    young, density = elastic.young * metre, elastic.density * metre**3
    mass = [] if lumped else ["*CONTROL_IMPLICIT_CONSISTENT_MASS", "1"]
    lines = [
        "*KEYWORD 500M",
        "*TITLE",
        "Free vibration modes",
        f"$ length {units}, mass kg, time s",
        "*INCLUDE_TRANSFORM",
        bext,
        "1,0,1,0,0",
        *[""] * 3,
        "*PART",
        "spline",
        "1,1,1",
        "*SECTION_SOLID",
        "1,201",
        "*MAT_ELASTIC",
        f"1,{density:.9g},{young:.9g},{elastic.poisson:.9g}",
        "*CONTROL_IMPLICIT_GENERAL",
        "1,1.",
        "*CONTROL_IMPLICIT_EIGENVALUE",
        str(modes),
        *mass,
        "*END",
    ]
    with atomic_write(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="ascii")
    return Path(path)


class DeckSettings(TypedDict):
    """Arguments of `write_modal_deck` without the files."""

    elastic: Material
    units: str
    modes: int
    lumped: bool


def settings_of(analysis: Json, of_file: str = "") -> DeckSettings:
    """Material, units, modes and mass from the options of an analysis; default: steel.

    of_file : length unit of the file of the part
    """
    return {
        "elastic": material(analysis.get("material", "steel")),
        "units": resolved(analysis.get("units"), of_file),
        "modes": analysis.get("modes", 20),
        "lumped": analysis.get("mass") == "lumped",
    }
