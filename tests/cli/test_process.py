"""A run that the desk starts, stops and lists."""

import asyncio
import json

import pytest

from polycube.cli.process import COMMAND, Process, earlier
from polycube.desk.job import Job


def run(folder, job: Job, stop_at: str | None = None) -> tuple[Process, int, list[str]]:
    """A run to its end, or until a line with some text."""

    async def work() -> tuple[Process, int, list[str]]:
        process, said = await Process.begin(folder, job.part, job.settings), []
        async for line in process.lines():
            said.append(line)
            if stop_at and stop_at in line:
                process.stop()
        return process, await process.end(), said

    return asyncio.run(work())


def test_without_results_there_are_no_runs(tmp_path) -> None:
    assert earlier(tmp_path) == []


def test_the_last_run_is_listed_first(tmp_path) -> None:
    damaged = tmp_path / "outputs" / "c" / "2026-01-04-00-00-00"
    damaged.mkdir(parents=True)
    (damaged / "report.html").touch()
    for name, valid in (("a/2026-01-02-00-00-00", True), ("b/2026-01-03-00-00-00", False)):
        folder = tmp_path / "outputs" / name
        folder.mkdir(parents=True)
        (folder / "report.html").touch()
        numbers = {"valid": valid, "hex": {"hexes": 8, "min_scaled_jacobian": 0.5}}
        (folder / "report.json").write_text(json.dumps(numbers))
    found = [(each.name[0], each.verdict, each.hexes) for each in earlier(tmp_path)]
    assert found == [("b", "not valid", 8), ("a", "valid", 8)]


@pytest.mark.slow
def test_an_input_that_is_refused_writes_nothing(tmp_path) -> None:
    process, code, said = run(tmp_path, Job("none.step"))
    assert code == 2 and "none.step" in said[-1] and not process.is_running
    assert not process.folder.exists()


@pytest.mark.slow
def test_a_run_is_stopped_with_the_best_mesh_and_its_command(tmp_path) -> None:
    job = Job("example:rod", analysis="none", size="3%", further="structure=slices")
    process, code, _ = run(tmp_path, job, stop_at="meshing/pillow")  # long before the end
    assert code == 130
    report = json.loads((process.folder / "report.json").read_text())
    assert report["interrupted"] and report["hex"]["hexes"] > 0
    assert (process.folder / COMMAND).read_text() == f"{job.command}\n"
