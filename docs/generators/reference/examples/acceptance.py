from dataclasses import dataclass

from polycube.kinds import Acceptance
from polycube.registry import register
from polycube.types import HexMesh, TriMesh, Verdict


@register("acceptance", "worst_hex")
@dataclass(frozen=True)
class WorstHex(Acceptance):
    """A mesh near the surface is valid; the one with the better worst hex is better.

    Parameters
    ----------
    wanted : scaled Jacobian that meets the goal
    """

    wanted: float = 0.3

    def __call__(self, hexes: HexMesh, surface: TriMesh) -> Verdict:
        from polycube.hexmesh.quality import deviation
        from polycube.hexmesh.scaled_jacobian import scaled_jacobian

        worst = float(scaled_jacobian(hexes.vertices, hexes.hexes).min())
        off = deviation(hexes, surface).vertices
        failures = ["a hex is inverted"] * (worst <= 0) + ["it is off the surface"] * (off > 0.05)
        left = {"scaled_jacobian": self.wanted - worst} if worst < self.wanted else {}
        shortfall = {"validity": 2.0} if failures else left
        return Verdict(tuple(failures), (), (-len(failures), worst), shortfall)
