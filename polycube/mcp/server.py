"""The tools of `polycube-mcp`: each does one step of the program with the files of a folder."""

import asyncio
import json
import re
from pathlib import Path
from typing import Any

from anyio import CancelScope
from mcp.server.mcpserver import Context, MCPServer
from mcp.server.mcpserver.exceptions import ToolError, UnexpectedToolError
from mcp.shared.path_security import safe_join
from mcp_types import ToolAnnotations

from polycube import __version__
from polycube.cli import help
from polycube.cli.batch import main_numbers
from polycube.cli.process import RESULTS, Process, earlier
from polycube.config import literal
from polycube.errors import InputError, PolycubeError
from polycube.examples.parts import EXAMPLES
from polycube.io import manifest
from polycube.io.access.reading import read_json
from polycube.io.surfaces import KNOWN
from polycube.mcp.schemas import Analysis, Begin, Meshing, Part, Run, Settings, chosen
from polycube.report.files import strings
from polycube.report.numbers.formatting import cautions, sentences

INSTRUCTIONS = """Hex meshes and analyses of CAD parts. Check a part, then mesh it: the result has
the named sets of the boundary, with centroids and normals. Solve with supports and loads at these
sets. Lengths are in the units of the part, paths are relative to the folder of the server."""
NAME = re.compile(r"(\w+)([./]\w+)*")  # of a setting
MANAGED = set("hydra mesh hex output_dir resume from order preflight".split())  # by the tools
NUMBERS = ("valid", "failure", "interrupted", "input", "modes", "static", "poisson")


class Server(MCPServer[Any]):
    """A server with the program as tools; clients are shown their docstrings.

    folder : nothing outside is read or written; an absolute path without links
    """

    def __init__(self, folder: Path) -> None:
        super().__init__("polycube", instructions=INSTRUCTIONS, version=__version__)
        self._folder = folder
        self._one = asyncio.Lock()  # for one run at a time: each may use all cores
        for tool in (self.files, self.options, self.check, self.results):
            self.add_tool(tool, annotations=ToolAnnotations(read_only_hint=True))
        for run in (self.mesh, self.solve):
            self.add_tool(run, annotations=ToolAnnotations(destructive_hint=False))

    async def call_tool(
        self, name: str, arguments: dict[str, Any], context: Context[Any, Any] | None = None
    ) -> Any:
        """The result of a tool; errors of the program keep their sentences."""
        try:
            return await super().call_tool(name, arguments, context)
        except UnexpectedToolError as error:
            if isinstance(error.__cause__, PolycubeError):
                raise ToolError(str(error.__cause__)) from None
            raise

    def files(self) -> dict[str, Any]:
        """List the parts in the folder, and the runs with results."""
        parts = sorted(p.name for p in self._folder.iterdir() if p.suffix.lower() in KNOWN)
        runs = [run._asdict() | {"name": f"{RESULTS}/{run.name}"} for run in earlier(self._folder)]
        return {"parts": parts, "runs": runs}

    def options(self, choice: str = "") -> str:
        """Explain the options of a choice, such as spline=h2s; without it, list all choices."""
        if not choice:
            return f"{help.choices('infer')}\n\n{help.settings('infer')}"
        group, _, name = choice.partition("=")
        blocks = help.of_choices("infer", self._settings({group: name}))
        return "\n\n".join(blocks) or f"{choice} has no options"

    async def check(self, part: Part, context: Context, settings: Settings) -> str:
        """Check whether a part can be meshed, and list its defects with numbers and places."""
        words = [self._part(part), "preflight=true", *self._settings(settings)]
        return (await self._do(context, part, words))[1]

    async def mesh(
        self, part: Part, context: Context, settings: Settings, meshing: Meshing | None = None
    ) -> dict[str, Any]:
        """Mesh a part with hexes, and return the results of this run like the tool `results`."""
        words = self._settings(chosen("meshing", meshing) | settings)
        words = [self._part(part), "order=[meshing,report]", *words]
        return self.results((await self._do(context, part, words))[0])

    async def solve(
        self, run: Run, analysis: Analysis, context: Context, settings: Settings, begin: Begin
    ) -> dict[str, Any]:
        """Solve a problem on the mesh of a run, and return the results of this new run."""
        config = read_json(self._inside(run) / "config.json")
        words = self._settings(chosen("analysis", analysis) | settings)
        words = [f"resume={literal(run)}", f"from={begin}", *words]
        part = str(config["hex"] or config["mesh"])
        return self.results((await self._do(context, part, words))[0])

    def results(self, run: Run) -> dict[str, Any]:
        """Numbers, warnings, named sets of the boundary, and files of a run."""
        folder = self._inside(run)
        report = read_json(folder / "report.json")
        found = {"run": run, **{name: report[name] for name in NUMBERS if name in report}}
        found |= {"numbers": main_numbers(folder), "results": [*sentences(report)]}
        found["warnings"] = [*cautions(report), *report.get("mesh_warnings", ())]
        found["sets"] = report.get("hex", {}).get("sets", {})
        found["files"] = manifest.files(folder)
        text = json.dumps(found)
        return dict(json.loads(text, parse_float=lambda number: float(f"{float(number):.5g}")))

    async def _do(self, context: Context, part: str, words: list[str]) -> tuple[str, str]:
        """Folder and messages of a run, which ends with the call; raises PolycubeError."""
        self._inside(RESULTS)
        async with self._one:
            process, said = await Process.begin(self._folder, part, words), list[str]()
            try:
                async for line in process.lines():
                    said.append(line)
                    await context.report_progress(len(said), message=line)
                code = await process.end()
            except BaseException:  # of a cancelled call or a lost client
                process.stop()
                with CancelScope(shield=True):
                    await process.end()
                raise
        if code:
            raise PolycubeError("\n".join([f"exit code {code}", *said]))
        return process.folder.relative_to(self._folder).as_posix(), "\n".join(said)

    def _inside(self, name: str) -> Path:
        """A path in the folder; raises InputError if it is outside."""
        try:
            return safe_join(self._folder, name)
        except (OSError, RuntimeError, ValueError):  # also links in a circle
            raise InputError("this path is outside of the folder of the server", name) from None

    def _part(self, part: str) -> str:
        """The setting for a part, which must exist."""
        is_example = part in [f"example:{name}" for name in EXAMPLES]
        if not is_example and not self._inside(part).is_file():
            raise InputError("there is no such file in the folder of the server", part)
        return f"mesh={part}"

    def _settings(self, given: dict[str, Any]) -> list[str]:
        """Settings as words of a command line; raises InputError for paths outside."""
        for name in given:
            if not NAME.fullmatch(name) or re.split("[./]", name)[0] in MANAGED:
                raise InputError("this setting cannot be given", name, "`options` lists the others")
        for text in strings(given):
            self._inside(text)
        return [f"{name}={literal(value)}" for name, value in given.items()]
