"""The section of hex counts: requests, and walls and holes with fewer hexes than wanted."""

from markupsafe import Markup

from polycube.report.page.templates import NOTHING, render
from polycube.types import Json

N_SHOWN = 10  # rows, the worst first
KINDS = {"around": "edges round", "through": "hexes through", "size": "length of edges"}


def hex_counts(report: Json) -> Markup:
    """Entries of `meshing.at`, unmet ones first, then walls and holes with few hexes."""
    found = report.get("hex", {}).get("counts")
    if not found:
        return NOTHING
    requests, fewer = found["at"], found["fewer"]
    rows = [
        {
            "at": row["at"],
            "what": KINDS[row["kind"]],
            "wanted": row["wanted"],
            "reached": row["reached"],
            "result": "met" if row.get("met") else "not met",
        }
        for row in (*sorted(requests, key=lambda row: row["met"]), *fewer)
    ]
    kinds = [row["kind"] for row in fewer]
    sentences = [
        f"{kinds.count('through')} of {found['walls']} faces have fewer hexes through the wall "
        "under them (median over the face) than meshing.across_wall.",
        f"{kinds.count('around')} of {found['holes']} holes have fewer edges on their rim than "
        "meshing.around_hole.",
    ]
    if requests:
        met = sum(row["met"] for row in requests)
        sentences.insert(0, f"{met} of {len(requests)} entries of meshing.at are met.")
    if len(rows) > N_SHOWN:
        sentences.append(f"The worst {N_SHOWN} are listed; report.json has all.")
    return render("hex_counts.html", sentences=sentences, rows=rows[:N_SHOWN])
