from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from polycube.registry import register
from polycube.types import HexMesh


@register("export", "points")
@dataclass(frozen=True)
class Points:
    """The vertices, a row for each (.xyz)."""

    suffix: ClassVar[str] = ".xyz"

    def __call__(self, hexes: HexMesh, path: Path) -> Path:
        path = path.with_suffix(self.suffix)
        np.savetxt(path, hexes.vertices)
        return path
