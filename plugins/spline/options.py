"""Common options of the spline plugins: sharp features, local refinement, fit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np

from polycube.analysis.problem import Cyclic
from polycube.registry import BY_RUN, setting
from polycube.spline.fit import Fit
from polycube.spline.spaces.selection import Refinement
from polycube.types.checks import options_of
from polycube.types.options import limits

Angle = Annotated[float, limits(0, 180, is_open=True)]


@dataclass(frozen=True)
class SplineOptions:
    """A spline on the hexes; its solid is that of the h2s construction.

    In this construction, det J is 0 along a smooth boundary edge with a single hex, and where a
    sharp curve follows two edges of one face. Therefore `single_hex_edges` makes the former sharp
    and the latter corners. `sharp: auto` also keeps creases, except those that end in the smooth
    surface, whose free end would protrude, and those that would make det J too small, mostly
    concave ones. If the spline is fitted, which may improve det J, these are tried as well, if
    necessary with straight hexes around them; the best of these splines is taken. Edges given by
    the user are always sharp. The border of supports and loads of the analysis is sharp if
    possible: inside a smooth surface, a support would also constrain the slope and curvature of the
    functions there.

    Parameters
    ----------
    sharp : creases: auto (by angle, where det J allows it), none, [[a, b], ...] or a file of
        vertices
    angle : angle in degrees; an edge between boundary faces with a larger angle is a crease, and a
        larger kink of a crease is a corner
    cad_angle : angle in degrees; on a CAD model, only curves at which two faces turn by more are
        creases
    single_hex_edges : whether boundary edges of a single hex are sharp; if they were smooth, det J
        would be 0 there
    held : places whose borders are sharp if det J allows it; the supports of the analysis
    cyclic : the cut faces of this sector are made equal; the cyclic symmetry of the analysis
    refine : local refinement; elements are numbered as the hexes are after `levels`
    fit : move control points until the boundary follows the surface
    """

    sharp: str | list[list[int]] = "auto"
    angle: Angle = 45.0
    cad_angle: Angle = 10.0
    single_hex_edges: bool = True
    held: Sequence[object] = setting("analysis.fixed", ())
    cyclic: Mapping[str, object] | None = setting("analysis.cyclic", None)
    refine: Refinement = field(default_factory=Refinement)
    fit: Fit = field(default_factory=Fit)
    # edges (S, 2) of a solid of an assembly: always sharp, and sharp if det J allows it
    joined: tuple[np.ndarray, np.ndarray] | None = field(default=None, metadata=BY_RUN)

    def __post_init__(self) -> None:
        from polycube.analysis.boundary_sets import check_place
        from polycube.analysis.supports import split

        if not isinstance(self.sharp, str):
            if not all(np.shape(edge) == (2,) for edge in self.sharp):
                raise ValueError(f"sharp edges must be pairs of vertices; got {self.sharp}")
        elif self.sharp not in ("auto", "none") and not Path(self.sharp).is_file():
            what = "sharp must be auto, none, a list of edges or a file of edges"
            raise ValueError(f"{what}; got {self.sharp!r}")
        for item in self.held:
            check_place(split(item)[0])
        object.__setattr__(self, "refine", options_of("refine", Refinement, self.refine))
        object.__setattr__(self, "fit", options_of("fit", Fit, self.fit))

    @property
    def sector(self) -> Cyclic | None:
        """The cyclic symmetry of the analysis, if it has one."""
        return None if self.cyclic is None else options_of("cyclic", Cyclic, self.cyclic)
