"""Settings common to the stages of a meshing bundle."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

from polycube.types import TriMesh
from polycube.types.options import limits

MOST_HEXES = 100  # largest number through a wall or around a hole
FEW_AROUND, MOST_AROUND = 8, 12  # edges round a hole
SHORTEST = 3  # hex edges round a hole are at least as long as the size divided by this
Features = Literal["auto", "exact", "soft", "off"]
AcrossWall = Annotated[float, limits(1, MOST_HEXES)]
AroundHole = AcrossWall | Literal["auto"]


@dataclass(frozen=True)
class MeshingSettings:
    """Settings of a whole meshing bundle: `meshing.size` and the like.

    A length is a number in the units of the model or a share of the bounding-box diagonal, "5%".

    Parameters
    ----------
    size : wanted edge length of the hexes
    level : octree level as in the paper: 2^level parts of every interval of the polycube's lattice;
        null: the number of parts follows from `size`
    regions : boxes with smaller hexes, [{box: [x, y, z, X, Y, Z], size: 1%}]; whole slabs of hexes
        become finer
    curvature : largest chord error on curved surfaces; above it the number of hexes is raised, at
        most doubled; auto: 0.3%, or 0.2% with exact features; null: no limit
    creases : wanted distance of 95 % of the sharp edges from mesh edges; it is reached by smaller
        hexes along them, if the mesh becomes better; auto: 0.1% for triangles, else null; null: no
        limit
    deviation : wanted distance between mesh and surface, for 99 % of the points in both directions;
        the mesh is refined until it is reached; null: no refinement
    max_hexes : largest number of hexes before pillowing; a size that needs more is refused
    at : numbers of hexes at faces of the part: edges round a rim, hexes through a wall, or their
        size: [{at: hole_1, around: 16}, {at: cad_WEB, through: 3}, {at: cad_face_7, size: 1%}]
    across_wall : smallest number of hexes through every wall; the report says where max_hexes
        prevents it
    around_hole : smallest number of edges round every hole; the report says where max_hexes
        prevents it; auto: 12, but 8 to 11 where edges would be shorter than a third of `size`
    features : exact: curves of the surface are mesh edges from the first stage on, whatever the
        shape of the hexes; soft: vertices leave curves where hexes would be poor; off: curves are
        ignored; auto: exact for CAD faces, soft for triangles
    """

    size: float | str = "5%"
    level: int | None = None
    regions: Sequence[object] = ()
    curvature: float | str | None = "auto"
    creases: float | str | None = "auto"
    deviation: float | str | None = None
    max_hexes: int = 100_000
    at: Sequence[object] = ()
    across_wall: AcrossWall = 2
    around_hole: AroundHole = "auto"
    features: Features = "auto"


def edges_around(wanted: float | str, length: float = 0.0, size: float = 1.0) -> float:
    """Smallest number of edges round a hole; without its length, of any hole.

    wanted : the setting `around_hole`
    length, size : circumference of the hole, and the edge length of the hexes, in equal units
    """
    if not isinstance(wanted, str):
        return wanted
    return min(max(FEW_AROUND, SHORTEST * length / size), MOST_AROUND)


def curvature_of(value: float | str, exact: bool) -> float | str:
    """The value of the setting `curvature`; auto depends on whether features are exact."""
    return ("0.2%" if exact else "0.3%") if value == "auto" else value


def creases_of(value: float | str | None, surface: TriMesh) -> float | str | None:
    """The value of the setting `creases`; auto depends on whether the surface has CAD faces."""
    if value != "auto":
        return value
    return None if len(surface.region) else "0.1%"


def features_of(value: str, surface: TriMesh) -> str:
    """The value of the setting `features`; auto depends on whether the surface has CAD faces."""
    if value != "auto":
        return value
    return "exact" if len(surface.region) else "soft"
