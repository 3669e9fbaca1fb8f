"""Pictures of meshes, structures and splines for the pages of the theory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from docs.generators.theory import parts
from docs.generators.theory.search import searched
from docs.generators.tiles import write_tiles
from polycube.api import mesh
from polycube.hexmesh.connectivity import extraordinary_edges, quad_edges
from polycube.report.pictures import fields, scenes
from polycube.report.pictures.colours import SURFACE, WORST, rgb
from polycube.report.pictures.features import AMBIENT, quad_colours
from polycube.report.pictures.render import Layer, Scene
from polycube.types import Deformation, HexMesh, TriMesh

SHOWN: dict[str, tuple[str, Callable[[], int] | str]] = {  # structure: its caption and its part
    "sweep": ("sweep: a plate", parts.plate),
    "turned": ("turned: a shaft", parts.shaft),
    "sheet": ("sheet: a bent sheet", parts.sheet),
    "bent": ("bent: an elbow", parts.elbow),
    "labels": ("labels: a valve block", parts.valve_block),
    "slices": ("slices: a surface", "example:lantern"),
    "diffusion": ("diffusion: a surface", "example:key"),
    "overlay": ("overlay: a surface", "example:barrel"),
}
STAGES = {
    "meshing/subdivide": "cut and placed",
    "meshing/smooth": "registered",
    "meshing/pillow": "pillowed",
    "meshing/optimize": "polished",
}


def structures(path: Path, scratch: Path) -> None:
    """Write a mesh on each kind of structure."""
    found = {}
    for name, (caption, part) in SHOWN.items():
        source = part if isinstance(part, str) else parts.write(part, scratch / f"{name}.step")
        result = mesh(source, "order=[meshing]", structure=name, effort="first", size="6%")
        assert result.hexes is not None
        found[caption] = scenes.hex_outside(result.hexes)
    write_tiles(path, found, 4)


def stages(path: Path) -> None:
    """Write the mesh of a surface after each stage that fits it."""
    history = searched("example:lantern", "structure=slices", "order=[meshing]")[0]
    results = history.outcomes[0].results
    found = {
        caption: scenes.hex_outside(hexes)
        for stage, caption in STAGES.items()
        if isinstance(hexes := results[stage], HexMesh)
    }
    write_tiles(path, found, 4)


def paths(path: Path, surface: TriMesh, mesh: HexMesh) -> None:
    """Write the curves of a part, and the boundary of its mesh with a colour for each CAD face."""
    colours = quad_colours(mesh)
    edges, pair = quad_edges(mesh.quads)
    borders = edges[colours[pair[:, 0]] != colours[pair[:, 1]]]
    painted = rgb(tuple(colours.tolist()))
    skin = Layer(mesh.vertices, mesh.quads, painted, borders, outlined=True, ambient=AMBIENT)
    curves = scenes.input_surface(surface)
    write_tiles(path, {"curves of the part": curves, "their paths": [skin]}, 2, (420, 320))


def extraordinary(hexes: HexMesh) -> Scene:
    """The extraordinary edges inside of a transparent mesh."""
    glass = rgb((SURFACE,) * len(hexes.quads))
    lines = extraordinary_edges(hexes)[0]
    nothing = np.zeros((0, 3), np.int64)
    return [
        Layer(hexes.vertices, hexes.quads, glass, opacity=0.25),
        Layer(hexes.vertices, nothing, nothing.astype(np.uint8), lines, line_colour=WORST),
    ]


def splines(path: Path) -> None:
    """Write a hex mesh, its extraordinary edges, and the elements of the spline on it."""
    found = mesh("example:rod", "order=[meshing,spline]", spline="h2s")
    assert found.hexes is not None and found.spline is not None
    shown = {
        "hex mesh": scenes.hex_outside(found.hexes),
        "extraordinary edges": extraordinary(found.hexes),
        "elements of the spline": scenes.spline_boundary(found.spline),
    }
    write_tiles(path, shown, 3)


def answer(path: Path, scratch: Path) -> None:
    """Write a spline, and the stress on its deformed shape."""
    part = parts.write(parts.bracket, scratch / "bracket.step")
    held = "analysis=static", "analysis.fixed=[z_min]", "analysis.material=steel"
    load = "analysis.loads=[{at: z_max, force: [500, 0, 0]}]"
    found = mesh(part, *held, load, size="8%", spline="h2s")
    assert found.spline is not None and isinstance(found.solution, Deformation)
    resting = scenes.spline_boundary(found.spline)
    moved = fields.deformed(found.spline, found.solution)
    write_tiles(path, {"spline": resting, "von Mises stress": moved}, 2, (360, 280))


def chain(path: Path) -> None:
    """Write the results of all steps for one part, from the surface to a vibration mode."""
    state = searched("example:rod", "structure=diffusion", "context=[cube,hole_z]")[1]
    assert state.hexes is not None and state.polycube is not None and state.labels is not None
    solved = mesh(state.hexes)
    assert solved.spline is not None and solved.modes is not None
    film = fields.mode(solved.spline, solved.modes, fields.first_elastic(solved.modes))
    shown = {
        "1. surface": scenes.input_surface(state.surface),
        "2. polycube": scenes.polycube_faces(state.polycube, state.rough_map),
        "3. its faces on the surface": scenes.labelled(state.surface, state.labels),
        "4. hexes": scenes.hex_outside(state.hexes),
        "5. the inside": scenes.hex_cut(state.hexes),
        "6. spline": scenes.spline_boundary(solved.spline),
        "7. vibration mode": [replace(film.layer, points=film.layer.points + film.shift)],
    }
    write_tiles(path, shown, 4)
