"""Length units that files declare."""

import re
from pathlib import Path

from polycube.errors import InputError
from polycube.io.step.text import SOLIDS, STEP, Exchange, exchange
from polycube.units import MILLIMETRES, named_unit, resolved

IGES = (".iges", ".igs")
PREFIX = {"MEGA": 6, "KILO": 3, "HECTO": 2, "DECA": 1, "DECI": -1, "CENTI": -2, "MILLI": -3}
PREFIX |= {"MICRO": -6, "NANO": -9, "PICO": -12}
# units flag of the global section of IGES, in mm; 3 is a name
FLAGS = {"1": 25.4, "2": 1.0, "4": 304.8, "5": 1609344.0, "6": 1000.0, "7": 1e6, "8": 0.0254}
FLAGS |= {"9": 1e-3, "10": 10.0, "11": 25.4e-6}
NAMES = {"IN": "1", "INCH": "1", "MM": "2", "FT": "4", "MI": "5", "M": "6", "KM": "7"}
NAMES |= {"MIL": "8", "UM": "9", "CM": "10", "UIN": "11"}
MULTIPLE = re.compile(r"LENGTH_MEASURE\(([-+]?\d+(?:\.\d*)?(?:E[-+]?\d+)?)\),#(\d+)")


def file_unit(path: Path) -> str:
    """Length unit declared in a file, a name of `polycube.units`; empty if the format has none.

    A unit without a name here is mm, the unit of Open CASCADE.
    """
    suffix = path.suffix.lower()
    if suffix in STEP:
        return named_unit(_of_step(exchange(path))) or "mm"
    if suffix in IGES:
        return named_unit(_of_iges(path)) or "mm"
    return "m" if suffix == ".glb" else ""  # by the specification of glTF


def gmsh_unit(path: Path) -> str:
    """Length unit in which Gmsh reads a file.

    Open CASCADE may lose curves of an IGES file whose lengths it converts.
    """
    return file_unit(path) if path.suffix.lower() in IGES else "mm"


def gmsh_lengths(path: Path) -> float:
    """Length from Gmsh that is one unit of a file."""
    return MILLIMETRES[resolved(None, file_unit(path))] / MILLIMETRES[gmsh_unit(path)]


def _of_step(file: Exchange) -> float:
    """Millimetres of the unit of the first representation with a solid, else of the first unit."""
    solids = {n for n in file.entities if file.word(n) in SOLIDS}
    contexts = [n for n, body in file.entities.items() if "GLOBAL_UNIT_ASSIGNED_CONTEXT" in body]
    shapes = (file.references(n) for n in file.entities if file.word(n).endswith("REPRESENTATION"))
    contexts[:0] = next(([own[-1]] for own in shapes if solids.intersection(own)), [])
    for context in contexts:
        units = re.search(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\(\(([^)]*)\)", file.body(context))
        for unit in re.findall(r"#(\d+)", units[1] if units else ""):
            if "LENGTH_UNIT()" in file.body(unit):
                return _millimetres(file, unit)
    return 1.0


def _millimetres(file: Exchange, unit: str) -> float:
    """Millimetres of a unit: an SI unit, or a multiple of another unit; 1 for anything else."""
    factor, seen = 1.0, set()
    while unit not in seen:
        seen.add(unit)
        body = file.body(unit)
        if metre := re.search(r"SI_UNIT\((?:\.(\w+)\.|\$),\.METRE\.\)", body):
            return factor * 10.0 ** (3 + PREFIX.get(metre[1], 0))
        based = re.search(r"CONVERSION_BASED_UNIT\('\d+',#(\d+)\)", body)
        multiple = MULTIPLE.search(file.body(based[1])) if based else None
        if multiple is None:
            return 1.0
        factor, unit = factor * float(multiple[1]), multiple[2]
    raise InputError(f"the length unit #{unit} is defined by itself; export the part again")


def _of_iges(path: Path) -> float:
    """Millimetres of the unit in parameters 14 and 15 of the global section."""
    rows = (row for row in path.read_bytes().decode("latin-1").splitlines() if row[72:73] == "G")
    text = "".join(row[:72].ljust(72) for row in rows)
    values, between, at = [""], ",", 0  # numbered from 1
    while at < len(text) and len(values) <= 15:
        string = re.compile(r"\s*(\d{1,9})H").match(text, at)
        start = string.end() if string else at
        end = start + int(string[1]) if string else text.find(between, at) % (len(text) + 1)
        values.append(text[start:end].strip())
        between, at = values[1] or ",", end + 1
    flag, name = (values + 15 * [""])[14:16]
    return FLAGS.get(NAMES.get(name.rstrip(";").upper(), "") if flag == "3" else flag, 25.4)
