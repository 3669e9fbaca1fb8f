"""The kinds of plugin, and how the stages chain.  Read this page first.

kind = Hydra group = folder = test name.  A plugin is a frozen dataclass of its options with one
typed method, `__call__`; a stage kind also says what it takes and what it gives.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from polycube.errors import InputError


@dataclass(frozen=True)
class Kind:
    """What a plugin of this kind does, and for a stage what it takes and gives."""

    does: str
    takes: tuple[str, ...] = ()
    gives: str = ""
    once: bool = False  # at the end of a chain: on the best mesh of the portfolio alone


KINDS = {
    # the learning half
    "primitive": Kind("voxels of a unit cell: () -> (3, 3, 3) bool"),
    "schedule": Kind("noise schedule: () -> alpha_bar (T + 1,), from 1 down"),
    "model": Kind("network: (channels, outputs, context_length, image) -> torch module"),
    "sampler": Kind("reverse diffusion: x_T -> x_0, with the states kept for the trajectory"),
    "data": Kind("training pairs: endless, seeded (geometry, polycube, labels, context)"),
    # the stages of a run, in their natural order
    "structure": Kind("propose polycubes", ("surface", "candidates"), "candidates"),
    "regularize": Kind("a regular polycube from noisy points", ("candidate", "points"), "points"),
    "meshing/segment": Kind(
        "label the surface", ("surface", "polycube", "parametrization"), "labels"
    ),
    "meshing/map": Kind(
        "bring the polycube onto the surface, chart by chart",
        ("surface", "polycube", "labels", "parametrization", "rough_map"),
        "rough_map",
    ),
    "meshing/subdivide": Kind(
        "hexes of the polycube, placed", ("surface", "polycube", "rough_map"), "hexes"
    ),
    "meshing/smooth": Kind("untangle and fit to the surface", ("surface", "hexes"), "hexes"),
    "meshing/pillow": Kind("a layer under the boundary", ("surface", "hexes"), "hexes"),
    "meshing/optimize": Kind("raise the worst hex", ("surface", "hexes"), "hexes"),
    "meshing/refine": Kind(
        "finer hexes, nearer to the surface", ("surface", "hexes"), "hexes", once=True
    ),
    "spline": Kind("volumetric spline on the hexes", ("surface", "hexes"), "spline"),
    "analysis": Kind("solve on the spline", ("spline",), "solution"),
    # what comes out
    "export": Kind("write the hex mesh in a solver's format: (hexes, path) -> the file"),
}


def check_chain(order: Iterable[str], have: Iterable[str]) -> None:
    """Raise InputError naming the first stage of `order` that lacks an input, and what to do."""
    present = set(have)
    for stage in order:
        if stage not in KINDS or not KINDS[stage].gives:
            stages = ", ".join(name for name, kind in KINDS.items() if kind.gives)
            raise InputError(f"{stage!r} is no stage; the stages are {stages}")
        missing = [name for name in KINDS[stage].takes if name not in present]
        if missing:
            makers = [
                name
                for name, kind in KINDS.items()
                if kind.gives in missing and kind.gives not in kind.takes
            ]
            hint = f"; put {' or '.join(makers)} before it" if makers else ""
            raise InputError(
                f"stage {stage!r} needs {', '.join(missing)}, which no earlier stage makes{hint}"
            )
        present.add(KINDS[stage].gives)
