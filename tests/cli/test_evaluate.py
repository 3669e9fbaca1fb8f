"""python -m polycube.evaluate: one table, JSON and TensorBoard, of weights and checkpoints."""

import json
from pathlib import Path

import pytest

from polycube.cli.evaluate import BASELINES, TABLE, evaluate_weights, main, table
from polycube.cli.train import train
from polycube.config import compose
from polycube.diffusion.training.data_module import HELD_OUT, JUDGED
from tests.conftest import ROOT, first_quick

# a warning of torch about a call in Lightning
pytestmark = pytest.mark.filterwarnings("ignore:.*LeafSpec.*:FutureWarning")

WEIGHTS = ROOT / "plugins/weights/2x1"
SMALL = ("pairs=4", "batch_size=2", "sampler.steps=2")


def config(name: str, *overrides: str) -> dict[str, object]:
    return compose(name, overrides)


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a training of two steps, without a classifier."""
    folder = tmp_path_factory.mktemp("trained") / "bare"
    few = ["batch_size=4", "batches_per_epoch=2", "trainer.max_epochs=1", "held_out=4"]
    few += ["schedule.steps=20", "+trainer.enable_progress_bar=false", "denoiser.classifier=false"]
    train(config("train", "experiment=smoke", *few, "sampler.steps=2"), folder)
    return folder


@pytest.mark.slow
def test_weights_and_checkpoint_in_one_table(
    trained: Path, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    """The same network twice, once in half precision.

    On the pairs that chose its checkpoint, the error is that of the training.
    """
    chosen = HELD_OUT - JUDGED
    paths = [str(trained / "weights"), str(trained / "checkpoints" / "last.ckpt")]
    made = evaluate_weights(
        config("evaluate", f"weights={paths}".replace(" ", ""), *SMALL, f"seed={chosen}"), tmp_path
    )
    assert json.loads((tmp_path / "evaluation.json").read_text()) == made
    weights, checkpoint = made["weights"]
    trained_error = json.loads((trained / "weights" / "weights.json").read_text())["error"]
    assert checkpoint["columns"]["error"] == pytest.approx(trained_error, rel=1e-5)
    assert weights["columns"]["error"] == pytest.approx(trained_error, rel=1e-2)
    assert len(weights["contexts"]) == 4 and weights["threads"] >= 1
    assert len(list((tmp_path / "tensorboard").rglob("events.out.tfevents.*"))) == 2
    head, _, *rows = capsys.readouterr().out.splitlines()
    assert len(rows) == 2 * (1 + len(BASELINES))
    assert all(row.count("|") == head.count("|") for row in rows)
    for head, cell in zip(TABLE, rows[0].split("|")[2:-1], strict=True):
        assert (cell.strip() == "") == ("context" in TABLE[head] or "turned" in TABLE[head])


def test_missing_columns_are_empty_cells() -> None:
    row = {"path": "a/weights/weights.safetensors", "columns": {"error": 0.25}}
    cells = table([row]).splitlines()[2].split("|")[1:-1]
    assert cells[:2] == [" a ", " 0.250 "]
    assert not "".join(cells[2:]).strip()


@pytest.mark.parametrize(
    ("arguments", "message"),
    first_quick(
        2,
        [
            (["weights=nowhere"], "error: no weights at nowhere"),
            (["pairs=0"], "error: pairs must be a whole number, 1 or more; got 0"),
            (["batch_size=two"], "error: batch_size must be a whole number, 1 or more; got 'two'"),
            (
                ["slabs=[5,2]"],
                "error: slabs must be the smallest and the largest number, such as [2, 5]; got [5",
            ),
            (
                ["sampler.steps=0"],
                "error: sampler=ddim: steps must be a whole number, 1 or more; got 0",
            ),
        ],
    ),
)
def test_a_wrong_option_is_one_sentence_and_exit_code_2(
    arguments: list[str], message: str, here: Path, argv, capsys: pytest.CaptureFixture
) -> None:
    argv("evaluate", f"weights={WEIGHTS}", *arguments)
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    assert capsys.readouterr().err.strip().splitlines()[-1].startswith(message)
    assert not list(here.rglob("evaluation.json"))
