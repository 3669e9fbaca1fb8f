"""Checkpoints are complete or not written at all."""

from pathlib import Path

import pytest
import torch

from polycube.diffusion.training.learning import AtomicCheckpoints


class Unwritable:
    """An object whose pickling fails, after the objects before it were written."""

    def __reduce__(self) -> None:
        raise OSError("disk full")


def test_a_checkpoint_that_fails_leaves_the_one_before(tmp_path: Path) -> None:
    path, writer = tmp_path / "checkpoints" / "last.ckpt", AtomicCheckpoints(tmp_path)
    writer.save_checkpoint({"weights": torch.ones(1000)}, path)
    with pytest.raises(OSError, match="disk full"):
        writer.save_checkpoint({"weights": torch.zeros(1000), "last": Unwritable()}, path)
    assert torch.equal(torch.load(path, weights_only=True)["weights"], torch.ones(1000))
    assert list(path.parent.iterdir()) == [path]
