"""Lattices from draws: exact where the draw is, and still right where some of it is wrong."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation
from torch import Tensor, nn

from polycube.diffusion.conditions import AnyStructure
from polycube.diffusion.denoiser import Denoiser, DenoiserOptions
from polycube.diffusion.pairs.any_structure import LatticePairs, LatticeShapes, Part
from polycube.diffusion.pairs.pairs import sample
from polycube.diffusion.weights import load_denoiser
from polycube.plugins.structure.learned import hypotheses
from polycube.plugins.structure.learned.draws import Cloud, Draw, draw
from polycube.plugins.structure.learned.knots import (
    charts,
    clusters,
    filled,
    flattened,
    lattice,
    on_bricks,
)
from polycube.registry import build
from polycube.structure.lattice import genus, is_manifold
from polycube.surface.frames import rotations, turn
from polycube.surface.measures import diagonal, face_normals
from polycube.testing import check_plugin
from polycube.types import Candidate, Tier, TriMesh
from tests.conftest import first_quick
from tests.fixtures.machined import ELL, prism
from tests.fixtures.polycubes import PRIMITIVES
from tests.fixtures.surfaces import box, torus

TURNED = Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix()
PARTS = LatticePairs(0, 0)


class Straight(nn.Module):
    """Says that all is a polycube already: no move, the axis nearest to the normal."""

    def forward(self, x: Tensor, t: Tensor, context: Tensor) -> Tensor:
        normals = x[:, 6:]
        axes = 9 * torch.stack([normals, -normals], dim=2).flatten(1, 2)
        return torch.cat([0 * normals, axes, axes[:, [0] * 7]], dim=1)


@pytest.fixture
def straight(monkeypatch: pytest.MonkeyPatch) -> Denoiser:
    options = DenoiserOptions(target="move", classifier=False)
    alpha_bar = build("schedule", {"plugin": "linear", "steps": 50})()
    made = Denoiser(lambda *_: Straight(), alpha_bar, AnyStructure(), options)
    monkeypatch.setattr(hypotheses, "denoiser_of_any", lambda weights: made)
    return made


def propose(surface: TriMesh, earlier: tuple[Candidate, ...] = (), **options) -> list[Candidate]:
    config = {"plugin": "drawn", "draws": 3, **options}
    return build("structure", config, grid=(2, 1, 1), primitives=PRIMITIVES)(surface, earlier)


def truth(part: Part, n_points: int = 4000, wrong: float = 0.0) -> tuple[TriMesh, Draw]:
    """A part in its frame, of diagonal 1, and a perfect draw, except for a share of wrong axes."""
    faces = part.surface.faces
    size = diagonal(TriMesh(part.geometry, faces))
    surface, rng = TriMesh(part.geometry / size, faces), np.random.default_rng(0)
    face, weights = sample(faces, surface.vertices, n_points, rng)
    points, places = (
        np.einsum("nk,nkd->nd", weights, x[faces[face]])
        for x in (surface.vertices, part.surface.vertices / size)
    )
    axis = np.where(rng.random(n_points) < wrong, rng.integers(6, size=n_points), 0)
    axis = np.where(axis > 0, axis, part.surface.axis[face])
    log_axis = np.log(0.9 * np.eye(6)[axis] + 0.1 / 6)
    cloud = Cloud(points, face_normals(surface)[face], log_axis, places - points)
    return surface, cloud.interpolated(surface)


@pytest.mark.parametrize(("flat", "least"), first_quick(1, [(False, 11), (True, 10)]))
@pytest.mark.parametrize("wrong", [0.0, 0.02])
def test_a_perfect_draw_gives_the_true_lattice(wrong: float, flat: bool, least: int) -> None:
    """Also if one point in fifty has another axis, so that the labels do not match a polycube."""
    right = []
    for number in range(12):
        part = PARTS.part(number)
        found = lattice(*truth(part, wrong=wrong), part.genus, flat)
        right.append(
            found is not None
            and np.array_equal(found.polycube.occupancy, part.polycube.occupancy)
            and found.polycube.occupancy.shape == part.polycube.occupancy.shape
        )
    assert sum(right) >= least


def test_charts_lie_on_their_knots() -> None:
    part = PARTS.part(12)
    surface, perfect = truth(part)
    found = lattice(surface, perfect, part.genus)
    on = on_bricks(surface, found)
    assert np.array_equal(on.full, part.polycube.occupancy)
    for axis in range(3):
        mine = part.surface.axis // 2 == axis
        placed = on.placed[surface.faces[mine], axis]
        off = np.abs(placed - part.surface.knot[mine, None])
        assert np.median(off) == 0 and off.mean() < 0.02
    mapped = TriMesh(on.placed, surface.faces)
    assert np.array_equal(filled(mapped, [np.arange(len(k)) for k in on.knots]), on.full)


def test_flattened_charts_of_a_bent_plate_lie_in_planes() -> None:
    """A plate sheared along x by its height: charts across x and z end up at their mean places."""
    part = PARTS.part(19)  # a block
    surface, perfect = truth(part, n_points=20_000)
    places = perfect.places
    sheared = places + 0.1 * places[:, [2]] * [1, 0, 0]
    found, flat = flattened(surface, charts(surface, part.surface.axis, sheared), sheared)
    for chart in range(6):
        on = np.unique(surface.faces[found.chart == chart])
        assert np.ptp(flat[on, found.axis[chart]]) < 1e-9
        across = sheared[on, found.axis[chart]]
        assert found.value[chart] == pytest.approx(across.mean(), abs=0.02)


def test_clusters_are_weighted_means_of_close_values() -> None:
    values, weights = np.array([1.0, 0.0, 0.02, 0.5]), np.array([1.0, 3, 1, 2])
    assert clusters(values, weights, 0.1) == pytest.approx([0.005, 0.5, 1])
    assert clusters(values, weights, 0.01) == pytest.approx([0, 0.02, 0.5, 1])
    assert clusters(np.array([]), np.array([]), 0.1).shape == (0,)


def test_charts_of_a_box_are_its_sides() -> None:
    surface = box()
    label = (face_normals(surface) @ np.kron(np.eye(3), [[1, -1]])).argmax(axis=1)
    found = charts(surface, label, surface.vertices)
    assert sorted(zip(found.axis, found.value.tolist(), strict=True)) == [
        (axis, value) for axis in range(3) for value in (0.0, 1.0)
    ]
    assert found.area == pytest.approx(1 / 6) and sorted(np.bincount(found.chart)) == [2] * 6


def test_an_ell_in_any_position_is_one(straight: Denoiser) -> None:
    ell = prism(ELL)
    surface = TriMesh(ell.vertices @ TURNED.T * 7 + 3, ell.faces)
    [candidate] = propose(surface)
    two = np.array([[True, True], [True, False]]).reshape(2, 2, 1)
    assert any(np.array_equal(candidate.polycube.occupancy, turn(two, r)) for r in rotations())
    found = candidate.proposal, candidate.tier, candidate.probability
    assert found == ("drawn", Tier.LEARNED, 1)


def test_proposals_have_the_genus_and_differ(straight: Denoiser) -> None:
    surface = torus()
    found = propose(surface, draws=4)
    assert all(genus(c.polycube) == 1 and is_manifold(c.polycube) for c in found)
    assert len({c.key for c in found}) == len(found)
    assert sum(c.probability for c in found) <= 1
    assert [c.probability for c in found] == sorted((c.probability for c in found), reverse=True)


def test_nothing_is_proposed_with_a_given_context_or_weights_of_a_grid(straight: Denoiser) -> None:
    assert len(propose(prism(ELL))) == 1
    given = build(
        "structure", {"plugin": "given", "context": ["cube"]}, grid=(1, 1, 1), primitives=PRIMITIVES
    )(box(), ())
    assert propose(prism(ELL), tuple(given)) == []


def test_nothing_for_a_part_of_too_many_cad_faces(straight: Denoiser) -> None:
    ell = prism(ELL)
    by_side = replace(
        ell, region=np.unique(face_normals(ell).round(6), axis=0, return_inverse=True)[1]
    )
    assert len(propose(by_side, faces=6)) == 1
    assert propose(by_side, faces=5) == []


def test_requirements_of_a_structure(straight: Denoiser) -> None:
    check_plugin("structure", {"plugin": "drawn"})


def test_labels_and_places_do_not_depend_on_the_random_orientations(straight: Denoiser) -> None:
    ell = prism(ELL)
    surface = TriMesh(ell.vertices / diagonal(ell), ell.faces)
    sampler = {"plugin": "ddim", "steps": 1}
    expected = (face_normals(surface) @ np.kron(np.eye(3), [[1, -1]])).argmax(axis=1)
    for each in draw(straight, surface, 0, sampler, n_draws=6, n_clouds=8, n_passes=2, seed=0):
        assert np.array_equal(each.log_axis.argmax(axis=1), expected)
        assert each.places == pytest.approx(surface.vertices, abs=1e-5)


def test_the_shipped_network_straightens_deformed_parts() -> None:
    """Points of parts outside of the training set are moved most of their way to the polycube."""
    parts = LatticePairs(10**9, 0, LatticeShapes(cad=0, organic=1))
    denoiser, sampler = load_denoiser(build, None, ()), {"plugin": "ddim", "steps": 1}
    before, after = [], []
    for number in range(6):
        part = parts.part(number)
        surface = TriMesh(part.geometry, part.surface.faces)
        [drawn] = draw(denoiser, surface, part.genus, sampler, 1, 2, 1, 0)
        for found, places in ((before, surface.vertices), (after, drawn.places)):
            found.append(np.linalg.norm(places - part.surface.vertices, axis=1).mean())
    assert np.mean(after) < 0.7 * np.mean(before)
