"""Promises of the stages of a run, from structure to export, on a block of known sides."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from polycube.errors import InputError
from polycube.hexmesh import quality
from polycube.hexmesh.connectivity import check_conforming, genus
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.hexmesh.template import counts, mesh
from polycube.structure import lattice
from polycube.structure.projection import project_onto
from polycube.structure.rough_map import evaluate
from polycube.surface import measures as surfaces
from polycube.testing.claim import claim, claim_array
from polycube.testing.solids import PLACE, SIDES, Solid, solid, swollen
from polycube.types import (
    Candidate,
    Deformation,
    HexMesh,
    Labels,
    Modes,
    Parametrization,
    RoughMap,
    Solution,
    Spline,
    Verdict,
)

NEAR = 0.02  # of the diagonal: what fits may miss the block by


def check_structure(plugin: Callable) -> None:
    """Proposals of the surface's genus, of manifold boundary, placed right-handed."""
    n_proposals = 0
    for primitive in ("cube", "hole_z"):
        part = solid(primitive)
        wanted = surfaces.genus(part.surface)
        try:
            candidates = plugin(part.surface, ())
        except InputError:  # a structure that is given may refuse a part it does not fit
            continue
        n_proposals += len(candidates)
        for candidate in candidates:
            found = lattice.genus(candidate.polycube)
            claim(found == wanted, f"a proposal has the surface's genus {wanted}", found)
            claim(lattice.is_manifold(candidate.polycube), "a proposal has a manifold boundary")
            claim(bool(candidate.key), "a proposal has a key")
            claim(np.isfinite(candidate.cost), "a cost is finite", candidate.cost)
            claim(_volume(candidate) > 0, "a rough map keeps orientation")
    claim(n_proposals > 0, "something is proposed for a block, or for a block with a hole")


def _volume(candidate: Candidate) -> float:
    """Determinant of the rough map from the ends of the polycube's axes."""
    knots = candidate.polycube.knots
    low = np.array([k[0] for k in knots])
    ends = np.vstack([low, low + np.diag([k[-1] - k[0] for k in knots])])
    origin, *tips = evaluate(candidate.rough_map, ends)
    return float(np.linalg.det(np.array(tips) - origin))


def check_ranking(plugin: Callable) -> None:
    """Candidates of the surface's genus, best first; the true structure before one that is off."""
    part, other = solid("hole_z"), solid("cube")
    truth = part.candidate
    aside = replace(truth.rough_map, positions=truth.rough_map.positions + SIDES)
    off = replace(truth, rough_map=aside, key="aside")
    ranked = plugin(part.surface, [off, other.candidate, truth])
    keys = [entry.candidate.key for entry in ranked]
    claim(keys == ["solid", "aside"], "the true structure ranks first, another genus never", keys)
    scores = [entry.score for entry in ranked]
    claim(scores == sorted(scores), "the smallest score comes first", scores)


def check_acceptance(plugin: Callable) -> None:
    """A mesh of the block is valid and without warning; an inverted or swollen one is worse."""
    part = solid("hole_z")
    exact = part.hexes
    true = plugin(exact, part.surface)
    claim(isinstance(true, Verdict), "the result is a Verdict", type(true).__name__)
    claim(true.is_valid, "a mesh of the block is valid", true.failures)
    claim(not true.warnings, "a mesh of the block has no warning", true.warnings)
    middle = exact.vertices.mean(axis=0)
    for name, vertices in {
        "inverted": middle - (exact.vertices - middle),
        "three times as large": middle + 3 * (exact.vertices - middle),
    }.items():
        found = plugin(replace(exact, vertices=vertices), part.surface)
        claim(not found.is_valid, f"a mesh that is {name} is not valid")
        claim(found.key < true.key, f"a mesh that is {name} is worse", found.key)


def check_segment(plugin: Callable) -> None:
    """A label per face, of the polycube's own faces; on a block those of the normals."""
    part = solid("hole_z")
    positions = Parametrization((part.surface.vertices - PLACE) / SIDES)
    labels = plugin(part.surface, part.polycube, positions)
    claim(isinstance(labels, Labels), "the result is Labels", type(labels).__name__)
    n_faces = len(part.surface.faces)
    claim(len(labels.axis) == n_faces, f"{n_faces} faces have a label", len(labels.axis))
    faces = lattice.boundary(part.polycube)
    own = set(zip(faces.patch.tolist(), faces.axis.tolist(), strict=True))
    used = set(zip(labels.patch.tolist(), labels.axis.tolist(), strict=True))
    claim(used <= own, "patch and axis are those of a polycube face", sorted(used - own))
    normal = surfaces.face_normals(part.surface)
    axis = np.abs(normal).argmax(1)
    wanted = 2 * axis + (normal[np.arange(n_faces), axis] < 0)
    wrong = float((labels.axis != wanted).mean())
    claim(wrong < 0.05, "a face of the block has the axis of its normal", f"{wrong:.0%} wrong")


def check_map(plugin: Callable) -> None:
    """The polycube's boundary comes to lie on the surface, its inside stays right-handed."""
    for primitive in ("cube", "hole_z"):
        part = solid(primitive)
        places = Parametrization((part.surface.vertices - PLACE) / SIDES)
        faces = lattice.boundary(part.polycube)
        _, face = project_onto(faces, places.positions[part.surface.faces].mean(axis=1))
        labels = Labels(faces.axis[face], faces.patch[face])
        rough = replace(part.rough_map, positions=part.rough_map.positions * [1.1, 1.0, 0.9])
        found = plugin(part.surface, part.polycube, labels, places, rough)
        claim(isinstance(found, RoughMap), "the result is a RoughMap", type(found).__name__)
        hexes = mesh(part.polycube, found, counts(part.polycube, found, 15.0))
        _check_hexes(hexes, part)
        off = quality.deviation(hexes, part.surface).vertices
        claim(off < NEAR, "the polycube's boundary is on the surface", f"{off:.1%} off")


def check_subdivide(plugin: Callable) -> None:
    """Hexes of the polycube where the rough map puts them."""
    for primitive in ("cube", "hole_z"):
        part = solid(primitive)
        hexes = plugin(part.surface, part.polycube, part.rough_map)
        _check_hexes(hexes, part)
        same = plugin(part.surface, part.polycube, part.rough_map)
        claim(np.array_equal(hexes.vertices, same.vertices), "equal input gives equal hexes")
        cells = set(np.unique(hexes.cell).tolist())
        claim(cells == {0}, "every hex names its grid cell", cells)


def check_smooth(plugin: Callable) -> None:
    """A mesh that is a little off comes to fit the surface."""
    for primitive in ("cube", "hole_z"):
        part = solid(primitive)
        hexes = plugin(part.surface, swollen(part.hexes))
        _check_hexes(hexes, part)
        same = np.array_equal(hexes.hexes, part.hexes.hexes)
        claim(same, "smoothing moves vertices and leaves the hexes")


def check_refine(plugin: Callable) -> None:
    """A good mesh stays one: pillow and optimize."""
    part = solid("hole_z")
    before = scaled_jacobian(part.hexes.vertices, part.hexes.hexes).min()
    hexes = plugin(part.surface, part.hexes)
    _check_hexes(hexes, part)
    after = scaled_jacobian(hexes.vertices, hexes.hexes).min()
    claim(after > min(0.5, before - 0.2), f"the worst hex, {before:.2f}, stays good", after)


def _check_hexes(hexes: HexMesh, part: Solid) -> None:
    claim(isinstance(hexes, HexMesh), "the result is a HexMesh", type(hexes).__name__)
    claim_array(hexes.vertices, (None, 3), "the vertices")
    try:
        check_conforming(hexes)
    except ValueError as error:
        raise AssertionError(f"hexes meet in whole faces; got: {error}") from error
    wanted = lattice.genus(part.polycube)
    claim(genus(hexes) == wanted, f"the mesh has genus {wanted}", genus(hexes))
    worst = scaled_jacobian(hexes.vertices, hexes.hexes).min()
    claim(worst > 0, "no hex is inverted", f"a scaled Jacobian of {worst:.3f}")
    ends = np.array([hexes.vertices.min(0), hexes.vertices.max(0)])
    off = np.abs(ends - [PLACE, PLACE + SIDES]).max() / np.linalg.norm(SIDES)
    claim(off < NEAR, "the mesh keeps units and placement", f"{off:.1%} of the diagonal off")
    known = set(lattice.boundary(part.polycube).patch.tolist())
    claim(set(hexes.patch.tolist()) <= known, "patches are those of the polycube")


def check_spline(plugin: Callable) -> None:
    """A partition of unity whose solid is the block's, right-handed."""
    part = solid("hole_z", 20.0)
    spline = plugin(part.surface, part.hexes)
    claim(isinstance(spline, Spline), "the result is a Spline", type(spline).__name__)
    shape = (spline.extraction.shape[0], len(spline.control))
    claim(spline.extraction.shape == shape, f"the extraction is {shape}", spline.extraction.shape)
    off = np.abs(np.asarray(spline.extraction.sum(1)) - 1).max()
    claim(off < 1e-10, "the functions are a partition of unity", f"{off:.2g} off")
    inside = 0 <= spline.nodes.min() and spline.nodes.max() < shape[0]
    claim(inside, f"nodes number the {shape[0]} Bezier nodes")
    hexes = set(spline.element_hex.tolist())
    claim(hexes == set(range(len(part.hexes.hexes))), "every hex has an element")
    known = set(part.hexes.patch.tolist())
    claim(set(spline.patch.tolist()) == known, "its sides have the patches of the mesh")
    points = spline.extraction @ spline.control
    size = np.ptp(points, axis=0)
    off = np.abs(size / SIDES - 1).max()
    claim(off < 0.2, "the solid has the sides of the mesh", f"sides {size.round(3).tolist()}")
    corners = points[spline.nodes[:, [0, 3, 12, 48]]]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1])
    claim((volumes > 0).all(), "the elements are right-handed")


def check_analysis(plugin: Callable) -> None:
    """A solution of the block: modes, or the rest state or potential in balance."""
    from polycube.registry import build

    part = solid(size=25.0)
    spline = build("spline", {"plugin": "h2s"})(part.surface, part.hexes)
    found = plugin(spline)
    name = type(found).__name__
    claim(isinstance(found, Solution), "the result is Modes, Deformation or Potential", name)
    if isinstance(found, Modes):
        _check_modes(found, spline)
    elif isinstance(found, Deformation):
        claim_array(found.displacement, (len(spline.control), 3), "the displacement")
        claim_array(found.stress, (spline.extraction.shape[0], 6), "the stress")
        claim(found.mass > 0, "the mass is positive", found.mass)
        _check_balance(found.reactions.sum(axis=0) + found.load, found.load, found.supports)
    else:
        claim_array(found.values, (len(spline.control),), "the values")
        claim_array(found.flux, (spline.extraction.shape[0], 3), "the flux")
        _check_balance(found.flows.sum() + found.supplied, found.flows, found.supports)


def _check_modes(modes: Modes, spline: Spline) -> None:
    """Ascending: rigid motions, then those that deform the block."""
    values = modes.eigenvalues
    claim_array(values, (None,), "the eigenvalues")
    claim_array(modes.shapes, (len(values), len(spline.control), 3), "the shapes")
    claim((np.diff(values) >= 0).all(), "eigenvalues ascend")
    claim(modes.mass > 0, "the mass is positive", modes.mass)
    claim(len(values) > modes.rigid, "there are modes beyond the rigid ones", len(values))
    rigid = int((np.abs(values) < 1e-6 * values[-1]).sum())
    claim(rigid == modes.rigid, f"{modes.rigid} motions are rigid", rigid)


def _check_balance(rest: np.ndarray, given: np.ndarray, supports: tuple[str, ...]) -> None:
    claim(len(supports) > 0, "something is held")
    off = np.abs(rest).max() / max(np.abs(given).max(), 1e-300)
    claim(off < 1e-6, "what goes in through the supports balances the rest", f"{off:.2g} of it")


def check_export(plugin: Callable) -> None:
    """One file that says the same every time, and what was put in where meshio can read it."""
    part = solid("hole_z")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = plugin(part.hexes, folder / "hex")
        claim(isinstance(path, Path) and path.is_file(), "the path written is returned", path)
        claim(path.parent == folder, "the file lies in the folder asked for", path.parent)
        claim(path.stem == "hex" and path.suffix, "the name is kept, with a suffix", path.name)
        claim([path] == list(folder.iterdir()), "nothing else is left in the folder")
        first = path.read_bytes()
        claim(plugin(part.hexes, folder / "hex").read_bytes() == first, "equal input, equal bytes")
        _check_read_back(path, part.hexes)


def _check_read_back(path: Path, hexes: HexMesh) -> None:
    try:
        import meshio
    except ImportError:  # only the reader of the tests
        return
    if path.suffix not in meshio.extension_to_filetypes:
        return
    try:
        found = meshio.read(path)
    except ModuleNotFoundError:  # what it reads Exodus by, for example
        return
    off = np.abs(found.points - hexes.vertices).max() / np.linalg.norm(SIDES)
    claim(off < 1e-6, "points come back", f"{off:.2g} of the diagonal off")
    same = np.array_equal(found.cells_dict["hexahedron"], hexes.hexes)
    claim(same, "hexes come back in VTK's order of nodes")


STAGES = {
    "structure": check_structure,
    "ranking": check_ranking,
    "acceptance": check_acceptance,
    "meshing/segment": check_segment,
    "meshing/map": check_map,
    "meshing/subdivide": check_subdivide,
    "meshing/smooth": check_smooth,
    "meshing/pillow": check_refine,
    "meshing/optimize": check_refine,
    "meshing/refine": check_refine,
    "spline": check_spline,
    "analysis": check_analysis,
    "export": check_export,
}
