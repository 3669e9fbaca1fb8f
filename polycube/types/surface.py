"""Triangle surfaces and samples of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np

from polycube.types.checks import Arrays

MOST_CAD_FACES = 10**6  # of a file; larger numbers are refused


@dataclass(frozen=True, eq=False)
class TriMesh(Arrays):
    """Closed triangle surface, oriented counter-clockwise as seen from outside.

    Parameters
    ----------
    vertices : (V, 3) coordinates in the units and the placement of the input
    faces : (F, 3) vertex numbers
    region : (F,) number of the CAD face of each triangle, starting at 1; empty without CAD faces
    region_names : names of the CAD faces; an empty string if a face has no name
    region_shapes : shapes of the CAD faces, such as plane, cylinder, cone, sphere
    region_groups : numbers of the CAD faces of each named group of the file
    region_edges : pairs of CAD faces between which each named edge of the file lies
    removed : features that were removed from the CAD model: `features`, each with `kind`, `size`
        (of a hole the diameter, of a fillet the radius), numbers of `faces`, their `names`, `place`
        and `removed`; `merged`, numbers of faces that became a part of others; `volume_before` and
        `volume_after`
    name : name of the solid; empty if there is none
    unit : length unit of the coordinates, such as mm; empty if the input states none
    """

    vertices: Annotated[np.ndarray, "V 3"]
    faces: Annotated[np.ndarray, "F 3 int"]
    region: Annotated[np.ndarray, "F? int"] = field(default_factory=lambda: np.zeros(0))
    region_names: tuple[str, ...] = ()
    region_shapes: tuple[str, ...] = ()
    region_groups: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    region_edges: Mapping[str, tuple[tuple[int, ...], ...]] = field(default_factory=dict)
    removed: Mapping[str, Any] = field(default_factory=dict)
    name: str = ""
    unit: str = ""

    bounds: ClassVar = {
        "faces": "vertices",
        "region": MOST_CAD_FACES,
        "region_groups": MOST_CAD_FACES,
        "region_edges": (MOST_CAD_FACES, MOST_CAD_FACES),
    }


@dataclass(frozen=True, eq=False)
class Frame(Arrays):
    """Similarity transform to the learning frame: u = rotation @ (x - center) / scale.

    Parameters
    ----------
    rotation : (3, 3) rotation matrix, det = 1
    center : (3,) point that is mapped to the origin, in model units
    scale : length of one unit of the frame, in model units
    """

    rotation: Annotated[np.ndarray, "3 3"]
    center: Annotated[np.ndarray, "3"]
    scale: float

    def apply(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) points of the model, in coordinates of the frame."""
        return (points - self.center) @ self.rotation.T / self.scale

    def invert(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) points of the frame, in model units and placement."""
        return points @ self.rotation * self.scale + self.center
