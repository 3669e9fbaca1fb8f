"""A part as coloured faces that can be picked."""

import asyncio
from collections.abc import Callable, Mapping
from math import dist
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import ui

from polycube.hexmesh.face_groups import ENDS
from polycube.hexmesh.named_sets import face_set
from polycube.io.cad import Cad
from polycube.io.solids.listing import read_solids
from polycube.io.stl import write_stl
from polycube.io.surfaces import is_cad, read_surface
from polycube.types import TriMesh

ADDRESS = "/faces"
WHOLE = "surface"  # of a part without CAD faces, which cannot be selected
EXTENT = 10.0  # of the part in the view
SEGMENTS = 24  # triangle edges on a full turn: enough to see
PLACE = attrgetter("x", "y", "z")  # of a hit
STILL = 0.01 * EXTENT  # distance that a point under the mouse may move between press and release
GREY = "#b0bec5"


def faces_of(path: Path, folder: Path) -> tuple[dict[str, Path], list[TriMesh]]:
    """An STL file in a folder for each CAD face, by the name of its set, and surfaces of solids.

    Raises InputError if the surface of a solid is not closed.
    """
    solids = read_solids(path) if is_cad(path) else []
    numbers = {f"{solid.name}_": solid.number for solid in solids}
    several = numbers if len(solids) > 1 else {"": None}
    cads = [Cad(segments=SEGMENTS, solid=number) for number in several.values()]
    surfaces = [read_surface(path, cad)[0] for cad in cads]
    points = np.concatenate([surface.vertices for surface in surfaces])
    low, high = points.min(axis=0), points.max(axis=0)
    found: dict[str, Path] = {}
    for solid, surface in zip(several, surfaces, strict=True):
        scaled = (surface.vertices - (low + high) / 2) * EXTENT / np.linalg.norm(high - low)
        region = surface.region if len(surface.region) else np.zeros(len(surface.faces), np.int64)
        for number in np.unique(region).tolist():
            name = solid + face_set(surface, number) if len(surface.region) else WHOLE
            used, faces = np.unique(surface.faces[region == number], return_inverse=True)
            file = folder / f"{len(found)}.stl"
            found[name] = write_stl(file, scaled[used], faces.reshape(-1, 3))
    return found, surfaces


class PartView:
    """The view of a part; a click on a face, or the list below it, selects faces.

    on_change : called with the names of the selected faces
    """

    def __init__(self, on_change: Callable[[list[str]], None]) -> None:
        self._objects: dict[str, Any] = {}
        self._on_change = on_change
        self._pressed: Any = None  # what was under the mouse when its button was pressed
        events = ["mousedown", "click"]
        self._scene = ui.scene(grid=False, on_click=self._clicked, click_events=events)
        self._scene.classes("w-full h-96 border")
        self._scene.props('aria-label="The part; its faces are also in the list below"')
        self._list = ui.select([], multiple=True, label="Selected faces", value=[])
        self._list.classes("w-full").on_value_change(lambda _: self._on_change(self.selected))

    @property
    def selected(self) -> list[str]:
        """Names of the selected faces."""
        return list(self._list.value)

    @property
    def count(self) -> int:
        """Number of faces."""
        return len(self._objects)

    async def show(self, path: Path, folder: Path) -> tuple[str, int]:
        """Show another part; its faces are written to a folder that is served at `ADDRESS`.

        Returns its length unit, and the number of its solids.
        """
        faces, surfaces = await asyncio.to_thread(faces_of, path, folder)
        address = f"{ADDRESS}/{folder.name}"
        self._scene.clear()
        with self._scene:
            self._objects = {
                name: self._scene.stl(f"{address}/{file.name}").with_name(name).material(GREY)
                for name, file in faces.items()
            }
        self._scene.move_camera(x=0.6 * EXTENT, y=-0.6 * EXTENT, z=0.5 * EXTENT)
        self._list.set_options([*(name for name in faces if name != WHOLE), *ENDS], value=[])
        return surfaces[0].unit, len(surfaces)

    def paint(self, colours: Mapping[str, str]) -> None:
        """Colour faces by name, and the others grey."""
        for name, shown in self._objects.items():
            shown.material(colours.get(name, GREY))

    def _clicked(self, event: Any) -> None:
        hit = next((hit for hit in event.hits if hit.object_name), None)
        before = self._pressed
        if event.click_type == "mousedown":
            self._pressed = hit
        elif hit is None or before is None or dist(PLACE(hit), PLACE(before)) > STILL:
            return  # beside the part, or the view was turned
        elif (name := hit.object_name) in self._list.options:
            others = [chosen for chosen in self.selected if chosen != name]
            self._list.set_value(others if name in self.selected else [*others, name])
