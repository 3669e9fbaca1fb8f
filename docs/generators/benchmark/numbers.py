"""The numbers on the page of a benchmark: the parts of a batch, and their totals."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import mean, median

from polycube.hexmesh.feature_distances import TOLERANCE
from polycube.report.numbers.features import KINDS
from polycube.types import Json

ROW, REPORT = "row.json", "report.json"  # files of a part, in its folder
LEAST = (0.2, 0.3, 0.5)  # scaled Jacobians for which parts are counted
PUBLISHED = {  # Beaufort et al., "Hex Me If You Can", 2022, abstract
    "parts": 189,
    "everything kept": 19,
    "points kept, %": 70.9,
    "curves kept, %": 48.5,
    "faces kept, %": 34.6,
}


@dataclass(frozen=True)
class PartResult:
    """Result of one part of a batch.

    Parameters
    ----------
    name : name of its folder
    row : content of `row.json`
    features : "features" of the hex mesh in `report.json`; empty if the part is not a CAD model
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
        """Number of lost features of each kind; empty if it is unknown."""
        return {kind: self.features[f"{kind}s"]["lost"] for kind in KINDS if self.features}

    @property
    def loses_nothing(self) -> bool:
        """Whether a CAD part has a valid mesh without lost features."""
        return self.is_valid and bool(self.features) and not any(self.lost.values())

    @property
    def farthest(self) -> float | None:
        """99th percentile of the distance, the larger of both directions, in % of the diagonal."""
        ways = [
            self.row.get(f"{way}_p99_percent") for way in ("mesh_to_surface", "surface_to_mesh")
        ]
        return max((way for way in ways if way is not None), default=None)

    def share(self, kind: str) -> float | None:
        """Per cent of its features of a kind that are preserved; 0 without a valid mesh.

        None if a part has no such feature, such as the points of a sphere.
        """
        if not self.is_valid:
            return 0.0
        number = self.features[f"{kind}s"]["all"] if self.features else 0
        return 100 * (1 - self.lost[kind] / number) if number else None


def results(folder: Path) -> list[PartResult]:
    """The finished parts of a batch, the worst first.

    The order is: parts without a valid mesh, then by lost features, then by scaled Jacobian.
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
    """Counts of all parts, means of shares, and medians over parts with a valid mesh."""
    valid = [part for part in parts if part.is_valid]
    near = [part for part in valid if (part.farthest or 0.0) <= 100 * TOLERANCE]
    return {
        "parts": len(parts),
        "valid hex meshes": len(valid),
        "everything kept": sum(part.loses_nothing for part in parts),
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
    """Changes of the smallest scaled Jacobian and of the number of lost features, as text.

    None if there is nothing to compare.
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
    """Mean or median of the known values; None if there is none."""
    known = [value for value in values if value is not None]
    return average(known) if known else None
