"""Pictures of a training in TensorBoard: geometry, predicted polycube and truth side by side."""

import lightning.pytorch as L
import numpy as np
from lightning.pytorch.loggers import TensorBoardLogger

from polycube.diffusion.training.module import DDPMPolycube

ROWS = 4  # number of pairs in a picture


class Pictures(L.Callback):
    """After each validation, three scatter plots of the first few held-out pairs."""

    def on_validation_end(self, trainer: L.Trainer, module: L.LightningModule) -> None:
        """Pass the picture to the logger."""
        logger = trainer.logger
        if not isinstance(module, DDPMPolycube) or not isinstance(logger, TensorBoardLogger):
            return
        if trainer.sanity_checking or not trainer.is_global_zero or module.example is None:
            return
        images = [np.asarray(image[:ROWS]) for image in module.example]
        picture = scatter(*images)
        logger.experiment.add_image(
            "geometry, x_0, truth", picture, module.global_step, dataformats="HWC"
        )


def scatter(geometry: np.ndarray, x_0: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """(height, width, 3) uint8 picture of three batches (B, 3, h, w), one row per pair.

    The colour of a point is given by its true position on the polycube.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3 * len(truth)), dpi=60, layout="tight")
    canvas = FigureCanvasAgg(figure)
    for row, pair in enumerate(zip(geometry, x_0, truth, strict=True)):
        points = [np.asarray(image).reshape(3, -1) for image in pair]
        low, high = points[2].min(axis=1), points[2].max(axis=1)
        colour = ((points[2].T - low) / np.maximum(high - low, 1e-9)).clip(0, 1)
        for column, (name, xyz) in enumerate(
            zip(("geometry", "x_0", "truth"), points, strict=True)
        ):
            axes = figure.add_subplot(len(truth), 3, 3 * row + column + 1, projection="3d")
            axes.scatter(*xyz, c=colour, s=2)
            axes.set_title(name if row == 0 else "")
            axes.set_aspect("equal")
            axes.set_axis_off()
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()
