"""Disks that are full or read-only: one sentence, exit code 2, and no file is half."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from polycube import HOME
from tests.fixtures.runs import FAST, check_complete, tree

# a file system of a given size, visible to this process only; its files are copied out at the end
ALONE = """
mount -t tmpfs -o size={size} tmpfs "{disk}" || exit 99
echo mine > "{disk}/mine"
{prepare}
{command}
code=$?
cp -a "{disk}/." "{copied}"
exit $code
"""
INFER = ["mesh=example:rod", *FAST, "quiet=true", "order=[meshing,spline]"]
TRAIN = ["experiment=smoke", "batch_size=4", "batches_per_epoch=2", "trainer.max_epochs=2"]
TRAIN += ["held_out=4", "schedule.steps=20", "+trainer.enable_progress_bar=false"]


@pytest.fixture
def on_disk(tmp_path: Path):
    """Runs a program with results on a small disk; exit code, message, copy of the disk."""

    def run(size: str, program: str, *arguments: str, prepare: str = "") -> tuple[int, str, Path]:
        disk, copied = tmp_path / "disk", tmp_path / "kept"
        disk.mkdir()
        copied.mkdir()
        words = [sys.executable, str(HOME / program), *arguments]
        command = " ".join(f"'{word}'" for word in words)
        script = ALONE.format(size=size, disk=disk, copied=copied, command=command, prepare=prepare)
        alone = ["unshare", "--map-root-user", "--mount", "sh", "-c", script]
        if not shutil.which("unshare"):
            pytest.skip("the program unshare is not installed")
        ended = subprocess.run(alone, capture_output=True, text=True, cwd=tmp_path)
        if ended.returncode == 99 or "unshare" in ended.stderr:
            pytest.skip(f"no file system of its own: {ended.stderr}")
        return ended.returncode, ended.stderr, copied

    return run


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "most"), [("20k", 0), ("1100k", 10), ("1300k", 10), ("2000k", 20)]
)
def test_a_run_on_a_disk_that_fills_up(size: str, most: int, on_disk, tmp_path: Path) -> None:
    code, errors, copied = on_disk(size, "infer.py", *INFER, f"output_dir={tmp_path}/disk/out")
    assert code == 2, errors
    assert errors.count("\n") == 1 and "No space left on device" in errors
    assert (copied / "mine").read_text() == "mine\n"
    found = check_complete(copied / "out") if (copied / "out").exists() else set()
    assert len(found) <= most and "report.json" not in found
    if "stages/meshing.subdivide.npz" in found:  # with more room it goes on from there
        command = [sys.executable, str(HOME / "infer.py"), f"resume={copied / 'out'}", "quiet=true"]
        command += ["from=meshing/smooth", *FAST, "order=[meshing]"]
        assert subprocess.run(command).returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize("size", ["4k", "30k", "1200k", "1600k"])
def test_a_training_on_a_disk_that_fills_up(size: str, on_disk, tmp_path: Path) -> None:
    folder = f"hydra.run.dir={tmp_path}/disk/out"
    code, errors, copied = on_disk(size, "train.py", *TRAIN, folder)
    assert code == 2, errors
    assert (
        errors.strip()
        .splitlines()[-1]
        .endswith(("No space left on device", "device; files that were complete are kept"))
    )
    assert "Traceback" not in errors
    check_complete(copied / "out")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "folder", "refusal"),
    [
        (("infer.py", *INFER), "output_dir", "cannot write results to {}"),
        (("train.py", *TRAIN), "hydra.run.dir", "{}"),
    ],
)
def test_a_read_only_disk(command, folder: str, refusal: str, on_disk, tmp_path: Path) -> None:
    prepare = f'mount -o remount,ro "{tmp_path}/disk"'
    out = f"{tmp_path}/disk/out"
    code, errors, copied = on_disk("100k", *command, f"{folder}={out}", prepare=prepare)
    assert code == 2
    assert errors == f"error: {refusal.format(out)}: Read-only file system\n"
    assert tree(copied) == {"mine"}
