"""Pictures of the denoising as in the paper: a strip of recorded states, and an animation.

Every sample point is a small sphere with the colour of its position on the regular polycube, so
that it can be followed; points on sides that face away are pale. All panels and frames have the
same view and scale, and show the edges of the polycube.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from polycube.report.pictures.colours import EDGE, PLACES, SURFACE, ramp, rgb
from polycube.report.pictures.render import view
from polycube.report.pictures.spheres import spheres
from polycube.structure.lattice import boundary, edges
from polycube.structure.projection import project
from polycube.types import Polycube

if TYPE_CHECKING:
    from PIL.Image import Image as Picture

PANEL, FRAME = 330, 360  # pixels across a panel of the strip, and across the animation
MARGIN, LABEL = 14, 40  # pixels around the points, and for a line of labels
BETWEEN = 20  # frames between the states, distributed by the displacement of the points
PAUSE, STEP = 800, 70  # milliseconds at a state, and at a frame between
PALE = 0.7  # share of white in the colour of points on sides that face away


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Sample points in each recorded state, in polycube units."""

    states: np.ndarray  # (S, N, 3) x_T ... x_0
    regular: np.ndarray  # (N, 3) x_0 projected onto the polycube
    polycube: Polycube
    steps: tuple[int, ...] = ()  # (S,) t of each state; unknown if the length differs

    @property
    def stations(self) -> np.ndarray:
        """(S + 1, N, 3) all states, and the regular points."""
        return np.concatenate([self.states, self.regular[None]])

    @property
    def names(self) -> list[str]:
        """Labels of the stations in TeX."""
        n = len(self.states) - 1
        known = len(self.steps) == len(self.states)
        between = self.steps[1:-1] if known else [f"({i}/{n})" for i in range(1, n)]
        return [*(rf"$x_{{{t}}}$" for t in ("T", *between, 0)), "regular"]


class Camera:
    """Pictures of a trajectory, `width` pixels across, with a fixed view and scale."""

    def __init__(self, trajectory: Trajectory, width: int) -> None:
        lines, lines_face = _outline(trajectory.polycube)
        every = np.concatenate([trajectory.stations.reshape(-1, 3), lines.reshape(-1, 3)])
        seen = every @ view().T
        low, high = seen.min(axis=0), seen.max(axis=0)
        self.scale = (width - 2 * MARGIN) / (high - low)[0]
        self.size = int(self.scale * (high - low)[1]) + 2 * MARGIN, width
        self.middle = (low + high) / 2
        along = np.linspace(0, 1, width)[:, None, None]
        self.lines = (lines[:, 0] * (1 - along) + lines[:, 1] * along).reshape(-1, 3)
        n, n_lines = len(trajectory.regular), len(self.lines)
        _, axis = project(trajectory.polycube, trajectory.regular)
        points = _pale(_place_colours(trajectory.regular), _towards(axis))
        ink = _pale(np.repeat(rgb((EDGE,)), len(lines), axis=0), lines_face)
        self.colours = np.concatenate([points, np.tile(ink, (width, 1))])
        self.radius = np.repeat([0.45 * width / np.sqrt(n), 0.003 * width], [n, n_lines])

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """(height, width, 3) uint8 picture of points (N, 3) and the edges of the polycube."""
        seen = np.concatenate([points, self.lines]) @ view().T - self.middle
        height, width = self.size
        centres = self.scale * seen * [1, -1, 1] + [width / 2, height / 2, 0]
        return spheres(centres, self.colours, self.radius, self.size)


def _outline(polycube: Polycube) -> tuple[np.ndarray, np.ndarray]:
    """Straight edges of the polycube: (E, 2, 3) ends, and (E,) whether they are visible."""
    surface = boundary(polycube)
    ends, patches = edges(surface)
    axis = np.zeros(surface.patch.max() + 1, int)
    axis[surface.patch] = surface.axis
    return surface.vertices[ends], _towards(axis)[patches].any(axis=1)


def _towards(axis: np.ndarray) -> np.ndarray:
    """Whether faces of these axis labels face the eye."""
    return view()[2][axis // 2] * (1 - 2 * (axis % 2)) > 0


def _pale(colours: np.ndarray, looks_here: np.ndarray) -> np.ndarray:
    """(N, 3) colours; nearly white for points that face away."""
    white = PALE * ~looks_here[:, None]
    return (colours * (1 - white) + 255 * white).astype(np.float32)


def _place_colours(regular: np.ndarray) -> np.ndarray:
    """(N, 3) hue along the longest axis, darker towards the low ends of the others."""
    low, high = regular.min(axis=0), regular.max(axis=0)
    place = (regular - low) / np.maximum(high - low, 1e-300)
    longest = int((high - low).argmax())
    light = 0.65 + 0.35 * np.delete(place, longest, axis=1).mean(axis=1, keepdims=True)
    return ramp(place[:, longest], PLACES) * light


def strip(trajectory: Trajectory) -> bytes:
    """PNG: the stations side by side with their labels."""
    from PIL import Image

    camera = Camera(trajectory, PANEL)
    names = trajectory.names
    whole = Image.new("RGB", (PANEL * len(names), LABEL + camera.size[0]), "white")
    for i, (points, name) in enumerate(zip(trajectory.stations, names, strict=True)):
        whole.paste(Image.fromarray(camera(points)), (PANEL * i, LABEL))
        _write(whole, name, (PANEL * i + PANEL // 2, LABEL // 2), size=20)
    file = io.BytesIO()
    whole.quantize(256).save(file, "PNG", optimize=True)
    return file.getvalue()


def animation(trajectory: Trajectory) -> bytes:
    """Endless GIF: the points move in straight lines from station to station."""
    from PIL import Image, ImageDraw

    stations, names = trajectory.stations, trajectory.names
    camera = Camera(trajectory, FRAME)
    height, share = camera.size[0], FRAME / len(names)
    line = height + 6
    ground = Image.new("RGB", (FRAME, height + LABEL), "white")
    ImageDraw.Draw(ground).line([share / 2, line, FRAME - share / 2, line], SURFACE, 2)
    for k, name in enumerate(names):
        _write(ground, name, (int(share * (k + 0.5)), line + 20), size=14)
    frames = []
    times = _times(stations)
    for time in times:
        i = min(int(time), len(stations) - 2)
        points = stations[i] + (time - i) * (stations[i + 1] - stations[i])
        frame = ground.copy()
        frame.paste(Image.fromarray(camera(points)), (0, 0))
        x = share * (time + 0.5)
        ImageDraw.Draw(frame).ellipse([x - 5, line - 5, x + 5, line + 5], EDGE)
        frames.append(frame)
    palette = frames[-1].quantize(64)
    frames = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    file = io.BytesIO()
    wait = [PAUSE if time == int(time) else STEP for time in times]
    frames[0].save(file, "GIF", save_all=True, append_images=frames[1:], duration=wait, loop=0)
    return file.getvalue()


def _times(stations: np.ndarray) -> list[float]:
    """Times of the frames in stations, denser where the points move more."""
    way = np.linalg.norm(np.diff(stations, axis=0), axis=-1).mean(axis=1)
    times = [0.0]
    for i, share in enumerate(way / max(way.sum(), 1e-300)):
        n = 1 + round(BETWEEN * share)
        times += (i + np.arange(1, n + 1) / n).tolist()
    return times


def _write(image: Picture, name: str, middle: tuple[int, int], size: int) -> None:
    """Write TeX into a Pillow image."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.mathtext import math_to_image
    from PIL import Image

    file = io.BytesIO()
    font = FontProperties(size=size, family="serif", math_fontfamily="cm")
    math_to_image(name, file, prop=font, dpi=72, format="png", color=EDGE)
    text = Image.open(file).convert("RGB")
    image.paste(text, (middle[0] - text.width // 2, middle[1] - text.height // 2))
