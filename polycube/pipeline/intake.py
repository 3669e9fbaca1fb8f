"""Read the surface of a run, and repair it on request."""

from dataclasses import asdict
from functools import partial

import numpy as np

from polycube.errors import InputError
from polycube.hexmesh.named_sets import cad_sets, face_set
from polycube.io.surfaces import read_repaired
from polycube.pipeline.settings import Settings
from polycube.stages import Clock
from polycube.state import RunState
from polycube.surface.curves.acute import SHARP, acute
from polycube.types import TriMesh


def read_part(settings: Settings, clock: Clock) -> RunState:
    """Read the surface of `mesh`; raises InputError."""
    if settings.mesh is None:
        raise InputError("no surface given: use mesh=part.stl, or mesh=example:rod for an example")
    path = settings.mesh
    reader = partial(read_repaired, path, settings.cad, settings.repair, settings.points)
    read = clock.run("read", reader)
    notes = [*cad_sets(read.surface).renamed(), *sharp_places(read.surface)]
    return RunState(
        read.surface,
        path=path,
        warnings=(*read.warnings, *(f"{path}: {sentence}" for sentence in notes)),
        repair=None if read.repair is None else asdict(read.repair),
        points=None if read.points is None else asdict(read.points),
    )


def sharp_places(surface: TriMesh) -> list[str]:
    """A sentence about edges and corners that no good hex can follow; empty if there are none."""
    found = acute(surface)
    if not found:
        return []
    counts = [(kind, sum(each.kind == kind for each in found)) for kind in ("edge", "corner")]
    named = " and ".join(f"{n} {kind}{'s' * (n > 1)}" for kind, n in counts if n)
    least = found[0]
    faces = " and ".join(face_set(surface, face) for face in least.faces if face)
    where = f"{faces} at " if faces else "at "
    place = ", ".join(f"{value:.4g}" for value in least.place)
    return [
        f"{named} of the part {'is' if len(found) == 1 else 'are'} sharper than "
        f"{np.degrees(SHARP):.0f} degrees; the sharpest has {np.degrees(least.angle):.1f} degrees, "
        f"{where}({place}), so a hex there has a scaled Jacobian of "
        f"{np.sin(least.angle):.2f} at most"
    ]
