"""The progress line: its estimate of the time left, from the measured shares."""

import io
import re

import pytest

from polycube.cli.progress import OPTIMIZE, SHARES, ProgressLine, time_left


@pytest.mark.parametrize(
    ("least", "most", "words"),
    [
        (4, 20.4, "4 to 20 s left"),
        (30, 240, "up to 4 min left"),
        (61, 240, "1 to 4 min left"),
        (-3, 8, "up to 8 s left"),
        (8.2, 8.3, "up to 8 s left"),
        (-9, 0.4, ""),
        (-9, -1, ""),
    ],
)
def test_the_time_left_in_words(least, most, words) -> None:
    assert time_left(least, most) == words


def test_the_shares_are_quartiles() -> None:
    for low, middle, high in (*SHARES.values(), *OPTIMIZE.values()):
        assert 0 < low < middle < high < 1


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


def test_the_estimate_follows_from_the_share_of_the_stage_and_the_elapsed_time() -> None:
    run = Run()
    assert "left" not in run.begin("read", 0)
    assert "left" not in run.begin("structure/boxes", 2)
    low, middle, high = SHARES["ranking"]
    line = run.begin("ranking", 18)
    assert "0:00:20" in line and time_left(20 / high - 20, 20 / low - 20) in line
    assert run.line._progress.tasks[0].completed == middle
    assert time_left(20 / high - 30, 20 / low - 30) in run.begin("meshing/cure", 10)
    done = 0.0
    for _ in range(17):
        line = run.begin("meshing/optimize", 10)
        assert done <= (done := run.line._progress.tasks[0].completed) < 1, "goes backwards"
    low, _, high = OPTIMIZE[15]
    assert time_left(200 / high - 200, 200 / low - 200) in line
    run.line.close()


def test_no_estimate_for_a_run_that_has_no_structures() -> None:
    run = Run()
    assert "left" not in run.begin("read", 0) + run.begin("meshing/optimize", 5)
    run.line.close()


def test_messages_are_not_changed() -> None:
    """Square brackets, colons and long lines are special to rich."""
    run = Run()
    message = "cad_face_19 [bold] :smile: 0.5 'a' " + "x" * 200
    run.line.write(message)
    assert run.stream.getvalue() == f"{message}\n"
    run.line.close()
