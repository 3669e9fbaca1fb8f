"""Draw scenes to PNG and films to GIF, off screen. It is run as a separate process:

    python -m polycube.report.pictures.render FOLDER < scenes.pickle

because a missing or faulty graphics driver may end the process, and VTK writes to stderr.
`pictures.draw` starts it.
"""

from __future__ import annotations

import pickle
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from polycube.report.pictures.colours import EDGE

if TYPE_CHECKING:
    from pyvista import Plotter

EYE = (0.75, -1.0, 0.62)  # from the centre of the model towards the eye; z is up
# in the frame of the eye, which is at +z
LIGHTS = (((-0.35, 1.0, 0.5), 0.6), ((0.1, 0.0, 1.0), 0.62))
SIZE = (1120, 840)  # pixels before the empty margin is removed
GAP = 0.06  # of the diagonal: gap between two views
COLOURS = 256  # colours of a picture: reduces the size to a third


@dataclass(frozen=True, eq=False)
class Layer:
    """Polygons of one size with colours, and lines on them."""

    points: np.ndarray  # (N, 3)
    polygons: np.ndarray  # (P, 3 or 4)
    colours: np.ndarray  # (P, 3) uint8, or (N, 3) for colours that vary within a polygon
    # indices of points
    lines: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    outlined: bool = False  # draw the edges of every polygon
    smooth: bool = False  # smooth shading, except at sharp edges
    opacity: float = 1.0
    line_colour: str = EDGE
    line_width: float = 4  # in pixels
    ambient: float = 0.35  # ambient light: larger if a legend explains the colours


Scene = list[Layer]


@dataclass(frozen=True, eq=False)
class Film:
    """One layer in oscillation: frame k shows its points displaced by the sine of its phase."""

    layer: Layer
    shift: np.ndarray  # (N, 3)
    width: int = 420  # pixels
    frames: int = 16
    milliseconds: int = 70  # per frame

    def draw(self, folder: Path, name: str) -> None:
        """Write an endless GIF on white with a fixed view."""
        plotter = stage(2 * self.width, 2 * self.width * SIZE[1] // SIZE[0])
        plotter.renderer.set_background("white")
        layer = self.layer
        steps = np.sin(2 * np.pi * np.arange(self.frames) / self.frames).round(9)
        seen = {}
        for step in np.unique(steps):
            plotter.clear_actors()
            moved = layer.points + step * self.shift
            _add(plotter, replace(layer, points=moved, line_width=layer.line_width / 2))
            look(plotter, np.concatenate([layer.points + way * self.shift for way in (-1, 1)]))
            seen[step] = shot(plotter)
        plotter.close()
        _save_film([seen[step] for step in steps], folder / f"{name}.gif", self.milliseconds)


class Drawing(Protocol):
    """A picture that draws itself."""

    def draw(self, folder: Path, name: str) -> None:
        """Write one file, `name` with a suffix."""


Picture = Scene | Drawing


def view() -> np.ndarray:
    """(3, 3) rotation from the model to the eye: right, up, towards the eye."""
    towards = np.array(EYE) / np.linalg.norm(EYE)
    right = np.cross([0, 0, 1], towards)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(towards, right), towards])


def from_both_sides(scene: Scene) -> Scene:
    """A scene from the front above and, beside or below it, from behind below."""
    seen = [layer.points @ view().T for layer in scene]
    low, high = (end(np.concatenate(seen), axis=0) for end in (np.min, np.max))
    size, shift = high - low, np.zeros(3)
    down = int(size[0] > 1.2 * size[1])  # below if it is wide
    shift[down] = (-1) ** down * (size[down] + GAP * np.linalg.norm(size))
    back = [(points - (low + high) / 2) * [-1, 1, -1] + (low + high) / 2 + shift for points in seen]
    turned = [replace(layer, points=p @ view()) for layer, p in zip(scene, back, strict=True)]
    return [*scene, *turned]


def render(scene: Scene, path: Path) -> None:
    """Write one picture with transparent background, cropped to its content."""
    plotter = stage(*SIZE)
    for layer in scene:
        _add(plotter, layer)
    look(plotter, np.concatenate([layer.points for layer in scene]))
    plotter.enable_anti_aliasing("ssaa")
    image = shot(plotter, transparent=True)
    plotter.close()
    _save(image, path)


def shot(plotter: Plotter, transparent: bool = False) -> np.ndarray:
    """(height, width, 3 or 4) uint8 image of the plotter."""
    image = plotter.screenshot(None, transparent_background=transparent, return_img=True)
    if image is None:
        raise RuntimeError("VTK drew nothing")
    return np.asarray(image)


def stage(width: int, height: int) -> Plotter:
    """An empty picture with the lights of all pictures; the size is in pixels."""
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=[width, height], lighting="none")
    for where, intensity in LIGHTS:
        light = pyvista.Light(position=where, light_type="camera light", intensity=intensity)
        plotter.add_light(light)
    return plotter


def look(plotter: Plotter, points: np.ndarray) -> None:
    """Parallel projection along `EYE` to the middle of points, all of which are seen."""
    seen = points @ view().T
    low, high = seen.min(axis=0), seen.max(axis=0)
    middle = (low + high) / 2 @ view()
    distance = 2 * np.linalg.norm(high - low)
    plotter.renderer.enable_parallel_projection()
    plotter.camera_position = [middle + distance * view()[2], middle, (0, 0, 1)]
    width, height = (high - low)[:2]
    plotter.camera.parallel_scale = 0.52 * max(height, width * SIZE[1] / SIZE[0])
    plotter.renderer.ResetCameraClippingRange()


def _add(plotter: Plotter, layer: Layer) -> None:
    import pyvista

    if len(layer.lines):
        lines = pyvista.line_segments_from_points(layer.points[layer.lines].reshape(-1, 3))
        plotter.add_mesh(lines, color=layer.line_colour, line_width=layer.line_width)
    if not len(layer.polygons):
        return
    plotter.add_mesh(
        pyvista.PolyData.from_regular_faces(layer.points, layer.polygons),
        scalars=layer.colours,
        rgb=True,
        preference="cell",
        opacity=layer.opacity,
        show_edges=layer.outlined,
        edge_color=EDGE,
        line_width=2.5,
        smooth_shading=layer.smooth,
        split_sharp_edges=layer.smooth,
        specular=0.1,
        ambient=layer.ambient,
        diffuse=1.15 - layer.ambient,
    )


def _save(image: np.ndarray, path: Path) -> None:
    from PIL.Image import Quantize, fromarray

    few = fromarray(image).quantize(COLOURS, Quantize.FASTOCTREE)
    box = few.convert("RGBA").getbbox()
    if box is None:
        raise RuntimeError(f"nothing was drawn for {path.name}")
    few.crop(box).save(path, "PNG", optimize=True)


def _save_film(frames: list[np.ndarray], path: Path, milliseconds: int) -> None:
    """Write an endless GIF with 64 colours of its first frame."""
    from PIL.Image import Dither, fromarray

    box = fromarray(255 - np.min(frames, axis=0)).getbbox()
    images = [fromarray(frame).crop(box).reduce(2) for frame in frames]
    palette = images[0].quantize(64)
    first, *others = [each.quantize(palette=palette, dither=Dither.NONE) for each in images]
    first.save(path, save_all=True, append_images=others, duration=milliseconds, loop=0)


def main(folder: Path) -> None:
    """Draw the pictures of the pickle on stdin to `folder/<name>.png`, films to `<name>.gif`."""
    for name, shown in pickle.load(sys.stdin.buffer).items():
        if isinstance(shown, list):
            render(shown, folder / f"{name}.png")
        else:
            shown.draw(folder, name)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
