"""The progress line: the stage, the elapsed time and the best mesh so far."""

import io
import re

from polycube.cli.progress import ProgressLine


class Run:
    """A progress line whose clock is set by hand."""

    def __init__(self) -> None:
        self.stream, self.now = io.StringIO(), 1000.0
        self.line = ProgressLine(self.stream, clock=lambda: self.now)

    def begin(self, stage: str, after: float) -> str:
        """The line when a stage begins, some seconds after the previous one."""
        self.now += after
        self.line.begin(stage)
        self.line._progress.refresh()
        last = self.stream.getvalue().rpartition("\r")[2]
        return re.sub(r"\x1b\[[^A-Za-z]*[A-Za-z]", "", last)


def test_the_line_has_the_stage_the_elapsed_time_and_the_best_mesh() -> None:
    run = Run()
    run.begin("read", 0)
    line = run.begin("meshing/optimize", 75)
    assert "meshing/optimize" in line and "0:01:15" in line and "read" not in line
    run.line.show_best(0.4321)
    assert "scaled Jacobian 0.432" in run.begin("meshing/cure", 10)
    run.line.close()


def test_messages_are_not_changed() -> None:
    """Square brackets, colons and long lines are special to rich."""
    run = Run()
    message = "cad_face_19 [bold] :smile: 0.5 'a' " + "x" * 200
    run.line.write(message)
    assert run.stream.getvalue() == f"{message}\n"
    run.line.close()
