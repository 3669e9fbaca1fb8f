"""The page of the desk: the part, what is set at its faces, and the run."""

from dataclasses import dataclass, field
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, get_args, get_type_hints

from nicegui import ui

from polycube.analysis.problem import MATERIALS
from polycube.cli.process import Process
from polycube.desk.job import LOADS, WISHES, Job
from polycube.desk.part import PartView
from polycube.desk.results import ResultsView
from polycube.errors import PolycubeError
from polycube.io.cad import Cad
from polycube.io.surfaces import KNOWN
from polycube.registry import names

SELECTED, HELD, LOADED, COUNTED = "#ffa726", "#1e88e5", "#e53935", "#43a047"
ANALYSES = ["modal", "static", "none"]
EFFORTS = ["first", "normal", "thorough"]
INTERFACES = list(get_args(get_type_hints(Cad)["interfaces"]))
PRELOAD = "{point: [0, 0, 9], axis: [0, 0, 1], force: 1000}"
# how a face is shown at which something is set; the last one that applies gives the colour
COLOURS = {**dict.fromkeys(WISHES, COUNTED), "held": HELD, **dict.fromkeys(LOADS, LOADED)}
TEXTS = {kind: f"{text} {{}}" for kind, text in WISHES.items()}
TEXTS |= {"held": "held", "force": "force {} N", "pressure": "pressure {:g} Pa"}


@dataclass
class Desk:
    """What is set and run at a desk; a page that is loaded again shows the same.

    folder : in which the desk was opened; it reads and writes nothing outside of it
    scratch : folder for the faces that are shown
    job : what is set
    process : the last run
    """

    folder: Path
    scratch: Path
    job: Job = field(default_factory=Job)
    process: Process | None = None

    def build(self) -> None:
        """Add the elements to a page."""
        ui.page_title("Polycube desk")
        ui.label(f"Polycube desk: {self.folder}").classes("text-xl")
        with ui.row().classes("w-full items-start"):
            with ui.column().classes("w-full lg:w-[48%]"):
                self._part()
            with ui.column().classes("w-full lg:w-[48%]"):
                self._faces()
                self._settings()
        self._command = ui.textarea("The same as a command").classes("w-full")
        self._command.props("readonly autogrow")
        with ui.row().classes("items-center"):
            self._start = ui.button("Run", on_click=self._run)
            self._stop = ui.button("Stop", on_click=self._end)
            self._says = ui.label().props('role="status"')
        self._log = ui.log(max_lines=400).classes("w-full h-40").props('aria-label="Messages"')
        self._results = ResultsView(self.folder)
        self._changed()
        self._ready()

    def _part(self) -> None:
        files = (path for path in self.folder.iterdir() if path.is_file())
        parts = sorted(path.name for path in files if path.suffix.lower() in KNOWN)
        given = self.job.part or None
        choice = ui.select(parts, value=given, label="Part").classes("w-full")
        choice.on_value_change(lambda event: self._open(str(event.value)))
        self._view = PartView(self._painted)
        self._about = ui.label()
        if given:
            ui.timer(0.1, lambda: self._open(given), once=True)

    def _faces(self) -> None:
        with ui.card().classes("w-full"):
            ui.label("At the selected faces").classes("font-bold")
            with ui.row():
                ui.button("Hold", on_click=lambda: self._set("held", True))
                ui.button("Clear", on_click=self._clear)
            with ui.row().classes("items-end"):
                force = [ui.number(f"Force {x}, N", value=0).classes("w-24") for x in "xyz"]
                ui.button("Add force").on_click(
                    lambda: self._set("force", tuple(float(each.value or 0) for each in force))
                )
            with ui.row().classes("items-end"):
                pressure = ui.number("Pressure, Pa", value=1e5).classes("w-32")
                ui.button("Add pressure").on_click(
                    lambda: self._set("pressure", float(pressure.value or 0))
                )
            with ui.row().classes("items-end"):
                kind = ui.select(WISHES, value="size", label="Wish").classes("w-56")
                text = ui.input("Length, per cent or number", value="2%").classes("w-40")
                ui.button("Add wish", on_click=lambda: self._wish(kind.value, text.value))
            self._list = ui.column().props('role="list" aria-label="What is set at the faces"')

    def _settings(self) -> None:
        with ui.card().classes("w-full"):
            ui.label("Settings").classes("font-bold")
            with ui.row().classes("items-end"):
                self._bind(ui.select(ANALYSES, label="Analysis").classes("w-32"), "analysis")
                self._bind(ui.select([*MATERIALS], label="Material").classes("w-32"), "material")
                self._bind(ui.number("Modes", min=1, precision=0).classes("w-20"), "modes")
                self._bind(ui.checkbox("Solve here"), "is_solved")
                sectors = ui.number("Sectors of the whole", min=2, precision=0, placeholder="none")
                self._bind(sectors.classes("w-40"), "sectors")
            self._bind(ui.input("Preloads", placeholder=PRELOAD).classes("w-full"), "preloads")
            with ui.row().classes("items-end w-full") as several:
                interfaces = ui.select(INTERFACES, label="Where solids touch").classes("w-40")
                self._bind(interfaces, "interfaces")
                materials = ui.input("Materials of solids", placeholder="BOLT: steel, PLATE: abs")
                self._bind(materials.classes("grow"), "materials")
            several.bind_visibility_from(self.job, "solids", lambda number: number > 1)
            with ui.row().classes("items-end"):
                size = ui.input("Size of the hexes", placeholder="automatic").classes("w-40")
                self._bind(size, "size")
                self._bind(ui.select(EFFORTS, label="Effort").classes("w-32"), "effort")
                exports = ui.select(names("export"), multiple=True, label="Exports")
                self._bind(exports.classes("w-48"), "exports")
            self._bind(ui.input("Further settings").classes("w-full"), "further")

    def _bind(self, element: Any, name: str) -> None:
        element.bind_value(self.job, name).on_value_change(self._changed)

    async def _open(self, part: str) -> None:
        job = self.job
        if part != job.part:
            job.part = part
            job.faces.clear()
        self._about.set_text(f"Reading {part} ...")
        try:
            scratch = Path(mkdtemp(dir=self.scratch))
            unit, job.solids = await self._view.show(self.folder / part, scratch)
        except PolycubeError as error:
            self._about.set_text(str(error))
            return
        unit = unit or "mm, because the file states no unit"
        solids = f"solids: {job.solids}, " * (job.solids > 1)
        self._about.set_text(f"{solids}faces: {self._view.count}, lengths in {unit}")
        self._changed()

    def _set(self, kind: str, value: object) -> None:
        """Set something at every selected face."""
        if not self._view.selected:
            ui.notify("Select one or more faces first: click them, or use the list.")
        for name in self._view.selected:
            self.job.faces.setdefault(name, {})[kind] = value
        self._changed()

    def _wish(self, kind: str, text: str) -> None:
        if kind == "size":
            self._set(kind, text)
        elif text.isdecimal():
            self._set(kind, int(text))
        else:
            ui.notify("A number of hexes must be a whole number.")

    def _clear(self) -> None:
        for name in self._view.selected:
            self.job.faces.pop(name, None)
        self._changed()

    def _changed(self) -> None:
        """Show what is set, and the command."""
        job = self.job
        rows = [(name, *pair) for name, given in job.faces.items() for pair in given.items()]
        said = [f"{name}: {TEXTS[kind].format(value)}" for name, kind, value in rows]
        self._list.clear()
        with self._list:
            for line in said:
                ui.label(line).props('role="listitem"')
        try:
            self._command.set_value(job.command)
        except ValueError as error:
            self._command.set_value(f"Further settings: {error}")
        self._painted(self._view.selected)

    def _painted(self, selected: list[str]) -> None:
        faces = self.job.faces
        colours = {name: COLOURS[k] for k in COLOURS for name in faces if k in faces[name]}
        self._view.paint(colours | dict.fromkeys(selected, SELECTED))

    def _ready(self, says: str = "") -> None:
        """Show whether a run can be started or stopped, and what became of the last one."""
        runs = self.process is not None and self.process.is_running
        self._start.set_enabled(not runs)
        self._stop.set_enabled(runs)
        self._says.set_text("running" if runs else says)

    async def _run(self) -> None:
        if not self.job.part:
            ui.notify("Choose a part first.")
            return
        self._log.clear()
        last = ""
        try:
            process = await Process.begin(self.folder, self.job.part, self.job.settings)
            self.process = process
        except ValueError as error:
            ui.notify(f"Further settings: {error}")
            return
        self._ready()
        async for line in process.lines():
            self._log.push(line)
            last = line or last
        code = await process.end()
        self._ready("finished" if code == 0 else f"exit code {code}: {last}")
        self._results.update()
        self._results.show(process.folder)

    def _end(self) -> None:
        if self.process is not None:
            self.process.stop()
