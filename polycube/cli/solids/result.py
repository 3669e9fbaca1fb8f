"""The combined results of an assembly: one mesh, one `report.json`, one page."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from polycube import __version__
from polycube.assembly.combined import Agreement, Joint, Place, agreements, combined
from polycube.assembly.contacts import NEAR, Contact, contacts
from polycube.cli.batch import ROW, VERDICT
from polycube.cli.solids.analysis import SHARED, TIED, Solved, analysed
from polycube.cli.solids.settings import materials, problem_of_all, states_assemblies
from polycube.hexmesh.cad_faces import with_sets
from polycube.hexmesh.metrics import metrics
from polycube.hexmesh.named_sets import face_set
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.io import manifest, vtk
from polycube.io.access.reading import read_json
from polycube.io.cad import CONTACT, SEPARATE
from polycube.io.solids.listing import Solid
from polycube.kinds import Export
from polycube.pipeline.improvement import GIVEN
from polycube.pipeline.resume.results import has_stage, load_stage
from polycube.registry import provide
from polycube.report.files import OF_PHASE
from polycube.report.numbers.features import KINDS, face_name
from polycube.report.page.html import assembly_page
from polycube.surface.measures import diagonal
from polycube.types import Goal, HexMesh, Json, TriMesh

MADE = (0, 3)  # exit codes of runs with results; other runs leave those of an earlier run
PAGE = ("report.html", "report.json", "hex.vtu", *OF_PHASE["analysis"])


@dataclass(frozen=True, eq=False)
class _Part:
    """The result of the run of a solid."""

    solid: Solid
    row: Json  # of `row.json`
    report: Json  # empty if the run did not reach it
    surface: TriMesh | None
    mesh: HexMesh | None


def write_assembly(
    folder: Path,
    cfg: Json,
    solids: Sequence[Solid],
    codes: Mapping[int, int],
    exports: list[Export],
    notes: Sequence[str] = (),
) -> Json:
    """Write `hex.vtu`, the requested formats, `report.json` and `report.html` of all solids.

    Returns the numbers of `report.json`. Raises InputError if the analysis is not possible; the
    results of the solids are kept.

    folder : folder with the folders of the runs
    codes : exit codes by the number of the solid
    notes : further warnings
    """
    parts = [_part(folder, solid, codes[solid.number], cfg) for solid in solids]
    touching: list[Json] = []
    joints: list[Joint] = []
    ties: list[tuple[Place, Place]] = []
    for i, j in combinations(range(len(parts)), 2):
        for contact, how in _meeting(parts[i], parts[j]):
            row = _contact(parts[i], parts[j], contact, how, cfg["cad"]["interfaces"])
            touching.append(row)
            if how is not None and row["joined"] == SHARED:
                joints.append((i, j, how.vertices))
            if how is not None and row["joined"] in (TIED, CONTACT):
                places = (i, row["faces"][0]), (j, row["faces"][1])
                ties.append(places if how.binds_first else places[::-1])
    meshes = {k: part.mesh for k, part in enumerate(parts) if part.mesh is not None}
    friction = cfg["cad"]["friction"] if cfg["cad"]["interfaces"] == CONTACT else None
    mesh = combined(meshes, [s.name for s in solids], joints, ties, friction) if meshes else None
    report = _report(cfg, parts, touching, mesh)
    report["mesh_warnings"] = [*notes, *report["mesh_warnings"]]
    is_valid, solved = report["valid"], Solved()
    if mesh is not None and (problem := problem_of_all(cfg, solids, mesh.unit)):
        for row, own in zip(report["solids"], materials(problem, solids), strict=False):
            row |= own
        exports = [provide(e, problem=problem) if states_assemblies(e) else e for e in exports]
        pairs = {k: (parts[k].surface, own) for k, own in meshes.items()}
        solved = analysed(cfg, solids, problem, exports, pairs, mesh, report)
    earlier = [name for name in manifest.files(folder) if name.startswith(("hex.", *PAGE))]
    manifest.remove(folder, earlier)
    with manifest.writing(folder) as scratch:
        if mesh is not None:
            _write_vtu(scratch / "hex.vtu", mesh)
            for export in exports if is_valid else ():
                export(mesh, scratch / "hex")
            solved.write(scratch, cfg["files"])
        (scratch / "report.json").write_text(json.dumps(report, indent=1), encoding="utf-8")
    files = [name for name in manifest.files(folder) if "/" not in name]
    text = assembly_page(Path(str(cfg["mesh"])).name, report, mesh, folder, files, solved)
    with manifest.writing(folder) as scratch:
        (scratch / "report.html").write_text(text, encoding="utf-8")
    return report


def _part(folder: Path, solid: Solid, code: int, cfg: Json) -> _Part:
    run = folder / solid.name
    row: dict[str, Any] = {"exit": code, "result": VERDICT.get(code, "failed"), "says": ""}
    if (run / ROW).is_file():
        row |= read_json(run / ROW)
    if code not in MADE or not (run / "report.json").is_file():
        return _Part(solid, row, {}, None, None)
    report = read_json(run / "report.json")
    surface, mesh = load_stage(run, "read")[0], None
    if "hex" in report:
        kinds = (GIVEN, *reversed(cfg["meshing"]["order"]))
        last = next(kind for kind in kinds if has_stage(run, kind))
        found = load_stage(run, last)
        mesh = with_sets(found[0] if last == GIVEN else found, surface)
    return _Part(solid, row, report, surface, mesh)


def _meeting(first: _Part, second: _Part) -> list[tuple[Contact, Agreement | None]]:
    """The contacts of two solids, and the agreement of their meshes there, if both have one."""
    a, b = first.surface, second.surface
    if a is None or b is None:
        return []
    near = NEAR * max(diagonal(a), diagonal(b))
    low = np.maximum(a.vertices.min(axis=0), b.vertices.min(axis=0))
    if (low > np.minimum(a.vertices.max(axis=0), b.vertices.max(axis=0)) + near).any():
        return []
    found = contacts(a, b)
    if first.mesh is None or second.mesh is None:
        return [(contact, None) for contact in found]
    return list(zip(found, agreements(first.mesh, second.mesh, found), strict=True))


def _joined(how: Agreement | None, interfaces: str) -> str | None:
    """How the meshes are joined at a contact: `SHARED`, in decks `TIED` or `CONTACT`, or not."""
    if how is None or interfaces == SEPARATE or not min(how.quads):
        return None
    if interfaces == CONTACT:
        return CONTACT
    return SHARED if how.is_covered else TIED


def _contact(
    first: _Part, second: _Part, contact: Contact, how: Agreement | None, interfaces: str
) -> Json:
    """A contact as written to `report.json`."""
    faces = [(first, contact.first), (second, contact.second)]
    places = [(part.surface, face) for part, face in faces if part.surface is not None]
    found: dict[str, Any] = {
        "solids": [part.solid.name for part, _ in faces],
        "faces": [face_set(*place) for place in places],
        "names": [face_name(*place) for place in places],
        "area": contact.area,
        "agree": None if how is None else how.is_covered,
        "joined": _joined(how, interfaces),
    }
    if how is not None:
        found |= {"quads": list(how.quads), "common_quads": len(how.pairs)}
        found["common_area"] = how.area
    return found


def _report(
    cfg: Json, parts: Sequence[_Part], touching: list[Json], mesh: HexMesh | None
) -> dict[str, Any]:
    names = {part.solid.number: part.solid.name for part in parts}
    path = str(cfg["mesh"])
    report: dict[str, Any] = {
        "input": {"path": path, "solids": len(parts)},
        "solids": [_row(part, names, path) for part in parts],
        "contacts": touching,
        "mesh_warnings": [
            f"{part.solid.name}: {warning}"
            for part in parts
            for warning in part.report.get("mesh_warnings", ())
        ],
        "seconds": {
            part.solid.name: round(sum(part.report.get("seconds", {}).values()), 3)
            for part in parts
        },
        "version": __version__,
    }
    if mesh is not None:
        report["hex"] = _numbers(parts, mesh)
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        report["input"]["unit"] = mesh.unit or None
        report["input"]["bbox"] = [low.tolist(), high.tolist()]
    bad = [part.solid.name for part in parts if part.row["exit"] != 0]
    if bad:
        named = ", ".join(bad)
        report["failure"] = f"no valid result of {len(bad)} of {len(parts)} solids: {named}"
    elif mesh is not None and report["hex"]["min_scaled_jacobian"] <= 0:
        report["failure"] = "the meshes of the solids are valid, but the joined mesh is not"
    return {**report, "valid": "failure" not in report}


def _row(part: _Part, names: Mapping[int, str], path: str) -> dict[str, Any]:
    """Data of a solid for `report.json` and the page."""
    measures, solid = part.report.get("hex", {}), part.solid
    row: dict[str, Any] = {"name": solid.name, "number": solid.number, "volume": solid.volume}
    if solid.motion is not None:
        row["same_as"] = names[solid.same_as]
    row |= {name: part.row[name] for name in ("exit", "result")}
    row["says"] = part.row["says"].removeprefix(f"{path}: ")
    for name in ("hexes", "min_scaled_jacobian", "mean_scaled_jacobian"):
        row[name] = measures.get(name)
    row["features"] = _counts([measures.get("features")])
    return row


def _counts(found: Sequence[Json | None]) -> Json | None:
    """Numbers of points, curves and faces of the solids, total and lost; None without any."""
    counted = [each for each in found if each]
    if not counted:
        return None
    return {
        kind: {name: sum(each[kind][name] for each in counted) for name in ("all", "lost")}
        for kind in (f"{kind}s" for kind in KINDS)
    }


def _numbers(parts: Sequence[_Part], mesh: HexMesh) -> dict[str, Any]:
    """The measures of the combined mesh."""
    quality = scaled_jacobian(mesh.vertices, mesh.hexes)
    features = _counts([part.report.get("hex", {}).get("features") for part in parts])
    limits = {"tolerance": Goal.features, "share": Goal.feature_share}
    meshed = sum(len(part.mesh.vertices) for part in parts if part.mesh is not None)
    return {
        "hexes": len(mesh.hexes),
        "vertices": len(mesh.vertices),
        "merged_vertices": meshed - len(mesh.vertices),
        "min_scaled_jacobian": float(quality.min()),
        "mean_scaled_jacobian": float(quality.mean()),
        "features": features and {**limits, **features},
    }


def _write_vtu(path: Path, mesh: HexMesh) -> None:
    """Write the mesh with its measures, and the number of the solid of each hex, from 1."""
    arrays = {**metrics(mesh.vertices, mesh.hexes), "solid": mesh.cell + 1}
    legend = ", ".join(f"{k} {name}" for k, name in enumerate(mesh.primitives, start=1))
    comment = f"<!-- solid: {legend} -->\n"
    vtk.write_cells(path, mesh.vertices, mesh.hexes, vtk.HEXAHEDRON, {}, arrays, comment)
