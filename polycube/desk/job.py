"""What is set at the desk, as the settings of a run that `infer.py` can repeat."""

import json
import shlex
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

from polycube.io.cad import CONFORM

SOLVED = "meshing,spline,analysis,report"
MESHED = "meshing,report"
LOADS = ("force", "pressure")
WISHES = {
    "size": "size of the hexes",
    "through": "hexes through the wall",
    "around": "hexes around the hole",
}


@dataclass
class Job:
    """A run of one part.

    part : name of its file in the folder of the desk
    solids : number of solids in the file; several are all meshed
    interfaces : `cad.interfaces` of several solids
    materials : of some of them, such as `BOLT: steel, PLATE: abs`
    size : `meshing.size`; the default of the program if empty
    effort : first, normal or thorough
    analysis : modal or static, or none: stop after the mesh
    is_solved : whether the analysis is computed here; otherwise it only goes into the exports
    material : a name of `analysis.material`
    modes : number of modes
    preloads : of a static analysis, such as `{point: [0, 0, 9], axis: [0, 0, 1], force: 1000}`
    sectors : number of sectors, if the part is one of several around an axis
    faces : what is set at faces, by their names: `held` is true, `force` (x, y, z) is the total
        force in N, `pressure` in Pa is towards the solid; `size`, `through` and `around` are
        entries of `meshing.at`
    exports : formats
    further : other settings, as on a command line
    """

    part: str = ""
    solids: int = 1
    interfaces: str = CONFORM
    materials: str = ""
    size: str = ""
    effort: str = "normal"
    analysis: str = "modal"
    is_solved: bool = True
    material: str = "steel"
    modes: int = 10
    preloads: str = ""
    sectors: int | None = None
    faces: dict[str, dict[str, Any]] = field(default_factory=dict)
    exports: list[str] = field(default_factory=list)
    further: str = ""

    @property
    def settings(self) -> list[str]:
        """The settings of the run, one for each word of a command line.

        Raises ValueError if a quotation in `further` is not closed.
        """
        is_solved = self.is_solved and self.analysis != "none"
        found = [f"mesh={self.part}", f"order=[{SOLVED if is_solved else MESHED}]"]
        if self.solids > 1:
            found += ["cad.solid=all", f"cad.interfaces={self.interfaces}"]
        if self.solids > 1 and self.materials:
            found.append(f"cad.materials={{{self.materials}}}")
        if self.size:
            found.append(f"meshing.size={self.size}")
        if self.effort != "normal":
            found.append(f"effort={self.effort}")
        if wishes := self._entries(WISHES):
            found.append(f"meshing.at=[{wishes}]")
        found.append(f"analysis={self.analysis}")
        if self.analysis != "none":
            held = ",".join(name for name, given in self.faces.items() if "held" in given)
            found += [f"analysis.material={self.material}", f"analysis.fixed=[{held}]"]
            found += [f"analysis.cyclic={{sectors: {self.sectors}}}"] * bool(self.sectors)
        if self.analysis == "modal":
            found.append(f"analysis.modes={self.modes}")
        if self.analysis == "static":
            found.append(f"analysis.loads=[{self._entries(LOADS)}]")
            found += [f"analysis.preloads=[{self.preloads}]"] * bool(self.preloads)
        if self.exports:
            found.append(f"export=[{','.join(self.exports)}]")
        return found + shlex.split(self.further)

    @property
    def command(self) -> str:
        """The command line that does the same."""
        return shlex.join(["polycube-infer", *self.settings])

    def _entries(self, kinds: Collection[str]) -> str:
        """What is set of these kinds, as the entries of a list in a configuration."""
        return ", ".join(
            f"{{at: {name}, {kind}: {value if isinstance(value, str) else json.dumps(value)}}}"
            for name, given in self.faces.items()
            for kind, value in given.items()
            if kind in kinds
        )
