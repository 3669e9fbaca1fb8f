"""Picture of the denoising as in the paper: a strip of recorded states.

Every sample point is a small disc with the colour of its position on the regular polycube, so that
it can be followed; points on sides that face away are pale. All panels have the same
view and scale, and show the edges of the polycube.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from polycube.hexmesh.connectivity import quad_edges
from polycube.report.pictures.colours import EDGE, PLACES, ramp
from polycube.report.pictures.render import view
from polycube.structure.lattice import boundary
from polycube.structure.projection import project
from polycube.types import Polycube

WIDTH, DPI = 330, 100  # pixels across a picture, and in an inch
SIZE = 0.5  # width of a point, times the root of the number of points, in widths of the picture
LABEL = 40  # pixels for its label
MARGIN = 0.06  # of the extent around the points
PALE = 0.7  # share of white in the colour of points on sides that face away
FAR = "#bcbfc3"  # colour of edges that face away: EDGE with this share of white


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Sample points in each recorded state, in polycube units."""

    polycube: Polycube
    states: np.ndarray  # (S, N, 3) x_T ... x_0
    steps: tuple[int, ...] = ()  # (S,) t of each state; unknown if the length differs
    regular: np.ndarray = field(init=False)  # (N, 3) x_0 projected onto the polycube

    def __post_init__(self) -> None:
        object.__setattr__(self, "regular", project(self.polycube, self.states[-1])[0])

    @property
    def stations(self) -> np.ndarray:
        """(S + 1, N, 3) all states, and the regular points."""
        return np.concatenate([self.states, self.regular[None]])

    @property
    def names(self) -> list[str]:
        """Labels of the stations, as formulas of matplotlib."""
        n = len(self.states) - 1
        known = len(self.steps) == len(self.states)
        between = self.steps[1:-1] if known else [f"({i}/{n})" for i in range(1, n)]
        return [*(f"$x_{{{t}}}$" for t in ("T", *between, 0)), "regular"]

    def draw(self, folder: Path, name: str) -> None:
        """Write a PNG file of the stations side by side with their labels."""
        from PIL import Image

        camera = Camera(self)
        panels = [camera(*each) for each in zip(self.stations, self.names, strict=True)]
        Image.fromarray(np.hstack(panels)).quantize(256).save(folder / f"{name}.png", optimize=True)


class Camera:
    """Labelled pictures of a trajectory, `WIDTH` pixels across, with a fixed view and scale."""

    def __init__(self, trajectory: Trajectory) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.collections import LineCollection
        from matplotlib.figure import Figure

        surface = boundary(trajectory.polycube)
        edges, quads = quad_edges(surface.quads, is_closed=False)
        is_straight = np.diff(surface.patch[quads], axis=1)[:, 0] != 0
        lines = surface.vertices[edges[is_straight]]  # (E, 2, 3)
        faces_eye = _towards(surface.axis)[quads[is_straight]].any(axis=1)
        seen = np.concatenate([trajectory.stations.reshape(-1, 3), lines.reshape(-1, 3)]) @ view().T
        low, high = seen.min(axis=0)[:2], seen.max(axis=0)[:2]
        gap = MARGIN * (high - low).max()
        size = high - low + 2 * gap
        height = WIDTH * size[1] / size[0]
        figure = Figure((WIDTH / DPI, (height + LABEL) / DPI), dpi=DPI)
        self.canvas = FigureCanvasAgg(figure)
        self.axes = figure.add_axes((0, 0, 1, height / (height + LABEL)))
        self.axes.set(xlim=(low[0] - gap, high[0] + gap), ylim=(low[1] - gap, high[1] + gap))
        self.axes.set_axis_off()
        for ends, colour in ((lines[~faces_eye], FAR), (lines[faces_eye], EDGE)):
            edges_seen = list((ends @ view().T)[..., :2])
            self.axes.add_collection(LineCollection(edges_seen, colors=colour, zorder=0))
        self.colours = _colours(trajectory.polycube, trajectory.regular)
        wide = SIZE * WIDTH / np.sqrt(len(self.colours)) * 72 / DPI  # in units of 1/72 inch
        self.points = self.axes.scatter([], [], wide**2, linewidths=0)

    def __call__(self, points: np.ndarray, label: str = "") -> np.ndarray:
        """(height, width, 3) uint8 picture of points (N, 3) and the edges of the polycube."""
        seen = points @ view().T
        order = seen[:, 2].argsort()  # the nearest ones last
        self.points.set_offsets(seen[order, :2])
        self.points.set_facecolor(self.colours[order] / 255)
        self.axes.set_title(label)
        self.canvas.draw()
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()


def _towards(axis: np.ndarray) -> np.ndarray:
    """Whether faces of these axis labels face the eye."""
    return view()[2][axis // 2] * (1 - 2 * (axis % 2)) > 0


def _colours(polycube: Polycube, regular: np.ndarray) -> np.ndarray:
    """(N, 3) uint8: a hue along the longest axis, darker towards the low ends of the others.

    Nearly white for points that face away.
    """
    low, high = regular.min(axis=0), regular.max(axis=0)
    place = (regular - low) / np.maximum(high - low, 1e-300)
    longest = int((high - low).argmax())
    light = 0.65 + 0.35 * np.delete(place, longest, axis=1).mean(axis=1, keepdims=True)
    white = PALE * ~_towards(project(polycube, regular)[1])[:, None]
    return (ramp(place[:, longest], PLACES) * light * (1 - white) + 255 * white).astype(np.uint8)
