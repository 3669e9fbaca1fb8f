"""Progress line of a run on a terminal: stage, bar, elapsed time, time left, best mesh so far.

The number of meshes that the search will make is unknown, so the time left is an estimate, and is
given as a range. `SHARES` has the measurement behind it; docs/reference/report.md describes it.
"""

import time
from collections.abc import Callable
from typing import TextIO

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn, TimeElapsedColumn
from rich.text import Text

# quartiles of the elapsed share of the total time, at the first start of a stage and at the n-th
# start of meshing/optimize: 134 runs to the mesh, times the share of the mesh in 12 complete runs
SHARES = {
    "ranking": (0.08, 0.21, 0.32), "meshing/refine": (0.43, 0.49, 0.54),
    "spline": (0.45, 0.50, 0.55), "analysis": (0.49, 0.54, 0.63), "report": (0.54, 0.59, 0.68),
}  # fmt: skip
OPTIMIZE = {1: (0.11, 0.27, 0.42), 2: (0.12, 0.23, 0.39), 3: (0.15, 0.21, 0.32)}
OPTIMIZE |= {6: (0.21, 0.28, 0.37), 9: (0.27, 0.34, 0.43), 15: (0.29, 0.36, 0.43)}


class ProgressLine:
    """The last line of a terminal. Messages are written above it.

    Parameters
    ----------
    stream : of a terminal
    clock : seconds since some time
    """

    def __init__(self, stream: TextIO, clock: Callable[[], float] = time.monotonic) -> None:
        self._console = Console(
            file=stream, force_terminal=True, force_jupyter=False, get_time=clock
        )
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(10),
            TimeElapsedColumn(),
            _TimeLeft(),
            TextColumn("{task.fields[best]}"),
            console=self._console,
            refresh_per_second=4,
            redirect_stdout=False,
            redirect_stderr=False,
            transient=True,
        )
        self._task = self._progress.add_task("", total=None, best="", least=0.0, most=0.0)
        self._is_whole = False  # whether the run began before the ranking of the structures
        self._optimized = 0

    def write(self, message: str) -> None:
        """Write a message above the line."""
        self._console.out(message, highlight=False)

    def begin(self, stage: str) -> None:
        """A stage begins: show its name, and estimate the total time."""
        self._progress.update(self._task, description=stage)
        self._progress.start()  # only once
        self._is_whole |= stage.startswith("structure/")
        self._optimized += stage == "meshing/optimize"
        shares = SHARES.get(stage)
        if stage == "meshing/optimize":
            shares = OPTIMIZE[max(n for n in OPTIMIZE if n <= self._optimized)]
        elapsed = self._progress.tasks[0].elapsed
        if self._is_whole and shares and elapsed:
            low, middle, high = shares
            done = max(middle, self._progress.tasks[0].completed)
            self._progress.update(
                self._task, total=1, completed=done, least=elapsed / high, most=elapsed / low
            )

    def show_best(self, scaled_jacobian: float) -> None:
        """Show the scaled Jacobian of the best mesh so far."""
        self._progress.update(self._task, best=f"scaled Jacobian {scaled_jacobian:.3f}")

    def close(self) -> None:
        """Remove the line."""
        self._progress.stop()


class _TimeLeft(ProgressColumn):
    """The estimated time left: from the first to the third quartile; empty if that has passed."""

    def render(self, task: Task) -> Text:
        elapsed = task.elapsed or 0.0
        return Text(time_left(task.fields["least"] - elapsed, task.fields["most"] - elapsed))


def time_left(least: float, most: float) -> str:
    """A range of seconds in words; empty if it is over."""
    unit, seconds = ("min", 60) if most > 100 else ("s", 1)
    low, high = round(least / seconds), round(most / seconds)
    if high < 1:
        return ""
    return f"{low} to {high} {unit} left" if 0 < low < high else f"up to {high} {unit} left"
