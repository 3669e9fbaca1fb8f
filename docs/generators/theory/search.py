"""The page that follows one part through the moves of the search, with a picture of each mesh."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from docs.generators.reference.markdown import table
from docs.generators.tiles import write_tiles
from polycube.config import compose
from polycube.pipeline.intake import read_part
from polycube.pipeline.run import Run
from polycube.pipeline.settings import Settings
from polycube.report.pictures import scenes
from polycube.search.again import Again
from polycube.search.history import NO_MESH, History, Move, Outcome
from polycube.search.moves import Cure, FitPartly, MeshStructure, Propose
from polycube.state import RunState
from polycube.types import Tier

HEAD = """# How a mesh is found

This page follows one CAD part through the [search](meshing.md#the-search), move by move. The part
is a valve block: a block of 60 x 40 x 30 mm with a boss, a slot, a hole across, and two holes that
meet inside. No single extrusion or revolution makes it. `python -m docs.generators.theory docs`
draws the part, meshes it with automatic settings, and writes this page.

![The part and its result](pictures/found.png)

Hexes are coloured by their scaled Jacobian: red is poor, blue is good. The search begins without a
mesh, which counts as a shortfall of {no_mesh:g}. Each row of this table is one move. The policy
chose it because it had the largest expected gain for its work among all moves that were possible
then. Work is counted in units of about a second on one core. Structures and meshes are numbered
from 0, in the order in which they are made.

"""
KINDS: dict[type, str] = {
    Propose: "Structures of one tier are proposed and ranked. This makes no mesh, but it makes "
    "further moves possible.",
    MeshStructure: "The hexes of the structure are cut, registered to the surface, pillowed where "
    "this improves them, and polished.",
    Cure: "The places with the poorest hexes are improved one after another, and the mesh is kept "
    "only if it is better.",
    Again: "The leading mesh is repeated with smaller hexes. The distances of its edges from the "
    "curves fall with the square of their length, so the size follows from the wanted distance.",
    FitPartly: "No fitted mesh is valid, so the hexes are fitted as far as they stay valid.",
}
TAIL = """## The end

{why} The leading mesh is the result: {hexes:,} hexes, a smallest scaled Jacobian of {jacobian:.2f},
{lost} lost. In the report of a run, the same table is under "How this mesh was found".
"""


def searched(source: str, *overrides: str) -> tuple[History, RunState]:
    """What the search tried on a part, and the state of its result."""
    run = Run(Settings.of(compose("infer", [f"mesh={source}", *overrides])), read_part)
    state = run.mesh(run.begin())
    assert run.history is not None
    return run.history, state


def page(history: History, pictures: Path) -> str:
    """The text of the page; the pictures are written to a folder."""
    meshes = {id(each.move): each for each in history.outcomes}
    surface = history.task.start.surface
    leader = history.leader
    assert leader is not None and leader.state.hexes is not None
    shown = {
        "the part": scenes.input_surface(surface),
        "its mesh": scenes.hex_outside(leader.state.hexes),
        "a cut": scenes.hex_cut(leader.state.hexes),
    }
    write_tiles(pictures / "found.png", shown, 3, (360, 280))
    sections = []
    for number, move in enumerate(history.moves):
        name, row = f"move_{number + 1}.png", history.table[number]
        text = [f"## {number + 1}. {row.name[0].upper()}{row.name[1:]}", _explained(move)]
        text += [] if isinstance(move, Propose) else [_outcome(row.result, row.gain)]
        if _draw(pictures / name, history, move, meshes.get(id(move))):
            text.append(f"![The result of move {number + 1}](pictures/{name})")
        sections.append("\n\n".join(text))
    head = HEAD.format(no_mesh=NO_MESH)
    parts = [head + _table(history), *sections, _tail(leader)]
    return "\n\n".join(parts).rstrip() + "\n"


def _explained(move: Move) -> str:
    return next(text for kind, text in KINDS.items() if isinstance(move, kind))


def _table(history: History) -> str:
    head = ("", "move", "expected gain", "expected work", "gain", "work", "hexes", "shortfall")
    return table(head, list(_rows(history)))


def _rows(history: History) -> Iterator[tuple[str, ...]]:
    left = NO_MESH
    for number, row in enumerate(history.table, 1):
        left -= row.gain
        values = *row.expected, row.gain, row.work
        numbers = [f"{value:.2f}" for value in values]
        yield str(number), row.name, *numbers, f"{row.hexes:,}" if row.hexes else "", f"{left:.2f}"


def _outcome(result: str, gain: float) -> str:
    """What became of a move, without the part of the verdict behind its first statements."""
    said = "; ".join(each.split(": farther")[0] for each in result.split("; first")[0].split("; "))
    return f"Result: {said}." + (f" The shortfall falls by {gain:.2f}." if gain > 0 else "")


def _draw(path: Path, history: History, move: Move, mesh: Outcome | None) -> bool:
    """Write the picture of a move, if it has a result that can be shown."""
    if mesh is not None and mesh.state.hexes is not None:
        hexes = mesh.state.hexes
        shown = {"outside": scenes.hex_outside(hexes), "inside": scenes.hex_cut(hexes)}
        write_tiles(path, shown, 2, (320, 250))
        return True
    is_coarse = isinstance(move, Propose) and move.tier == Tier.COARSE
    if is_coarse:
        write_tiles(path, _proposals(history), 4, (230, 180))
    return is_coarse


def _proposals(history: History) -> Mapping[str, scenes.Scene]:
    """The polycubes of a ranking by their numbers and methods."""
    return {
        f"{number}: {entry.candidate.proposal}, score {entry.score:.3f}": scenes.polycube_faces(
            entry.candidate.polycube, entry.candidate.rough_map
        )
        for number, entry in enumerate(history.ranked[:4])
    }


def _tail(leader: Outcome) -> str:
    goal = "The goal is met: the shortfall is 0."
    priced = f"No further move is worth its work; a shortfall of {leader.shortfall:.2f} is left."
    assert leader.state.hexes is not None
    return TAIL.format(
        why=priced if leader.shortfall > 0 else goal,
        hexes=len(leader.state.hexes.hexes),
        jacobian=leader.jacobian,
        lost=f"{leader.verdict.lost or 'none'} of the points, curves and faces of the CAD model",
    )
