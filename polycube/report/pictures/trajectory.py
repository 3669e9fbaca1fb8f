"""Pictures of the denoising as in the paper: a strip of recorded states, and an animation.

Every sample point is a small sphere with the colour of its position on the regular polycube, so
that it can be followed; points on sides that face away are pale. All panels and frames have the
same view and scale, and show the edges of the polycube.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from polycube.report.pictures.colours import EDGE, PLACES, SURFACE, ramp
from polycube.report.pictures.render import counted, look, shot, stage, view, write_gif
from polycube.structure.lattice import boundary, edges
from polycube.structure.projection import project
from polycube.types import Polycube

if TYPE_CHECKING:
    from PIL.Image import Image as Picture

PANEL, FRAME = 330, 360  # pixels across a panel of the strip, and across the animation
MARGIN, LABEL = 14, 40  # pixels around the points, and for a line of labels
BETWEEN = 20  # frames between the states, distributed by the displacement of the points
PAUSE, STEP = 800, 70  # milliseconds at a state, and at a frame between
SAMPLES = 2  # samples along the edge of a pixel
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
        """Labels of the stations; `_` precedes an index."""
        n = len(self.states) - 1
        known = len(self.steps) == len(self.states)
        between = self.steps[1:-1] if known else [f"({i}/{n})" for i in range(1, n)]
        return [*(f"x_{t}" for t in ("T", *between, 0)), "regular"]


class Camera:
    """Pictures of a trajectory, `width` pixels across, with a fixed view and scale."""

    def __init__(self, trajectory: Trajectory, width: int) -> None:
        import pyvista

        lines, lines_face = _outline(trajectory.polycube)
        points = np.concatenate([trajectory.stations.reshape(-1, 3), lines.reshape(-1, 3)])
        extent = np.ptp(points @ view().T, axis=0)
        scale = (width - 2 * MARGIN) / extent[0]  # pixels for a unit
        height = int(scale * extent[1]) + 2 * MARGIN
        self.plotter = stage(SAMPLES * width, SAMPLES * height)
        self.plotter.renderer.set_background("white")
        for ends, colour in ((lines[~lines_face], FAR), (lines[lines_face], EDGE)):
            if len(ends):
                pairs = np.arange(2 * len(ends)).reshape(-1, 2)
                drawn = pyvista.PolyData(ends.reshape(-1, 3), lines=counted(pairs))
                self.plotter.add_mesh(drawn, color=colour, line_width=1.5 * SAMPLES)
        self.colours = _colours(trajectory.polycube, trajectory.regular)
        self.points = pyvista.PolyData(trajectory.regular.copy())
        self.points["colour"] = self.colours
        self.plotter.add_mesh(
            self.points,
            scalars="colour",
            rgb=True,
            render_points_as_spheres=True,
            ambient=0.35,
            point_size=0.9 * SAMPLES * width / np.sqrt(len(trajectory.regular)),
        )
        look(self.plotter, points, height / scale / 2)

    def __call__(self, points: np.ndarray) -> Picture:
        """Picture of points (N, 3) and the edges of the polycube."""
        from PIL import Image

        self.points.points = points
        self.plotter.render()
        return Image.fromarray(shot(self.plotter)).reduce(SAMPLES)


class Strip(Trajectory):
    """The stations side by side with their labels."""

    def draw(self, folder: Path, name: str) -> None:
        """Write a PNG file."""
        from PIL import Image

        camera, names = Camera(self, PANEL), self.names
        panels = [camera(points) for points in self.stations]
        camera.plotter.close()
        strip = Image.new("RGB", (PANEL * len(names), LABEL + panels[0].height), "white")
        for i, (panel, text) in enumerate(zip(panels, names, strict=True)):
            strip.paste(panel, (PANEL * i, LABEL))
            _write(strip, text, (PANEL * i + PANEL // 2, LABEL // 2), size=20)
        strip.quantize(256).save(folder / f"{name}.png", optimize=True)


class Animation(Trajectory):
    """The points move in straight lines from station to station."""

    def draw(self, folder: Path, name: str) -> None:
        """Write an endless GIF file."""
        from PIL import Image, ImageDraw

        stations, names = self.stations, self.names
        camera, share = Camera(self, FRAME), FRAME / len(names)
        height = camera(stations[0]).height
        line = height + 6
        ground = Image.new("RGB", (FRAME, height + LABEL), "white")
        ImageDraw.Draw(ground).line([share / 2, line, FRAME - share / 2, line], SURFACE, 2)
        for k, text in enumerate(names):
            _write(ground, text, (int(share * (k + 0.5)), line + 20), size=14)
        frames, times = [], _times(stations)
        for time in times:
            i = min(int(time), len(stations) - 2)
            frame = ground.copy()
            points = stations[i] + (time - i) * (stations[i + 1] - stations[i])
            frame.paste(camera(points), (0, 0))
            x = share * (time + 0.5)
            ImageDraw.Draw(frame).ellipse([x - 5, line - 5, x + 5, line + 5], EDGE)
            frames.append(frame)
        camera.plotter.close()
        wait = [PAUSE if time == int(time) else STEP for time in times]
        write_gif(frames, frames[-1], folder / f"{name}.gif", wait)


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


def _times(stations: np.ndarray) -> list[float]:
    """Times of the frames in stations, denser where the points move more."""
    way = np.linalg.norm(np.diff(stations, axis=0), axis=-1).mean(axis=1)
    times = [0.0]
    for i, share in enumerate(way / max(way.sum(), 1e-300)):
        n = 1 + round(BETWEEN * share)
        times += (i + np.arange(1, n + 1) / n).tolist()
    return times


def _write(image: Picture, name: str, middle: tuple[int, int], size: int) -> None:
    """Write a name into an image, with what follows `_` as its index."""
    from PIL import ImageDraw, ImageFont

    word, _, index = name.partition("_")
    large, small = (ImageFont.load_default(each) for each in (size, 0.7 * size))
    draw, (x, y) = ImageDraw.Draw(image), middle
    left = x - (large.getlength(word) + small.getlength(index)) / 2
    draw.text((left, y), word, EDGE, large, anchor="lm")
    draw.text((left + large.getlength(word), y + 0.3 * size), index, EDGE, small, anchor="lm")
