"""Bent bars and tubes: their path, and hexes that fill them."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from polycube.hexmesh.background.background import NoBackgroundError
from polycube.hexmesh.connectivity import check_conforming, genus
from polycube.hexmesh.inspection import inspect
from polycube.hexmesh.quality import volume
from polycube.hexmesh.scaled_jacobian import scaled_jacobian
from polycube.io.surfaces import read_surface
from polycube.plugins.structure.background.bends.path import path
from polycube.plugins.structure.background.bends.straightened import straightened
from polycube.surface import measures
from polycube.types import Candidate, TriMesh
from tests.conftest import first_quick
from tests.fixtures import columns
from tests.fixtures.bent import SQUARE, bent
from tests.fixtures.cad_parts import write
from tests.fixtures.surfaces import box
from tests.fixtures.turned import revolved

TURN = Rotation.random(random_state=3).as_matrix()
RADII, ANGLES = st.floats(2, 9), st.floats(10, 200)
PIECES = st.lists(st.tuples(st.floats(0.5, 9), RADII, ANGLES), min_size=1, max_size=3)


def propose(surface: TriMesh, **options) -> list[Candidate]:
    return columns.propose("bent", surface, **{"curvature": None, **options})


def placed(surface: TriMesh, scale: float = 1.0) -> TriMesh:
    return replace(surface, vertices=scale * surface.vertices @ TURN.T + 5)


@settings(deadline=None, max_examples=40)
@given(PIECES)
def test_the_path_has_the_lines_and_arcs_of_which_a_part_is_made(pieces):
    found = path(placed(bent(SQUARE, pieces)))
    wanted = np.array(
        [
            part
            for length, radius, angle in pieces
            for part in ((length, 0), (radius * np.radians(angle), np.radians(angle)))
        ]
    )
    known = np.array([(motion.length, motion.angle) for motion in found.motions])
    if not np.allclose(known, wanted):  # from the other end
        wanted = wanted[::-1]
    assert known == pytest.approx(wanted, rel=1e-6, abs=1e-9)
    assert found.background.levels[1:] == pytest.approx(np.cumsum(wanted[:, 0]))


@settings(deadline=None, max_examples=20)
@given(PIECES)
def test_the_ends_of_the_path_are_those_of_the_part(pieces):
    surface = placed(bent(SQUARE, pieces))
    part = path(surface).background
    for level in part.levels[[0, -1]]:
        places = part.place(np.column_stack([part.points, np.full(len(part.points), level)]))
        ends = [surface.vertices[np.unique(surface.faces[surface.region == k])] for k in (1, 2)]
        gaps = [np.linalg.norm(places[:, None] - end, axis=2).min(axis=1).max() for end in ends]
        assert min(gaps) < 1e-9


@pytest.mark.parametrize("scale", first_quick(1, [1.0, 1e-3, 1e3]))
def test_hexes_fill_a_bent_bar(scale):
    """Its volume is the area of the section times the path of its centre (Pappus)."""
    surface = placed(bent(SQUARE, [(4, 3, 90), (0, 5, 180), (2, 0, 0)], step=1.0), scale)
    [candidate] = propose(surface, size=scale)
    mesh = candidate.blocks
    check_conforming(mesh)
    assert genus(mesh) == 0
    length = 4 + np.pi / 2 * 3 + np.pi * 5 + 2
    assert volume(mesh) == pytest.approx(4 * length * scale**3, rel=0.02)
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.9


@pytest.mark.slow
@settings(deadline=None, max_examples=10)
@given(st.floats(4, 9), st.floats(90, 1500), st.sampled_from([-1, 1]), st.floats(3, 9))
def test_hexes_fill_a_spring(radius, angle, hand, pitch):
    """The volume of a screw motion is that of the rotation, whatever its pitch."""
    surface = placed(bent(SQUARE, [(3, 0, 0), (0, radius, angle, hand * pitch * angle / 360)]))
    motions = path(surface).motions
    assert sorted(m.angle for m in motions) == pytest.approx([0, np.radians(angle)], abs=1e-4)
    [candidate] = propose(surface, size=1.0)
    mesh = candidate.blocks
    check_conforming(mesh)
    assert volume(mesh) == pytest.approx(4 * (3 + np.radians(angle) * radius), rel=0.02)
    lead = np.arctan2(pitch / (2 * np.pi), radius - 1)  # the section is not normal to the helix
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.9 * np.cos(lead)


@pytest.mark.parametrize(("around_hole", "wanted"), first_quick(1, [(12, 4), (24, 6), (40, 10)]))
def test_a_quarter_turn_has_four_hexes_or_more(around_hole, wanted):
    surface = bent(SQUARE, [(0, 8, 90)])
    [candidate] = propose(surface, size=100.0, around_hole=around_hole)
    assert len(candidate.blocks.hexes) == 4 * wanted


@pytest.mark.slow
@pytest.mark.parametrize(("name", "holes", "most"), [("elbow", 1, 1500), ("spring", 0, 2500)])
def test_a_bent_cad_part_is_on_its_curves(name, holes, most, tmp_path):
    surface, _ = read_surface(write(name, tmp_path))
    [candidate] = propose(surface, curvature="0.2%")
    mesh = candidate.blocks
    check_conforming(mesh)
    assert genus(mesh) == holes
    assert max(feature.distance for feature in inspect(mesh, surface).features) < 3e-3
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.8
    assert len(mesh.hexes) < most


@pytest.mark.slow
def test_an_elbow_with_flanges_is_straightened_and_bent_back(tmp_path):
    """The volume of a bend is that of the straight pipe (Pappus)."""
    surface, _ = read_surface(write("flanged_elbow", tmp_path))
    surface = placed(surface)
    part = straightened(surface)
    [bend] = part.motions
    assert (bend.angle, bend.length) == pytest.approx((np.pi / 2, 30 * np.pi), rel=1e-3)
    assert np.ptp(part.surface.vertices @ part.axis) == pytest.approx(14 + bend.length)
    assert part.bend(part.surface.vertices) == pytest.approx(surface.vertices, abs=1e-6)
    [candidate] = propose(surface, curvature="0.2%")
    mesh = candidate.blocks
    check_conforming(mesh)
    assert genus(mesh) == 5
    exact = np.pi * (175 * 30 * np.pi + (1024 - 225 - 36) * 8) + (4900 - 225 * np.pi) * 6
    assert volume(mesh) == pytest.approx(exact, rel=0.01)
    assert scaled_jacobian(mesh.vertices, mesh.hexes).min() > 0.4
    assert max(feature.distance for feature in inspect(mesh, surface).features) < 3e-3


def test_parts_without_round_bends_are_not_straightened():
    assert straightened(box((0, 0, 0), (1, 1, 1))) is None
    assert (
        straightened(bent(SQUARE, [(4, 3, 90)])) is None
    )  # its faces may move along the axis, too
    assert straightened(revolved((2, 0), (3, 0), (3, 1), (2, 2))) is None


@pytest.mark.slow
def test_a_bend_between_two_places_of_one_part_is_refused(tmp_path):
    surface, _ = read_surface(write("handled", tmp_path))
    with pytest.raises(NoBackgroundError, match="its bends form a ring"):
        straightened(surface)


def test_a_bar_that_is_twisted_about_its_own_axis_is_refused():
    part = bent(SQUARE, [(0, 8, 90)])
    shares = np.linspace(0, 1, len(part.vertices) // 4)
    rings = [
        Rotation.from_rotvec([0, 0, 2 * share]).apply(np.insert(SQUARE, 2, 9 * share, axis=1))
        for share in shares
    ]
    with pytest.raises(NoBackgroundError, match="its section is not constant"):
        path(replace(part, vertices=np.concatenate(rings)))


def test_other_parts_are_refused_with_the_reason(caplog):
    with pytest.raises(NoBackgroundError, match="it has no CAD faces"):
        path(box((0, 0, 0), (1, 1, 1)))
    with pytest.raises(NoBackgroundError, match="it has no bend"):
        path(bent(SQUARE, [(4, 0, 0)]))
    tapered = bent(SQUARE, [(4, 3, 90)])
    end = np.unique(tapered.faces[tapered.region == 2])
    moved = tapered.vertices.copy()
    moved[end] += 0.2 * (moved[end] - moved[end].mean(axis=0))
    caplog.set_level(logging.INFO)
    assert propose(replace(tapered, vertices=moved)) == []
    assert "bent: nothing is proposed, because its section is not constant" in caplog.text
    assert measures.is_closed(tapered.faces)
