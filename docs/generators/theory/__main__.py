"""Write the pictures of the theory, and the page that follows one part through the search:

    python -m docs.generators.theory docs

takes some minutes.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from docs.generators.sheet import sheet
from docs.generators.theory import diffusion, figures, parts
from docs.generators.theory.search import page, searched
from polycube.io.atomic import atomic_write


def write(folder: Path) -> None:
    """Write all pictures into `folder/theory/pictures`, and the page beside them."""
    pictures = folder / "theory" / "pictures"
    pictures.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as name:
        scratch = Path(name)
        block = parts.write(parts.valve_block, scratch / "valve_block.step")
        history, state = searched(str(block), "order=[meshing]")
        with atomic_write(folder / "theory" / "how_a_mesh_is_found.md") as temporary:
            temporary.write_text(page(history, pictures), encoding="utf-8")
        assert state.hexes is not None
        figures.paths(pictures / "paths.png", state.surface, state.hexes)
        figures.structures(pictures / "structures.png", scratch)
        figures.answer(pictures / "answer.png", scratch)
    figures.stages(pictures / "stages.png")
    figures.chain(pictures / "chain.png")
    figures.splines(pictures / "splines.png")
    diffusion.forward(pictures / "forward.png")
    diffusion.backward(pictures / "backward.png")
    sheet(pictures / "pairs.png", rows=2)


if __name__ == "__main__":
    write(Path(sys.argv[1]))
