"""The data that flows: surface, polycube, candidate, labels, hexes, spline, solution.

Frozen, checked, read-only: a stage takes some of these and gives one.  Arrays are float64 and
int64; equal letters in the shapes mean equal lengths.  Lengths are in the user's units and
placement, except on the polycube, whose cell edge is 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csr_matrix

AXES = ("+x", "-x", "+y", "-y", "+z", "-z")  # the axis labels 0..5


def freeze(obj: object, **specs: tuple[str, type]) -> None:
    """Check and lock array fields; equal letters mean equal lengths.

    specs : field name -> (dimensions such as "V 3", dtype); raises ValueError with the shape met.
    """
    sizes: dict[str, int] = {}
    for name, (dims, dtype) in specs.items():
        array = np.array(getattr(obj, name), dtype=dtype)  # own copy
        letters = dims.split()
        wanted = f"{type(obj).__name__}.{name} must have shape ({', '.join(letters)})"
        if array.ndim != len(letters):
            raise ValueError(f"{wanted}; got {array.shape}")
        for letter, size in zip(letters, array.shape, strict=True):
            if sizes.setdefault(letter, int(letter) if letter.isdigit() else size) != size:
                same = "" if letter.isdigit() else f" with {letter}={sizes[letter]}"
                raise ValueError(f"{wanted}{same}; got {array.shape}")
        array.flags.writeable = False
        object.__setattr__(obj, name, array)


@dataclass(frozen=True, eq=False)
class TriMesh:
    """Closed triangle surface, counter-clockwise seen from outside, in the user's units."""

    vertices: np.ndarray  # (V, 3)
    faces: np.ndarray  # (F, 3) into vertices
    region: Sequence[int] = ()  # (F,) face of the CAD model, from 1; empty where there is none
    region_names: tuple[str, ...] = ()  # of these faces, in their order; "" where it has no name

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


@dataclass(frozen=True, eq=False)
class Polycube:
    """Union of axis-aligned boxes on a rectilinear lattice; the one source of its faces and genus.

    Box (i, j, k) fills [x_i, x_i+1] x [y_j, y_j+1] x [z_k, z_k+1]; a grid cell has edge 1.
    """

    occupancy: np.ndarray  # (X, Y, Z) bool
    x: np.ndarray  # (X + 1,) knots, ascending
    y: np.ndarray
    z: np.ndarray
    grid: tuple[int, int, int]
    context: tuple[str | None, ...]  # primitive per grid cell, x slowest; None where empty

    def __post_init__(self) -> None:
        freeze(self, occupancy=("X Y Z", bool))
        for name, size in zip("xyz", self.occupancy.shape, strict=True):
            freeze(self, **{name: (str(size + 1), np.float64)})
            if (np.diff(getattr(self, name)) <= 0).any():
                raise ValueError(f"Polycube.{name} must ascend; got {getattr(self, name)}")
        if len(self.context) != np.prod(self.grid):
            raise ValueError(
                f"Polycube.context must name {np.prod(self.grid)} cells of grid {self.grid}; "
                f"got {self.context}"
            )

    @property
    def knots(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The three knot vectors."""
        return self.x, self.y, self.z


@dataclass(frozen=True, eq=False)
class RoughMap:
    """Where points of a polycube lie in the model, roughly: trilinear between control positions."""

    x: np.ndarray  # (X,) polycube coordinates of the control planes, ascending
    y: np.ndarray  # (Y,)
    z: np.ndarray  # (Z,)
    positions: np.ndarray  # (X, Y, Z, 3) in the user's units

    def __post_init__(self) -> None:
        freeze(
            self,
            x=("X", np.float64),
            y=("Y", np.float64),
            z=("Z", np.float64),
            positions=("X Y Z 3", np.float64),
        )


@dataclass(frozen=True, eq=False)
class Candidate:
    """A proposed structure: a polycube and a rough map from it to the model."""

    proposal: str  # the structure plugin that made it
    polycube: Polycube
    rough_map: RoughMap
    cost: float  # the proposal's own, smaller is better; comparable within one proposal
    key: str  # equal for equal structures in equal orientation
    trajectory: np.ndarray | None = None  # (S, N, 3) x_T ... x_0 of a denoising, polycube units
    probability: float | None = None  # of the structure, in its frame, by a trained classifier
    steps: tuple[int, ...] = ()  # (S,) t of each state of the trajectory
    family: str = "grid"  # of structures that fail alike: contexts of a grid, or free lattices


@dataclass(frozen=True, eq=False)
class Labels:
    """Polycube face that each face of the input surface belongs to."""

    axis: np.ndarray  # (F,) 0..5, see AXES
    patch: np.ndarray  # (F,) maximal planar connected face of the polycube

    def __post_init__(self) -> None:
        freeze(self, axis=("F", np.int64), patch=("F", np.int64))


@dataclass(frozen=True, eq=False)
class Parametrization:
    """Where each input vertex lies on the polycube."""

    positions: np.ndarray  # (V, 3), cell edge 1

    def __post_init__(self) -> None:
        freeze(self, positions=("V 3", np.float64))


@dataclass(frozen=True, eq=False)
class HexMesh:
    """All-hex mesh; VTK vertex order, and no other order inside the project.

            7--------6        zeta
           /|       /|         |
          4--------5 |         |  eta
          | 3------|-2         | /
          |/       |/          |/
          0--------1           o---- xi

    `quads` are the boundary faces, counter-clockwise from outside, and `patch` the polycube face
    each came from; `cell` is the grid cell of each hex and `primitives` what fills each grid cell.
    `geometry.hexes.hex_mesh` fills them in.  `warnings` say what was asked for and not to be had.
    `sets` name parts of the boundary; `geometry.patches.boundary_sets` finds them at the end.
    """

    vertices: np.ndarray  # (V, 3)
    hexes: np.ndarray  # (H, 8) into vertices
    quads: np.ndarray  # (Q, 4) into vertices
    patch: np.ndarray  # (Q,)
    cell: np.ndarray  # (H,)
    primitives: tuple[str | None, ...] = ()  # of each grid cell; empty where it is not known
    warnings: tuple[str, ...] = ()  # a sentence each
    sets: Mapping[str, np.ndarray] = field(default_factory=dict)  # quads (N,) by name

    def __post_init__(self) -> None:
        freeze(
            self,
            vertices=("V 3", np.float64),
            hexes=("H 8", np.int64),
            quads=("Q 4", np.int64),
            patch=("Q", np.int64),
            cell=("H", np.int64),
        )


@dataclass(frozen=True, eq=False)
class Ranked:
    """A candidate, its score and the coarse mesh that was used to judge it."""

    candidate: Candidate
    score: float  # smaller is better
    numbers: dict[str, float]  # the terms of the score
    hexes: HexMesh  # coarse, registered, in model units
    positions: np.ndarray  # (V, 3) polycube position of each vertex of the hexes


@dataclass(frozen=True)
class Verdict:
    """What an acceptance says of a hex mesh."""

    failures: tuple[str, ...]  # why the mesh is not valid, a sentence each
    warnings: tuple[str, ...]  # why a user should look at a valid mesh, a sentence each
    key: tuple[float, ...]  # to choose by: the larger mesh is the better one
    reaches: float  # scaled Jacobian of a mesh that misses nothing else; -inf otherwise

    @property
    def is_valid(self) -> bool:
        """Whether the mesh may be used at all."""
        return not self.failures


@dataclass(frozen=True, eq=False)
class Spline:
    """Tricubic volumetric spline as Bezier elements.

    The Bezier points of element e are `(extraction @ control)[nodes[e]]`, in the order
    i + 4 j + 16 k, i fastest: neighbours of one level share nodes, so the solid is watertight.
    `sides` are the faces on the boundary, 0 to 5 for -xi +xi -eta +eta -zeta +zeta, and `patch`
    the polycube face that each came from.
    """

    control: np.ndarray  # (C, 3), one spline function each
    extraction: csr_matrix  # (B, C), rows sum to 1
    nodes: np.ndarray  # (E, 64) into the B Bezier nodes
    element_hex: np.ndarray  # (E,) hex each element came from
    level: np.ndarray  # (E,) of refinement: the hex halved so often
    sides: np.ndarray  # (Q, 2) element and face of it
    patch: np.ndarray  # (Q,)
    extraordinary_edges: int = 0
    sets: Mapping[str, np.ndarray] = field(default_factory=dict)  # numbers of sides (N,) by name

    def __post_init__(self) -> None:
        freeze(
            self,
            control=("C 3", np.float64),
            nodes=("E 64", np.int64),
            element_hex=("E", np.int64),
            level=("E", np.int64),
            sides=("Q 2", np.int64),
            patch=("Q", np.int64),
        )

    def element_functions(self) -> ElementFunctions:
        """Extraction operators of all elements, functions that vanish there left out."""
        n_functions = self.extraction.shape[1]
        rows = self.extraction[self.nodes.ravel()].tocoo()
        element, node = np.divmod(rows.row.astype(np.int64), 64)
        pairs, row = np.unique(element * n_functions + rows.col, return_inverse=True)
        element, functions = np.divmod(pairs, n_functions)
        return ElementFunctions(
            offsets=np.searchsorted(element, np.arange(len(self.nodes) + 1)),
            functions=functions,
            coefficients=csr_matrix((rows.data, (row, node)), (len(pairs), 64)),
        )


@dataclass(frozen=True, eq=False)
class ElementFunctions:
    """The spline functions of each element and their Bezier coefficients there.

    Rows offsets[e] to offsets[e + 1] belong to element e, its functions ascending.
    """

    offsets: np.ndarray  # (E + 1,)
    functions: np.ndarray  # (R,) into the C control points
    coefficients: csr_matrix  # (R, 64)


@dataclass(frozen=True, eq=False)
class Modes:
    """Vibration modes, ascending."""

    eigenvalues: np.ndarray  # (K,) omega^2 in 1/time^2
    shapes: np.ndarray  # (K, C, 3) displacement of each control point, mass-normalised
    mass: float
    units: dict[str, str] = field(default_factory=dict)  # of length, mass, time, frequency
    rigid: int = 6  # of them, the first ones, are motions that deform nothing

    def __post_init__(self) -> None:
        freeze(self, eigenvalues=("K", np.float64), shapes=("K C 3", np.float64))

    @property
    def frequency(self) -> np.ndarray:
        """(K,) cycles per unit of time; rounding below zero counts as zero."""
        return np.sqrt(np.maximum(self.eigenvalues, 0)) / (2 * np.pi)


@dataclass(frozen=True, eq=False)
class Deformation:
    """Elastic solid at rest under load.  Stresses are Bezier coefficients, as the geometry's."""

    displacement: np.ndarray  # (C, 3) of the control points, in the part's length unit
    stress: np.ndarray  # (B, 6) xx yy zz yz zx xy
    von_mises: np.ndarray  # (B,)
    supports: tuple[str, ...]
    reactions: np.ndarray  # (S, 3) force of each support on the solid
    load: np.ndarray  # (3,) resultant of everything applied
    strain_energy: float
    mass: float
    units: dict[str, str] = field(default_factory=dict)  # of length, stress, force, energy, mass

    def __post_init__(self) -> None:
        freeze(
            self,
            displacement=("C 3", np.float64),
            stress=("B 6", np.float64),
            von_mises=("B", np.float64),
            reactions=("S 3", np.float64),
            load=("3", np.float64),
        )


@dataclass(frozen=True, eq=False)
class Potential:
    """Solution u of -div k grad u = f, such as a temperature, and its flux -k grad u."""

    values: np.ndarray  # (C,) of the control points
    flux: np.ndarray  # (B, 3) Bezier coefficients, as the geometry's
    supports: tuple[str, ...]  # where u is given
    flows: np.ndarray  # (S,) into the solid through each
    supplied: float  # into the solid by everything else, sources and given fluxes
    units: dict[str, str] = field(default_factory=dict)  # of length, u, flux, flow

    def __post_init__(self) -> None:
        freeze(
            self,
            values=("C", np.float64),
            flux=("B 3", np.float64),
            flows=("S", np.float64),
        )


Solution = Modes | Deformation | Potential  # what an analysis may give
