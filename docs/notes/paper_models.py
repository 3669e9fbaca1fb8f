"""The test models of the paper by its own method, from the user's context to hexes.

    python docs/notes/paper_models.py WEIGHTS FOLDER [NAME ...]

FOLDER has the surfaces of the authors, such as ddpm_eight.obj; models without a file there are the
examples of this program.  For each model, the part is placed as by `structure=given`, in the
cheapest placement.  Algorithm 2 is applied, and its result is compared with the template of the
context: point by point, and by the nearest vertex, in cells; "untouched" is the same for the points
of the part.  Then `structure=paper` makes a hex mesh.
One line of a table is printed for each.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

import polycube
from polycube.diffusion.denoiser import Denoiser
from polycube.diffusion.encoding import by_x
from polycube.diffusion.pairs.pairs import MeshPairs
from polycube.diffusion.weights import load_denoiser
from polycube.errors import InputError, MeshingError
from polycube.examples.parts import example
from polycube.io.surfaces import read_surface
from polycube.pipeline.primitives import voxels
from polycube.plugins.structure.learned.denoising import _rotation, best_of_each
from polycube.plugins.structure.learned.hypotheses import sample
from polycube.registry import build
from polycube.types import TriMesh

GRID = (2, 1, 1)
CONTEXTS = {  # of the published figures, in the directions in which these surfaces lie
    "dice": ["cube"],
    "ring": ["hole_z"],
    "rod": ["cube", "hole_z"],
    "lantern": ["hole_x", "hole_z"],
    "eight": ["hole_z", "hole_z"],
    "key": ["cube", "hole_y"],
    "barrel": ["cube", "hole_x"],
    "megaphone": ["hole_x", "hole_x"],
    "cup": ["hole_y", "hole_z"],
}
HEAD = "model, file|context|trained|untouched|point by point|nearest|hexes|SJ|CPU s"


def main(weights: str, folder: Path, names: list[str]) -> None:
    """Print a line for each model."""
    denoiser = load_denoiser(build, weights)
    sys.stdout.write(f"| {' | '.join(HEAD.split('|'))} |\n")
    for name in names or CONTEXTS:
        found = sorted(folder.glob(f"ddpm_{name}.*"))
        source: object = found[0] if found else f"example:{name}"
        surface = read_surface(found[0])[0] if found else example(name)
        context = CONTEXTS[name]
        kind = "yes" if len(context) == 1 or context == ["cube", "cube"] else "no"
        row = [f"{name}, {found[0].name if found else 'example'}", ", ".join(context), kind]
        row += [f"{distance:.3f}" for distance in distances(denoiser, surface, context)]
        sys.stdout.write(f"| {' | '.join([*row, *meshed(source, context, weights)])} |\n")
        sys.stdout.flush()


def distances(denoiser: Denoiser, surface: TriMesh, context: list[str]) -> list[float]:
    """Distance of the part, and of the result point by point and to the nearest vertex."""
    solids = voxels(denoiser.condition.cells)
    given = build(
        "structure", {"plugin": "given", "context": context}, grid=GRID, primitives=solids
    )
    best = best_of_each(given(surface, ()))[0]
    filled, turn = best.polycube.context, _rotation(best)
    template = MeshPairs(GRID, solids, [filled], 3.0)(0)
    used = denoiser.pixels(filled)
    points, normals = sample(surface, len(used), np.random.default_rng(0))
    placed = denoiser.frame(surface.vertices, turn, filled).apply(points)
    sampler = build("sampler", {"plugin": "ddpm"})
    x_0 = denoiser.denoise(placed[None], normals[None] @ turn.T, [filled], sampler, 0).points[0]
    x_0 = x_0 - denoiser.condition.origin
    wanted = template.polycube[np.argsort(by_x(template.geometry))]
    along = np.argsort(by_x(placed))
    apart = [np.linalg.norm(x[along] - wanted, axis=1).mean() for x in (placed, x_0)]
    return [*apart, float(cKDTree(wanted).query(x_0)[0].mean())]


def meshed(source: object, context: list[str], weights: str) -> list[str]:
    """Hexes, smallest scaled Jacobian and CPU seconds of `structure=paper`."""
    began = time.process_time()
    options = {"context": context, "order": ["meshing"]}
    try:
        result = polycube.mesh(source, "structure=paper", f"ckpt={weights}", **options)
        numbers = result.report["hex"]
        own = [str(len(result.hexes.hexes)), f"{numbers['min_scaled_jacobian']:.2f}"]
    except (InputError, MeshingError) as error:
        own = ["–", str(error).partition(";")[0]]
    return [*own, f"{time.process_time() - began:.0f}"]


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), sys.argv[3:])
