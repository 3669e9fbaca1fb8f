"""Pictures of a training: its curves, and in TensorBoard predicted polycubes beside the truth."""

import logging
from collections.abc import Mapping
from pathlib import Path

import lightning.pytorch as L
import numpy as np
from lightning.pytorch.loggers import TensorBoardLogger

from polycube.diffusion.training.module import DDPMPolycube

ROWS = 4  # number of pairs in a picture
Curves = Mapping[str, np.ndarray]  # name -> (n, 2) step and value

LOSS = "loss"
ERRORS = {
    "error": "sampled",
    "error/one_step": "in one step",
    "error/untouched": "untouched geometry",
}


class Pictures(L.Callback):
    """After each validation, three scatter plots of the first few held-out pairs."""

    def on_validation_end(self, trainer: L.Trainer, module: L.LightningModule) -> None:
        """Pass the picture to the logger."""
        logger = trainer.logger
        if not isinstance(module, DDPMPolycube) or not isinstance(logger, TensorBoardLogger):
            return
        if trainer.sanity_checking or not trainer.is_global_zero or module.example is None:
            return
        picture = scatter(*[np.asarray(image[:ROWS]) for image in module.example])
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


def curves(folder: Path) -> dict[str, np.ndarray]:
    """Scalars written by a training, each (n, 2): step and value; none with another logger."""
    if not (folder / "tensorboard").is_dir():
        return {}
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    logging.getLogger("tensorboard").setLevel(logging.WARNING)  # it logs the opened files
    events = EventAccumulator(str(folder / "tensorboard"), size_guidance={"scalars": 0}).Reload()
    found = {name: events.Scalars(name) for name in events.Tags()["scalars"]}
    return {name: np.array([(e.step, e.value) for e in found[name]]) for name in found}


def draw(measured: Curves, path: Path) -> Path:
    """Write a PNG: the loss and the held-out error of a training by step."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 3.6), dpi=100, layout="constrained")
    left, right = figure.subplots(1, 2)
    if LOSS in measured:
        line = left.plot(*measured[LOSS].T, lw=0.6, alpha=0.4)[0]
        left.plot(*smoothed(measured[LOSS]).T, color=line.get_color(), lw=1.6)
    for name, label in ERRORS.items():
        if name in measured:
            right.plot(*measured[name].T, marker=".", label=label)
    for axes, title in ((left, "loss"), (right, "error of held-out pairs")):
        axes.set(title=title, xlabel="step", yscale="log")
        axes.grid(alpha=0.3, which="both")
    if right.has_data():
        right.legend(fontsize=8)
    figure.savefig(path)
    return path


def smoothed(curve: np.ndarray, share: float = 0.05) -> np.ndarray:
    """Running mean (n, 2) of a curve (n, 2) over a share of its points, symmetric."""
    reach = int(share * len(curve) / 2)
    sums = np.concatenate([[0.0], np.cumsum(curve[:, 1])])
    here = np.arange(len(curve))
    near = np.minimum(reach, np.minimum(here, len(curve) - 1 - here))
    mean = (sums[here + near + 1] - sums[here - near]) / (2 * near + 1)
    return np.column_stack([curve[:, 0], mean])
