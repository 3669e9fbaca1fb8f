"""The results of the runs in the folder of a desk: a table, reports and files."""

import asyncio
from pathlib import Path

from nicegui import ui

from polycube.cli.process import RESULTS, earlier
from polycube.errors import InputError
from polycube.report.page.views.comparison import write_view

ADDRESS = "/results"
MOST = 12  # largest number of results side by side: browsers draw 16 3D views at most


class ResultsView:
    """A table of the runs, and below it the report of one, or several side by side.

    folder : in which the desk was opened
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        ui.label("Results").classes("font-bold")
        columns = [
            {"name": name, "label": name.replace("_", " "), "field": name, "align": "left"}
            for name in ("name", "verdict", "hexes", "scaled_jacobian")
        ]
        self._table = ui.table(rows=[], columns=columns, row_key="name", selection="multiple")
        self._table.classes("w-full")
        with ui.row():
            ui.button("Show", on_click=self._show)
            ui.button("Compare", on_click=self._compare)
        self._files = ui.row()
        self._page = ui.element("iframe").classes("w-full h-screen").props('title="Report"')
        self._page.set_visibility(False)
        self.update()

    def update(self) -> None:
        """List the runs again."""
        self._table.rows = [
            {**each._asdict(), "scaled_jacobian": f"{each.scaled_jacobian:.2f}"}
            for each in earlier(self._folder)
        ]
        self._table.update()

    def show(self, run: Path) -> None:
        """Show the report of a run, if it has one, and links to its files."""
        if (run / "report.html").is_file():
            self._frame(run / "report.html")
            self._files.clear()
            with self._files:
                for path in sorted(p for p in run.iterdir() if p.is_file()):
                    ui.link(path.name, self._address(path)).props("download")

    def _show(self) -> None:
        for run in self._chosen()[:1]:
            self.show(run)

    def _chosen(self) -> list[Path]:
        chosen = [self._folder / RESULTS / row["name"] for row in self._table.selected]
        if 0 < len(chosen) <= MOST:
            return chosen
        ui.notify(f"Select one to {MOST} results in the table first.")
        return []

    async def _compare(self) -> None:
        try:
            if chosen := self._chosen():
                self._frame(await asyncio.to_thread(write_view, chosen, self._folder / RESULTS))
        except InputError as error:
            ui.notify(str(error))

    def _frame(self, page: Path) -> None:
        self._page.props(f'src="{self._address(page)}?{page.stat().st_mtime_ns}"')
        self._page.set_visibility(True)

    def _address(self, path: Path) -> str:
        return f"{ADDRESS}/{path.relative_to(self._folder / RESULTS).as_posix()}"
