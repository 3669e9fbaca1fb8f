"""Triangle surfaces, and what is sampled on them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from polycube.types.checks import freeze


@dataclass(frozen=True, eq=False)
class TriMesh:
    """Closed triangle surface, counter-clockwise seen from outside, in the user's units."""

    vertices: np.ndarray  # (V, 3)
    faces: np.ndarray  # (F, 3) into vertices
    region: np.ndarray = field(
        default_factory=lambda: np.zeros(0)
    )  # (F,) CAD face, from 1, or none
    region_names: tuple[str, ...] = ()  # of these faces, in their order; "" where it has no name
    region_shapes: tuple[str, ...] = ()  # of these faces: plane, cylinder, cone, sphere ...

    def __post_init__(self) -> None:
        freeze(
            self,
            vertices=("V 3", np.float64),
            faces=("F 3", np.int64),
            region=("F" if len(self.region) else "0", np.int64),
        )


@dataclass(frozen=True, eq=False)
class Frame:
    """Similarity to the learning frame: u = rotation @ (x - center) / scale."""

    rotation: np.ndarray  # (3, 3), det +1
    center: np.ndarray  # (3,)
    scale: float

    def __post_init__(self) -> None:
        freeze(self, rotation=("3 3", np.float64), center=("3", np.float64))

    def apply(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) model points in the frame's coordinates."""
        return (points - self.center) @ self.rotation.T / self.scale

    def invert(self, points: np.ndarray) -> np.ndarray:
        """(N, 3) points of the frame back in model units and placement."""
        return points @ self.rotation * self.scale + self.center


@dataclass(frozen=True, eq=False)
class PointImage:
    """N = height * width sample points of a surface as a picture (paper, section 3.2)."""

    pixels: np.ndarray  # (3, height, width) float32
    order: np.ndarray  # (N,) sample shown at each pixel, row by row; -1 where padded
    context: np.ndarray  # (29,) for a 2x1 grid with four primitives
    frame: Frame

    def __post_init__(self) -> None:
        freeze(
            self,
            pixels=("3 H W", np.float32),
            order=("N", np.int64),
            context=("K", np.float32),
        )
