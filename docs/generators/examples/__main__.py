"""Write the example parts of the program:

    python -m docs.generators.examples polycube/examples

writes an .npz file of vertices and faces for each of them.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from docs.generators.examples.parts import PARTS, surface_of
from polycube.io.atomic import atomic_write


def write(folder: Path) -> None:
    """Write all parts into a folder."""
    for name in PARTS:
        surface = surface_of(name)
        with atomic_write(folder / f"{name}.npz") as temporary:
            np.savez_compressed(temporary, vertices=surface.vertices, faces=surface.faces)


if __name__ == "__main__":
    write(Path(sys.argv[1]))
