"""What is set at the desk, as the settings of a run that `infer.py` can repeat."""

import shlex
from dataclasses import dataclass, field

SOLVED = "meshing,spline,analysis,report"
MESHED = "meshing,report"


@dataclass
class Job:
    """A run of one part.

    Parameters
    ----------
    part : name of its file in the folder of the desk
    size : `meshing.size`; the default of the program if empty
    effort : first, normal or thorough
    analysis : modal or static, or none: stop after the mesh
    is_solved : whether the analysis is computed here; otherwise it only goes into the exports
    material : a name of `analysis.material`
    modes : number of modes
    held : names of the faces that are fixed
    forces : total force in N on a face
    pressures : pressure in Pa on a face, towards the solid
    requests : `size`, `through` or `around` of a face, as in `meshing.at`
    exports : formats
    further : other settings, as on a command line
    """

    part: str = ""
    size: str = ""
    effort: str = "normal"
    analysis: str = "modal"
    is_solved: bool = True
    material: str = "steel"
    modes: int = 10
    held: list[str] = field(default_factory=list)
    forces: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    pressures: dict[str, float] = field(default_factory=dict)
    requests: dict[str, dict[str, str | int]] = field(default_factory=dict)
    exports: list[str] = field(default_factory=list)
    further: str = ""

    @property
    def settings(self) -> list[str]:
        """The settings of the run, one for each word of a command line.

        Raises
        ------
        ValueError
            If a quotation in `further` is not closed.
        """
        is_solved = self.is_solved and self.analysis != "none"
        found = [f"mesh={self.part}", f"order=[{SOLVED if is_solved else MESHED}]"]
        if self.size:
            found.append(f"meshing.size={self.size}")
        if self.effort != "normal":
            found.append(f"effort={self.effort}")
        wishes = [f"{{at: {at}, {_fields(wish)}}}" for at, wish in self.requests.items()]
        if wishes:
            found.append(f"meshing.at=[{', '.join(wishes)}]")
        found.append(f"analysis={self.analysis}")
        if self.analysis != "none":
            found += [
                f"analysis.material={self.material}",
                f"analysis.fixed=[{','.join(self.held)}]",
            ]
        if self.analysis == "modal":
            found.append(f"analysis.modes={self.modes}")
        if self.analysis == "static":
            given = [f"{{at: {at}, force: [{_numbers(f)}]}}" for at, f in self.forces.items()]
            given += [f"{{at: {at}, pressure: {p:g}}}" for at, p in self.pressures.items()]
            found.append(f"analysis.loads=[{', '.join(given)}]")
        if self.exports:
            found.append(f"export=[{','.join(self.exports)}]")
        return found + shlex.split(self.further)

    @property
    def command(self) -> str:
        """The command line that does the same."""
        return shlex.join(["polycube-infer", *self.settings])


def _fields(wish: dict[str, str | int]) -> str:
    return ", ".join(f"{name}: {value}" for name, value in wish.items())


def _numbers(values: tuple[float, ...]) -> str:
    return ", ".join(f"{value:g}" for value in values)
