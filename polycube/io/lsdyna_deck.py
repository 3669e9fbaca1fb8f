"""An LS-DYNA deck for the free vibration modes of a spline in BEXT version 1.

Keywords and cards are those of the deck of the published rod, which was run with LS-DYNA in 2020.
The units are consistent: length unit of the part, kg, s; frequencies are in Hz.
"""

from pathlib import Path

from polycube.analysis.problem import material
from polycube.io.atomic import write_parts
from polycube.types import Json
from polycube.units import METRES, resolved


def write_modal_deck(path: Path, bext: str, analysis: Json, of_file: str = "") -> Path:
    """Write the deck for a file `bext` in the same folder; the modes include the six rigid ones.

    analysis : its options `material`, `units`, `modes` and `mass` are used; default: 20 modes of
        steel. A lumped mass, the row sums of the matrix on its diagonal, is the default of LS-DYNA.
    of_file : length unit of the file of the part
    """
    elastic = material(analysis.get("material", "steel"))
    units = resolved(analysis.get("units"), of_file)
    metre = METRES[units]
    young, density = elastic.young * metre, elastic.density * metre**3
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
        *modal_cards(analysis.get("modes", 20), analysis.get("mass") == "lumped"),
        "*END",
    ]
    return write_parts(path, (f"{line}\n" for line in lines))


def modal_cards(modes: int, is_lumped: bool) -> list[str]:
    """The cards of a modal analysis."""
    mass = [] if is_lumped else ["*CONTROL_IMPLICIT_CONSISTENT_MASS", "1"]
    general = ["*CONTROL_IMPLICIT_GENERAL", "1,1."]
    return [*general, "*CONTROL_IMPLICIT_EIGENVALUE", str(modes), *mass]
