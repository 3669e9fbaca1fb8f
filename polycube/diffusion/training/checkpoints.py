"""Checkpoints from which a training can be resumed after any interruption."""

from io import BytesIO
from pathlib import Path

import torch
from lightning.pytorch.plugins.io import TorchCheckpointIO

from polycube.io.manifest import writing


class AtomicCheckpoints(TorchCheckpointIO):
    """Checkpoints written atomically.

    Those of Lightning are written to the folder for temporary files and moved to their place. On
    another file system the move is a copy, and an interruption leaves an incomplete file.

    folder : folder of the training, which lists its files
    """

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self.folder = folder

    def load_checkpoint(
        self, path: str | Path, map_location: object = None, weights_only: bool | None = True
    ) -> dict[str, object]:
        """Load tensors and plain values only: no code of a file is executed."""
        return super().load_checkpoint(path, weights_only=True)

    def save_checkpoint(
        self, checkpoint: dict[str, object], path: str | Path, storage_options: object = None
    ) -> None:
        """Write a temporary file, then replace the file of an earlier epoch or training."""
        inside = Path(path).resolve().relative_to(self.folder.resolve())
        buffer = BytesIO()  # the writer of torch does not report a full disk
        torch.save(checkpoint, buffer)
        with writing(self.folder) as scratch:
            (scratch / inside).parent.mkdir(parents=True, exist_ok=True)
            (scratch / inside).write_bytes(buffer.getbuffer())
