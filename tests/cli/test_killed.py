"""kill -9 at random moments: no file is lost or half written, and the same command goes on."""

import filecmp
import json
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import torch

from polycube.io.manifest import NAME
from polycube.pipeline.resume.results import load_stage
from tests.fixtures.killed_runs import Killed, Outcome
from tests.fixtures.runs import FAST, check_complete, tree
from tests.fixtures.trainings import SMALL

INFER = ["mesh=example:rod", *FAST, "quiet=true", "order=[meshing,spline]"]
TRAIN = [*SMALL, "model=points", "model.width=8", "model.blocks=1", "model.slots=2"]
TRAIN += ["trainer.max_epochs=3", "trainer.check_val_every_n_epoch=3", "ema=0.9"]
OWN = {"run.log", "config.json", "report.json", NAME}  # differ from run to run
KILLS = 30


@pytest.fixture
def killed() -> Iterator[Callable[[str], Killed]]:
    """Makes a process that runs a program repeatedly."""
    made: list[Killed] = []

    def make(program: str) -> Killed:
        made.append(Killed(program))
        return made[-1]

    yield make
    for each in made:
        each.close()


def kill(go_on: Callable[..., Outcome], whole: Outcome) -> Iterator[None]:
    """Kill runs in turn before a use of a file and after a time.

    The moments lie within the last run that ended, so that most of them come before its end.
    """
    rng, last, dead = np.random.default_rng(0), whole, 0
    assert whole.code == 0, whole.output
    for k in range(KILLS):
        if k % 2:
            ended = go_on(seconds=rng.uniform(0.05, max(last.seconds, 0.1)))
        else:
            ended = go_on(change=int(rng.integers(1, last.changes + 1)))
        assert ended.code in (0, -9), ended.output
        if ended.code:
            dead += 1
        else:
            last = ended
        yield
    assert dead >= KILLS // 2


@pytest.mark.slow
def test_inference(killed, tmp_path: Path) -> None:
    """In one folder: the files are at last those of a run that nobody killed."""
    program, folder, whole = killed("infer"), tmp_path / "killed", tmp_path / "whole"
    done = program.run(whole, [*INFER, f"output_dir={whole}"])
    folder.mkdir()
    (folder / "mine").write_text("mine")

    def go_on(**moment: float) -> Outcome:
        return program.run(folder, [*INFER, f"output_dir={folder}"], **moment)

    for _ in kill(go_on, done):
        for name in check_complete(folder, {"mine"}):
            if name.startswith("stages/"):
                load_stage(folder, Path(name).stem.replace(".", "/"))
            if name.endswith(".json"):
                json.loads((folder / name).read_text())
    last = go_on()
    assert last.code == 0, last.output
    assert (folder / "mine").read_text() == "mine"
    assert tree(folder) - {"mine"} == tree(whole)
    for name in tree(whole) - OWN:
        assert filecmp.cmp(folder / name, whole / name, shallow=False), name
    one, other = (json.loads((path / "report.json").read_text()) for path in (folder, whole))
    assert one["hex"] == other["hex"] and one["spline"] == other["spline"]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*LeafSpec.*:FutureWarning")
def test_training(killed, tmp_path: Path) -> None:
    """It goes on from its last checkpoint: the weights are those of a training nobody killed."""
    program, folder, whole = killed("train"), tmp_path / "a" / "killed", tmp_path / "b" / "whole"
    done = program.run(whole, [*TRAIN, f"hydra.run.dir={whole}"])
    last, step = folder / "checkpoints" / "last.ckpt", 0

    def go_on(**moment: float) -> Outcome:
        resume = ["ckpt=last"] if last.is_file() else []
        return program.run(folder, [*TRAIN, *resume, f"hydra.run.dir={folder}"], **moment)

    for _ in kill(go_on, done):
        if folder.exists():
            check_complete(folder)
        if last.is_file():
            reached = torch.load(last, weights_only=True)["global_step"]
            assert reached >= step
            step = reached
    ended = go_on()
    assert ended.code == 0, ended.output
    assert {name for name in tree(folder) if name.startswith(".polycube")} == set()
    for name in ("weights.safetensors", "weights.yaml"):
        assert filecmp.cmp(folder / "weights" / name, whole / "weights" / name, shallow=False)
    one, other = (json.loads((p / "weights/weights.json").read_text()) for p in (folder, whole))
    # a training that was killed after its last step has no loss of a step
    expected = {name: other[name] for name in one} | {"samples_per_second": 0}
    assert one | {"samples_per_second": 0} == expected and {"error", "steps"} <= one.keys()
