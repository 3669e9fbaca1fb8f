"""Turned parts: axis, profile, core, and hexes that fill them."""

import logging
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from polycube.hexmesh.background.background import NoBackgroundError
from polycube.hexmesh.background.columns import disc, feet
from polycube.hexmesh.background.smoothing import sines
from polycube.hexmesh.connectivity import genus
from polycube.plugins.structure.background.axis import main_axis
from polycube.plugins.structure.background.profile import profile
from polycube.surface import measures
from polycube.surface.voxels import winding_numbers
from polycube.types import Candidate, TriMesh
from tests.conftest import first_quick
from tests.fixtures import columns
from tests.fixtures.columns import check_fills
from tests.fixtures.machined import bored
from tests.fixtures.surfaces import box
from tests.fixtures.turned import BLIND, SHAFT, SHELL, SLEEVE, revolved

TURN = Rotation.random(random_state=3).as_matrix()


def propose(surface: TriMesh, **options) -> list[Candidate]:
    return columns.propose("turned", surface, **{"curvature": None, **options})


def placed(surface: TriMesh, scale: float = 1.0) -> TriMesh:
    return replace(surface, vertices=scale * surface.vertices @ TURN.T + 5)


@pytest.mark.parametrize("given", [SHAFT, SLEEVE, BLIND], ids=["shaft", "sleeve", "blind"])
def test_surfaces_of_the_tests_are_closed_and_have_the_volume_of_their_profile(given):
    surface = revolved(*given, n=400)
    z, r = np.array([*given, given[0]], float).T
    cones = np.diff(z) * (r[1:] ** 2 + r[1:] * r[:-1] + r[:-1] ** 2) / 3
    assert measures.is_closed(surface.faces)
    assert measures.volume(surface) == pytest.approx(np.pi * abs(cones.sum()), rel=1e-3)


@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e3])
def test_the_axis_is_exact(scale):
    axis = main_axis(placed(revolved(*SHAFT), scale))
    assert abs(axis.frame[2] @ TURN[:, 2]) == pytest.approx(1, abs=1e-12)
    assert np.linalg.norm(np.cross(axis.origin - 5, TURN[:, 2])) < 1e-8 * scale * 60
    assert axis.frame @ axis.frame.T == pytest.approx(np.eye(3))


@settings(max_examples=20, deadline=None)
@given(st.lists(st.tuples(st.floats(0.1, 9), st.floats(0, 9), st.floats(-7, 7)), min_size=1))
def test_places_in_space_have_the_coordinates_of_which_they_are_made(places):
    axis = main_axis(placed(revolved(*SLEEVE)))
    turned = np.array(places)[:, [2, 0, 1]]
    at, angle = axis.cylindrical(axis.place(turned))
    assert at == pytest.approx(turned[:, :2])
    assert np.cos(angle - turned[:, 2]) == pytest.approx(np.ones(len(places)))


@pytest.mark.parametrize("given", [SHAFT, SLEEVE, BLIND], ids=["shaft", "sleeve", "blind"])
def test_the_profile_is_exact_between_the_meridians(given):
    surface = revolved(*given, n=17)
    axis = main_axis(surface)
    part = profile(surface, axis)
    lines = part.points[part.lines]
    ends = np.unique(np.round(lines.reshape(-1, 2), 6), axis=0)
    along, origin = axis.frame[2, 2], axis.origin[2]
    wanted = np.array(given, float)
    wanted[:, 0] = along * (wanted[:, 0] - origin)
    assert abs(along) == 1
    assert ends == pytest.approx(np.unique(np.round(wanted, 6), axis=0), abs=1e-5)
    assert part.is_cyclic and np.diff(part.levels) == pytest.approx([2 * np.pi])


def test_the_section_of_rings_is_the_profile():
    [candidate] = propose(revolved(*SLEEVE, n=96))
    quads, number = feet(candidate.blocks)
    assert len(np.unique(number)) == 1 and number.sum() == len(candidate.blocks.hexes)
    angle = np.arctan2(*candidate.blocks.vertices[quads][..., :2].T)
    assert np.ptp(angle) < 1e-6


def test_the_planes_of_a_half_are_levels():
    surface = placed(revolved(*SHELL, half=True))
    part = profile(surface, main_axis(surface))
    assert np.diff(part.levels) == pytest.approx([np.pi, np.pi])


@pytest.mark.parametrize("number", [8, 12, 16, 24, 48])
def test_a_disc_is_filled_with_convex_quads(number):
    vertices, quads = disc(number)
    rim = np.exp(2j * np.pi * np.arange(number) / number)
    assert vertices[:number] @ [1, 1j] == pytest.approx(rim)
    assert sines(vertices, quads).min() > 0.6
    a, b, c, d = (vertices[quads[:, k]] for k in range(4))
    area = np.cross(c - a, d - b).sum() / 2
    assert area == pytest.approx(number / 2 * np.sin(2 * np.pi / number))


@pytest.mark.parametrize(
    ("surface", "handles", "least"),
    first_quick(
        2,
        [
            (revolved(*SHAFT), 0, 0.4),
            (revolved(*SLEEVE), 1, 0.5),
            (revolved(*BLIND), 0, 0.4),
            (revolved(*SHELL, half=True), 0, 0.5),
        ],
    ),
    ids=["shaft", "sleeve", "blind", "half shell"],
)
def test_hexes_fill_the_part(surface, handles, least):
    surface = placed(surface)
    [candidate] = propose(surface, around_hole=24)
    mesh = candidate.blocks
    check_fills(mesh, surface, 0.02, least)
    assert genus(mesh) == handles
    middles = mesh.vertices[mesh.hexes].mean(axis=1)
    assert winding_numbers(surface, middles).min() > 0.9


@pytest.mark.slow
def test_a_larger_part_elsewhere_has_the_same_hexes():
    surface = revolved(*SLEEVE)
    moved = replace(surface, vertices=8 * surface.vertices + [3, 4, 5])
    [here], [there] = propose(surface), propose(moved)
    assert np.array_equal(here.blocks.hexes, there.blocks.hexes)
    assert there.blocks.vertices == pytest.approx(8 * here.blocks.vertices + [3, 4, 5], abs=1e-4)


@pytest.mark.parametrize(
    ("surface", "reason"),
    [
        (box(), "it has no CAD faces"),
        (bored(), "a face is not turned about the axis near"),
        (revolved(*BLIND[:3], (30, 0), half=True), "it is only a sector, and contains the axis"),
    ],
    ids=["no faces", "a bored plate", "a half with its axis"],
)
def test_nothing_is_proposed_for_other_parts(surface, reason, caplog):
    caplog.set_level(logging.INFO)
    assert propose(surface) == []
    assert f"turned: nothing is proposed, because {reason}" in caplog.text


def test_a_part_of_planes_has_no_axis():
    surface = replace(box(), region=np.arange(12) // 2 + 1)
    with pytest.raises(NoBackgroundError, match="all its faces are plane"):
        main_axis(surface)
