"""The curves of a training, read from the files of TensorBoard, and a picture of them.

The picture has the loss by step, as in the paper, and the measures of held-out pairs.
"""

import logging
from collections.abc import Mapping
from pathlib import Path

import numpy as np

Curves = Mapping[str, np.ndarray]  # name -> (n, 2) step and value

LOSS, ERROR = "loss", "error"
BASELINES = {"error/one_step": "in one step", "error/untouched": "untouched geometry"}


def curves(folder: Path) -> dict[str, np.ndarray]:
    """Scalars written by a training, each (n, 2): step and value."""
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    logging.getLogger("tensorboard").setLevel(logging.WARNING)  # it logs the opened files
    events = EventAccumulator(str(folder / "tensorboard"), size_guidance={"scalars": 0}).Reload()
    return {
        name: np.array([(event.step, event.value) for event in events.Scalars(name)])
        for name in events.Tags()["scalars"]
    }


def draw(trainings: Mapping[str, Curves], path: Path) -> Path:
    """Write a PNG: the loss and the held-out error of one or several trainings by step."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 3.6), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    for name, measured in trainings.items():
        if LOSS in measured:
            line = left.plot(*measured[LOSS].T, lw=0.6, alpha=0.4)[0]
            left.plot(*smoothed(measured[LOSS]).T, color=line.get_color(), lw=1.6, label=name)
        if ERROR in measured:
            right.plot(*measured[ERROR].T, marker=".", label=name)
    if len(trainings) == 1:
        for name, label in BASELINES.items():
            if name in measured:
                right.plot(*measured[name].T, ls=":", label=label)
    for axes, title in ((left, "loss"), (right, "error of held-out pairs")):
        axes.set(title=title, xlabel="step", yscale="log")
        axes.grid(alpha=0.3, which="both")
        if axes.has_data() and (len(trainings) > 1 or axes is right):
            axes.legend(fontsize=8)
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
