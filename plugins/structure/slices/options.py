"""Options of the plugins that align slices of the part with patterns."""

from dataclasses import dataclass

from polycube.structure.primitives import OnGrid


@dataclass(frozen=True)
class Costs:
    """Weights of the alignment of slices with a pattern.

    Parameters
    ----------
    missing : share of a slice's area that a hole or gap must have to count
    concave : cost per enclosed area that the pattern does not explain
    ragged : cost per area of a bounding box that its piece does not fill
    direction : cost of two bars that are not parallel, as a share of a slice's area
    overlap : cost of two bars without a straight gap between them, as a share of a slice's area
    letter : cost of each slab pattern that makes no hole, as a share of the volume
    blind : gain that a blind hole must bring, in costs of a slab pattern
    shortest : smallest number of slices of a slab pattern
    """

    missing: float = 0.10
    concave: float = 0.5
    ragged: float = 0.10
    direction: float = 0.3
    overlap: float = 0.2
    letter: float = 0.012
    blind: float = 1.5
    shortest: int = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class SliceOptions(OnGrid, Costs):
    """Common options of the plugins of this package.

    Parameters
    ----------
    resolution : voxels along the longest side of the part
    frames : largest number of coordinate frames that are tried
    """

    resolution: int = 96
    frames: int = 3
