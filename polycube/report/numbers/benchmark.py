"""What the page of a benchmark compares: the parts of a batch, and their totals."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import mean, median

from polycube.hexmesh.feature_distances import TOLERANCE
from polycube.report.numbers.features import KINDS
from polycube.types import Json

ROW, REPORT = "row.json", "report.json"  # of a part, in its folder
LEAST = (0.2, 0.3, 0.5)  # scaled Jacobians that parts are counted by
PUBLISHED = {  # Beaufort et al., "Hex Me If You Can", 2022, abstract
    "parts": 189,
    "everything kept": 19,
    "points kept, %": 70.9,
    "curves kept, %": 48.5,
    "faces kept, %": 34.6,
}


@dataclass(frozen=True)
class PartResult:
    """How one part of a batch ended.

    Parameters
    ----------
    name : of its folder
    row : what the batch says of it, `row.json`
    features : "features" of the hex mesh in `report.json`; empty where the part is no CAD model
    """

    name: str
    row: Json
    features: Json

    @property
    def is_valid(self) -> bool:
        """Whether there is a valid mesh."""
        return self.row["result"] == "valid"

    @property
    def least(self) -> float:
        """Smallest scaled Jacobian; 0 without a mesh."""
        return self.row.get("min_scaled_jacobian", 0.0)

    @property
    def lost(self) -> dict[str, int]:
        """Number of lost features of each kind; empty where nothing is known of them."""
        return {kind: self.features[f"{kind}s"]["lost"] for kind in KINDS if self.features}

    @property
    def keeps_everything(self) -> bool:
        """Whether a CAD part has a valid mesh that loses none of its features."""
        return self.is_valid and bool(self.features) and not any(self.lost.values())

    @property
    def farthest(self) -> float | None:
        """Distance that 99 % of the points keep, the larger of both ways, % of the diagonal."""
        ways = [
            self.row.get(f"{way}_p99_percent") for way in ("mesh_to_surface", "surface_to_mesh")
        ]
        return max((way for way in ways if way is not None), default=None)

    def share(self, kind: str) -> float | None:
        """Per cent of its features of a kind that are kept; none are without a valid mesh.

        None where a part has no such feature, as a sphere has no point.
        """
        if not self.is_valid:
            return 0.0
        number = self.features[f"{kind}s"]["all"] if self.features else 0
        return 100 * (1 - self.lost[kind] / number) if number else None


def results(folder: Path) -> list[PartResult]:
    """The parts of a batch that ended, the worst first.

    First come those without a valid mesh, then those that lose most, then those of the smallest
    scaled Jacobian.
    """
    found = []
    for path in folder.glob(f"*/{ROW}"):
        report, row = path.parent / REPORT, json.loads(path.read_text())
        has_mesh = "hexes" in row and report.is_file()
        hexes = json.loads(report.read_text())["hex"] if has_mesh else {}
        found.append(PartResult(path.parent.name, row, hexes.get("features") or {}))
    order = {part.name: (part.is_valid, -sum(part.lost.values()), part.least) for part in found}
    return sorted(found, key=lambda part: (*order[part.name], part.name))


def totals(parts: Sequence[PartResult]) -> dict[str, float | None]:
    """Counts of all parts, means of shares, and medians over those with a valid mesh."""
    valid = [part for part in parts if part.is_valid]
    near = [part for part in valid if (part.farthest or 0.0) <= 100 * TOLERANCE]
    return {
        "parts": len(parts),
        "valid hex meshes": len(valid),
        "everything kept": sum(part.keeps_everything for part in parts),
        **{f"{kind}s kept, %": _over(mean, [p.share(kind) for p in parts]) for kind in KINDS},
        **{
            f"least scaled Jacobian {least} or more": sum(part.least >= least for part in valid)
            for least in LEAST
        },
        f"99 % of points within {100 * TOLERANCE:g} %": len(near),
        "hexes, median": _over(median, [part.row.get("hexes") for part in valid]),
        "seconds, median": _over(median, [part.row.get("seconds") for part in valid]),
    }


def changes(part: PartResult, before: PartResult | None) -> tuple[str | None, str | None]:
    """Change of the smallest scaled Jacobian and of the number of lost features, in words.

    None where there is nothing to compare.
    """
    if before is None or not (part.is_valid or before.is_valid):
        return None, None
    if part.is_valid != before.is_valid:
        return "valid now" if part.is_valid else "valid before", None
    lost = sum(part.lost.values()) - sum(before.lost.values())
    return f"{part.least - before.least:+.3f}", f"{lost:+d}"


def _over(
    average: Callable[[Iterable[float]], float], values: Iterable[float | None]
) -> float | None:
    """Mean or median of the values that are known; None where none is."""
    known = [value for value in values if value is not None]
    return average(known) if known else None
