"""Requirements for the stages of a run, from structure to acceptance, on a block of known size."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from polycube.errors import InputError
from polycube.hexmesh import quality
from polycube.hexmesh.connectivity import check_conforming, genus
from polycube.hexmesh.generation.blocks import genus_of
from polycube.hexmesh.generation.template import counts, mesh
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.search.history import NO_MESH
from polycube.structure import lattice
from polycube.structure.projection import project_onto
from polycube.structure.rough_map import evaluate
from polycube.surface import measures as surfaces
from polycube.testing.solids import (
    PLACE,
    SIDES,
    Solid,
    claim,
    claim_array,
    half_ring,
    solid,
    swollen,
)
from polycube.testing.solutions import check_analysis, check_export, check_spline
from polycube.types import Candidate, HexMesh, Labels, Parametrization, RoughMap, Verdict

NEAR = 0.02  # of the diagonal: permitted distance of a fit from the block


def check_structure(plugin: Callable) -> None:
    """Proposals with the genus of the surface, manifold boundary and positive orientation.

    The parts are a block, a block with a hole, and, if nothing is proposed for these, half a
    ring and a bent strip.
    """
    blocks = [solid().surface, solid("hole_z").surface]
    n_proposals = 0
    for surface in (*blocks, half_ring(), half_ring(inner=28, height=50, leg=40)):
        if n_proposals and surface not in blocks:
            break
        wanted = surfaces.genus(surface)
        try:
            candidates = plugin(surface, ())
        except InputError:  # a user-supplied structure may not fit the part
            continue
        n_proposals += len(candidates)
        for candidate in candidates:
            found = genus_of(candidate.polycube, candidate.blocks)
            claim(found == wanted, f"a proposal has the surface's genus {wanted}", found)
            claim(lattice.is_manifold(candidate.polycube), "a proposal has a manifold boundary")
            claim(bool(candidate.key), "a proposal has a key")
            claim(np.isfinite(candidate.cost), "a cost is finite", candidate.cost)
            claim(_volume(candidate) > 0, "a rough map keeps orientation")
    parts = "a block, with or without a hole, half a ring or a bent strip"
    claim(n_proposals > 0, f"something is proposed for {parts}")


def _volume(candidate: Candidate) -> float:
    """Determinant of the rough map, from the ends of the axes of the polycube."""
    knots = candidate.polycube.knots
    low = np.array([k[0] for k in knots])
    ends = np.vstack([low, low + np.diag([k[-1] - k[0] for k in knots])])
    origin, *tips = evaluate(candidate.rough_map, ends)
    return float(np.linalg.det(np.array(tips) - origin))


def check_ranking(plugin: Callable) -> None:
    """Candidates with the genus of the surface, best first; the true one before a wrong one."""
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
    """A mesh of the block is valid and without warning; an inverted or enlarged one is worse."""
    part = solid("hole_z")
    exact = part.hexes
    true = plugin(exact, part.surface)
    claim(isinstance(true, Verdict), "the result is a Verdict", type(true).__name__)
    claim(true.is_valid, "a mesh of the block is valid", true.failures)
    claim(not true.warnings, "a mesh of the block has no warning", true.warnings)
    missing = sum(true.shortfall.values())
    middle = exact.vertices.mean(axis=0)
    for name, vertices in {
        "inverted": middle - (exact.vertices - middle),
        "three times as large": middle + 3 * (exact.vertices - middle),
    }.items():
        found = plugin(replace(exact, vertices=vertices), part.surface)
        claim(not found.is_valid, f"a mesh that is {name} is not valid")
        claim(found.key < true.key, f"a mesh that is {name} is worse", found.key)
        values = list(found.shortfall.values())
        claim(all(value > 0 for value in values), "each shortfall is positive", values)
        is_between = missing < sum(values) < NO_MESH
        claim(is_between, f"a mesh that is {name} is farther from the goal than the block", values)


def check_segment(plugin: Callable) -> None:
    """A label of a polycube face for each triangle; on a block, those given by the normals."""
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
    wrong = float((labels.axis != lattice.nearest_axis(surfaces.face_normals(part.surface))).mean())
    claim(wrong < 0.05, "a face of the block has the axis of its normal", f"{wrong:.0%} wrong")


def check_map(plugin: Callable) -> None:
    """The boundary of the polycube is mapped to the surface, with positive orientation inside."""
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
    """Hexes of the polycube at the positions given by the rough map."""
    for primitive in ("cube", "hole_z"):
        part = solid(primitive)
        hexes = plugin(part.surface, part.polycube, part.rough_map, None)
        _check_hexes(hexes, part)
        same = plugin(part.surface, part.polycube, part.rough_map, None)
        claim(np.array_equal(hexes.vertices, same.vertices), "equal input gives equal hexes")
        cells = set(np.unique(hexes.cell).tolist())
        claim(cells == {0}, "every hex names its grid cell", cells)


def check_smooth(plugin: Callable) -> None:
    """A mesh slightly away from the surface is fitted to it."""
    for primitive in ("cube", "hole_z"):
        part = solid(primitive)
        hexes = plugin(part.surface, swollen(part.hexes))
        _check_hexes(hexes, part)
        same = np.array_equal(hexes.hexes, part.hexes.hexes)
        claim(same, "smoothing moves vertices and leaves the hexes")


def check_refine(plugin: Callable) -> None:
    """A good mesh stays good: pillow and optimize."""
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
    patches = set(lattice.boundary(part.polycube).patch.tolist())
    claim(set(hexes.patch.tolist()) <= patches, "patches are those of the polycube")


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
    "meshing/cure": check_refine,
    "meshing/refine": check_refine,
    "spline": check_spline,
    "analysis": check_analysis,
    "export": check_export,
}
