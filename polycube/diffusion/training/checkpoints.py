"""Checkpoints that a training can go on from, whenever it was killed."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import torch
from lightning.pytorch.plugins.io import TorchCheckpointIO

from polycube.io.manifest import writing


class WholeCheckpoints(TorchCheckpointIO):
    """Checkpoints that appear whole or not at all.

    Lightning's own are written to the folder for temporary files and moved into place.  Where that
    is another file system the move is a copy, and a kill leaves half a file.

    folder : of the training, which lists its files
    """

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self.folder = folder

    def load_checkpoint(
        self, path: str | Path, map_location: object = None, weights_only: bool | None = True
    ) -> dict[str, object]:
        """Tensors and plain values only: nothing that a file holds is run."""
        return super().load_checkpoint(path, weights_only=True)

    def save_checkpoint(
        self, checkpoint: dict[str, object], path: str | Path, storage_options: object = None
    ) -> None:
        """Write beside the path, then replace what an earlier epoch or training wrote there."""
        inside = Path(path).resolve().relative_to(self.folder.resolve())
        whole = BytesIO()  # torch's own writer does not say that a disk is full
        torch.save(checkpoint, whole)
        with writing(self.folder) as scratch:
            (scratch / inside).parent.mkdir(parents=True, exist_ok=True)
            (scratch / inside).write_bytes(whole.getbuffer())
