"""CAD features of lattices: round holes, fillets, chamfers, slanted faces, draft."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polycube.diffusion.pairs.edge_runs import EdgeRuns, edge_runs
from polycube.diffusion.pairs.lattices import Feature, Lattice
from polycube.diffusion.pairs.round_sections import with_round_section
from polycube.diffusion.pairs.rounding import CHAMFER, FILLET, Fillets, largest_radii, rounded
from polycube.types import PerAxis

DISCS = ("hole", "blind hole", "boss")  # a circle in a square; slots get round ends
FLAT = 0.6  # share of parts whose main axis is their shortest axis
FULL = 0.8  # of the largest radius: limit for a fillet that does not form a circle


@dataclass(frozen=True)
class CadShapes:
    """Frequencies of CAD features; shares between 0 and 1 unless described otherwise.

    Parameters
    ----------
    rounds : share of the holes, blind holes and bosses that are round
    turned : share of the parts whose whole section is round
    corners : share of the parts with round corners, seen along their main axis
    radius : largest radius of such corners, in units of the learning frame
    edges : share of the kinds of other edges of a part that have a fillet or a chamfer
    edge_radius : their largest size, in units of the learning frame
    chamfers : share of chamfers among the fillets and chamfers
    slants : share of the parts with one or two slanted planes
    slant : largest slant at an end of a plane, relative to the distance of the next knot; below 0.5
    drafts : share of the parts with a draft along their main axis
    draft : largest draft, as a share of the section, at each end
    """

    rounds: float = 0.8
    turned: float = 0.12
    corners: float = 0.4
    radius: float = 0.6
    edges: float = 0.3
    edge_radius: float = 0.15
    chamfers: float = 0.5
    slants: float = 0.35
    slant: float = 0.45
    drafts: float = 0.15
    draft: float = 0.12

    def round_features(self, lattice: Lattice, rng: np.random.Generator) -> list[Feature]:
        """The features that become round if there is room; equal for the same kind and size.

        The part as a whole may be one of them.
        """
        style: dict[tuple[object, ...], bool] = {}
        chosen = []
        for each in lattice.features:
            size = tuple(np.subtract(each.high, each.low).tolist())
            is_round = style.setdefault((each.kind, *size), bool(rng.random() < self.rounds))
            chosen += [each] if is_round and each.kind in (*DISCS, "slot") else []
        if rng.random() < self.turned:
            whole = Feature("boss", (0, 0, 0), lattice.occupancy.shape, int(rng.integers(3)))
            chosen.append(whole)
        return chosen

    def shaped(
        self,
        vertices: np.ndarray,
        lattice: Lattice,
        knots: PerAxis,
        rounds: Sequence[Feature],
        rng: np.random.Generator,
    ) -> np.ndarray:
        """(V, 3) points of the surface of the lattice between the knots, with CAD features."""
        edges = edge_runs(lattice.occupancy, knots)
        lengths = [each[-1] - each[0] for each in knots]
        main = int(np.argmin(lengths) if rng.random() < FLAT else rng.integers(3))
        fillets = self._fillets(edges, main, rng)
        for feature in rounds:
            fillets = with_round_section(fillets, feature, knots)
        x = rounded(vertices, fillets)
        if rng.random() < self.slants:
            x = self._slanted(x, knots, rng)
        return self._drafted(x, main, rng) if rng.random() < self.drafts else x

    def _fillets(self, edges: EdgeRuns, main: int, rng: np.random.Generator) -> Fillets:
        """Fillets and chamfers, equal for all edges of a kind."""
        radius, norm = np.zeros(len(edges.axis)), np.full(len(edges.axis), FILLET)
        is_along = edges.axis == main
        for is_kind, share, largest in (
            (is_along & edges.is_convex, self.corners, self.radius),
            (is_along & ~edges.is_convex, self.edges, self.edge_radius),
            (~is_along & edges.is_convex, self.edges, self.edge_radius),
            (~is_along & ~edges.is_convex, self.edges, self.edge_radius),
        ):
            if rng.random() < share:
                radius[is_kind] = largest * rng.uniform(0.2, 1)
                norm[is_kind] = CHAMFER if rng.random() < self.chamfers else FILLET
        return Fillets(edges, np.minimum(radius, FULL * largest_radii(edges)), norm)

    def _slanted(self, x: np.ndarray, knots: PerAxis, rng: np.random.Generator) -> np.ndarray:
        """One or two knot planes displaced by a linear function of the position in them."""
        places = x / [max(abs(each[0]), abs(each[-1])) for each in knots]  # -1 to 1
        moved = x.copy()
        for _ in range(rng.integers(1, 3)):
            axis = int(rng.integers(3))
            number = int(rng.integers(len(knots[axis])))
            around = knots[axis][max(number - 1, 0) : number + 2]
            along = np.delete(np.arange(3), axis)[rng.integers(2)]
            size = self.slant * rng.uniform(-1, 1) * np.diff(around).min()
            weight = np.interp(x[:, axis], around, around == knots[axis][number])
            moved[:, axis] += size * weight * places[:, along]
        return moved

    def _drafted(self, x: np.ndarray, main: int, rng: np.random.Generator) -> np.ndarray:
        """Sections along the main axis scaled linearly from end to end."""
        x, place = x.copy(), x[:, main] / np.abs(x[:, main]).max()
        x[:, np.arange(3) != main] *= 1 + self.draft * rng.uniform(-1, 1) * place[:, None]
        return x
