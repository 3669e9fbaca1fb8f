"""References to cite for a run: the methods that made its result."""

import re
from collections.abc import Iterator
from pathlib import Path

from polycube import __version__
from polycube.registry import classes
from polycube.types import Json

ENTRY = re.compile(r"^@\w+\{(\w+),.*?^\}$", re.DOTALL | re.MULTILINE)
SOLUTIONS = {"modes", "static", "poisson"}  # a report has at most one of them
PAPER = "yu2025ddpm"  # paper of the implemented method
SOFTWARE = f"""@software{{polycube,
  author = {{{{The DDPM-Polycube developers}}}},
  title = {{DDPM-Polycube}},
  version = {{{__version__}}}
}}"""


def bibtex(report: Json, config: Json) -> str:
    """BibTeX entries of the program, its paper and the plugins of a run.

    A plugin class gives its sources in `references`: keys of `references.bib`, or complete entries.

    report : the numbers of `report.json`
    config : the settings, as in `config.json`
    """
    text = (Path(__file__).parent / "references.bib").read_text(encoding="utf-8")
    known = {found[1]: found[0] for found in ENTRY.finditer(text)}
    cited = [PAPER]
    for used in plugins(report, config):
        cited += getattr(classes().get(used), "references", ())
    entries = [known.get(reference, reference) for reference in dict.fromkeys(cited)]
    return "\n\n".join([SOFTWARE, *entries])


def plugins(report: Json, config: Json) -> Iterator[tuple[str, str]]:
    """Kind and name of the plugins that made the result of a run."""
    proposed = report.get("polycube")
    if proposed and proposed["candidates"]:
        yield "structure", proposed["candidates"][proposed["chosen"]]["proposal"]
    if "hex" in report:
        bundle = config["improve" if "given" in report else "meshing"]
        for stage in bundle["order"]:
            yield stage, bundle[stage.removeprefix("meshing/")]["plugin"]
    if "spline" in report:
        yield "spline", config["spline"]["plugin"]
        if SOLUTIONS.intersection(report):
            yield "analysis", config["analysis"]["plugin"]
