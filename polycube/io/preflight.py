"""Check a surface before meshing: kinds, numbers and places of defects, and possible remedies."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from polycube.errors import InputError, printable
from polycube.io.cad import Cad
from polycube.io.file_units import file_unit
from polycube.io.surfaces import EXAMPLE, is_cad, read_repaired, read_soup
from polycube.io.vtk import write_named_vtp
from polycube.surface.clouds.options import Points
from polycube.surface.measures import diagonal, genus, place, volume
from polycube.surface.repair import clean
from polycube.surface.repair.repair import finite
from polycube.surface.repair.steps import Defect, find_defects
from polycube.types import TriMesh
from polycube.units import described

N_PLACES = 3  # number of printed places for each defect


@dataclass(frozen=True, eq=False)
class Preflight:
    """Result of the check of a file."""

    path: str
    surface: TriMesh  # as given, with equal corners merged and faces without finite corners removed
    lost: int  # number of vertices that are not finite
    defects: list[Defect]
    verdict: str  # one sentence
    is_usable: bool
    unit: str  # of lengths, and where it comes from

    def table(self) -> str:
        """Table for the terminal, one line per defect."""
        surface = self.surface
        rows = [
            f"{printable(self.path)}: {len(surface.vertices)} vertices, "
            f"{len(surface.faces)} faces, "
            f"diagonal {diagonal(surface):.5g} {self.unit.partition(',')[0]}",
            f"           lengths in {self.unit}",
        ]
        if self.lost:
            rows.append(f"{self.lost:>9}  vertices that are not finite")
        for defect in self.defects:
            where = [place(surface, surface.vertices[i].mean(axis=0)) for i in defect.items]
            note = f" ({defect.note})" if defect.note else ""
            more = ", ..." if len(where) > N_PLACES else ""
            at = ", ".join(where[:N_PLACES])
            rows.append(f"{len(where):>9}  {defect.problem}{note}, at {at}{more}")
        if not self.defects and not self.lost:
            rows.append("           no defects were found")
        return "\n".join(rows)

    def write(self, path: Path) -> Path:
        """Write the places as points, lines and triangles of a `.vtp`, numbered by `problem`."""
        items = {defect.problem: defect.items for defect in self.defects}
        return write_named_vtp(path, self.surface.vertices, items, "problem")


def preflight(path: str, cad: Cad, level: str, points: Points | None = None) -> Preflight:
    """Check a file and try a repair of the level; raises InputError if it cannot be read."""
    if path.startswith(EXAMPLE) or is_cad(Path(path)):
        given, lost = read_repaired(path, cad, "off")[0], 0
    else:
        vertices, faces, _ = read_soup(Path(path), points)
        lost = int((~np.isfinite(vertices).all(axis=1)).sum())
        try:
            given = clean.weld_equal(finite(vertices, faces)[0])[0]
        except InputError as error:
            raise InputError(f"{path}: {error}") from error.__cause__
    source = described(cad.units, given.unit or file_unit(Path(path)))
    unit = source.partition(",")[0]
    try:
        surface, notes, *_ = read_repaired(path, cad, level, points)
    except InputError as error:
        sentence = str(error).removeprefix(f"{path}: ").partition("; preflight=")[0]
        verdict, is_usable = f"{path}: {sentence.partition(', preflight=')[0]}", False
    else:
        what = f"closed, genus {genus(surface)}, volume {volume(surface):.6g} {unit}^3"
        verdict = "; ".join([f"usable: {what}", *notes])
        is_usable = True
    return Preflight(path, given, lost, find_defects(given), verdict, is_usable, source)
