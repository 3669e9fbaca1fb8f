"""Progress line of a run on a terminal: stage, elapsed time, and best mesh so far."""

import time
from collections.abc import Callable
from typing import TextIO

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn


class ProgressLine:
    """The last line of a terminal. Messages are written above it.

    stream : of a terminal
    clock : seconds since some time
    """

    def __init__(self, stream: TextIO, clock: Callable[[], float] = time.monotonic) -> None:
        self._console = Console(
            file=stream, force_terminal=True, force_jupyter=False, get_time=clock
        )
        columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
        self._progress = Progress(
            *columns,
            TextColumn("{task.fields[best]}"),
            console=self._console,
            refresh_per_second=4,
            redirect_stdout=False,
            redirect_stderr=False,
            transient=True,
        )
        self._task = self._progress.add_task("", total=None, best="")

    def write(self, message: str) -> None:
        """Write a message above the line."""
        self._console.out(message, highlight=False)

    def begin(self, stage: str) -> None:
        """Show the name of a stage that begins."""
        self._progress.update(self._task, description=stage)
        self._progress.start()  # only once

    def show_best(self, scaled_jacobian: float) -> None:
        """Show the scaled Jacobian of the best mesh so far."""
        self._progress.update(self._task, best=f"scaled Jacobian {scaled_jacobian:.3f}")

    def close(self) -> None:
        """Remove the line."""
        self._progress.stop()
